"""A trade-off as text, as JSON and as CSV."""

from __future__ import annotations

import csv
import dataclasses
import io
import json
import math
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ... import validate
from .table import Row, Tradeoff

FORMATS = (".json", ".csv")


def check_path(owner: str, path: Path, formats: Sequence[str], overwrite: bool) -> None:
    """Refuse a file of another suffix, and one that exists."""
    if path.suffix.lower() not in formats:
        raise validate.fail(
            owner, "path", f"end in {', '.join(formats)}", str(path), "choose one of these"
        )
    if path.exists() and not overwrite:
        raise validate.fail(
            owner, "path", "be a new file", str(path), "choose another or overwrite it"
        )


def replace(path: Path, content: bytes) -> None:
    """Write a file at once or not at all."""
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        part.write_bytes(content)
        os.replace(part, path)
    finally:
        part.unlink(missing_ok=True)


def save(table: Tradeoff, path: Path, overwrite: bool) -> None:
    """Write a table as its suffix says (see :meth:`Tradeoff.save`)."""
    check_path("Tradeoff.save", path, FORMATS, overwrite)
    content = as_json(table) if path.suffix.lower() == ".json" else as_csv(table)
    replace(path, content.encode())


def as_json(table: Tradeoff) -> str:
    """Everything; numbers that are not finite become null."""
    front = {id(row) for row in table.pareto()}
    document = {
        **{name: getattr(table, name) for name in table.__dataclass_fields__ if name != "rows"},
        "order": table.orders(),
        "rows": [
            {
                **_figures(row),
                "pareto": id(row) in front,
                "costs": row.costs,
                "values": row.values,
                "settings": dataclasses.asdict(row.settings),
                "options": row.options,
            }
            for row in table.rows
        ],
    }
    return json.dumps(_plain(document), indent=1, allow_nan=False) + "\n"


def as_csv(table: Tradeoff) -> str:
    """One line a row: what varied, then what was measured."""
    front = {id(row) for row in table.pareto()}
    lines = [{**row.values, **_figures(row), "pareto": id(row) in front} for row in table.rows]
    stream = io.StringIO()
    writer = csv.DictWriter(stream, list(lines[0]) if lines else [], lineterminator="\n")
    writer.writeheader()
    writer.writerows(lines)
    return stream.getvalue()


def _figures(row: Row) -> dict[str, Any]:
    """What was measured, with its units in the names."""
    return {
        "error": row.error,
        "diverged": row.diverged,
        "cause": row.cause,
        "wall_seconds_per_simulated_second": row.cost,
        "relative_spread": row.spread,
        "particle_substeps_per_second": row.rate,
        "particles": row.particles,
        "array_bytes": row.array_bytes,
    }


def _plain(value: Any) -> Any:
    """What JSON can hold; other objects as their text."""
    if isinstance(value, dict):
        return {str(key): _plain(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(each) for each in value]
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    return value if value is None or isinstance(value, bool | int | str) else str(value)


def text(table: Tradeoff) -> str:
    """The table for people: one line a row, a star on the Pareto front, causes below."""
    from rich import box
    from rich.console import Console
    from rich.table import Table

    grid = Table(box=box.SIMPLE, show_edge=False, pad_edge=False)
    for name in table.vary:
        grid.add_column(name, justify="right")
    for name in ("error", "s per s", "spread", "particle-substeps/s", "arrays", ""):
        grid.add_column(name, justify="left" if not name else "right")
    front = {id(row) for row in table.pareto()}
    for row in table.rows:
        mark = "diverged" if row.diverged else "*" if id(row) in front else ""
        grid.add_row(
            *(_shown(row.values[name]) for name in table.vary),
            _shown(row.error), _shown(row.cost), _percent(row),
            amount(row.rate), f"{amount(row.array_bytes, 1024)}B", mark,
        )  # fmt: skip
    stream = io.StringIO()
    console = Console(file=stream, width=1000, color_system=None, markup=False, highlight=False)
    console.print(grid)
    lines = [line.rstrip() for line in stream.getvalue().splitlines()]
    return "\n".join([*_heading(table), "", *lines, "", *_notes(table)])


def _heading(table: Tradeoff) -> list[str]:
    runs = "1 run" if table.repeats == 1 else f"median of {table.repeats} runs"
    return [
        f"{table.scene}: {table.duration:g} s on {table.device}, {runs}",
        f"error: {table.error}",
        "s per s: wall seconds per simulated second; *: nothing is both cheaper and more accurate",
    ]


def _notes(table: Tradeoff) -> list[str]:
    notes = [f"order of convergence of {knob}: {p:.2f}" for knob, p in table.orders().items()]
    if table.process_bytes:
        notes.append(f"most memory of the whole process: {amount(table.process_bytes, 1024)}B")
    return notes + [f"diverged, {row.label()}: {row.cause}" for row in table.diverged]


def _percent(row: Row) -> str:
    return f"{100 * row.spread:.0f} %" if len(row.costs) > 1 else "-"


def _shown(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:.3g}" if math.isfinite(value) else "-"
    return str(value)


def amount(value: float, step: int = 1000) -> str:
    """A number with a prefix, as ``1.23 M``."""
    if not math.isfinite(value):
        return "-"
    for prefix in ("", "k", "M", "G"):
        if abs(value) < 999.5 or prefix == "G":
            break
        value /= step
    binary = "i" if prefix and step == 1024 else ""
    return f"{value:.3g} {prefix.upper() if binary else prefix}{binary}"
