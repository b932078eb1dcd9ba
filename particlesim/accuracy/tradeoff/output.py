"""The rows of a trade-off as text, as JSON and as CSV."""

from __future__ import annotations

import csv
import dataclasses
import io
import json
import math
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any

from ...engine.report import grid
from ...output.files import check_new
from ..table import amount, duration, shown, write
from .row import Row

FORMATS = (".json", ".csv")
Cell = Callable[[Row], str]  # what a row has in a column


def save(
    path: Path, overwrite: bool, about: dict[str, Any], rows: Sequence[Row], front: Sequence[Row]
) -> None:
    """Write rows as the suffix says (see :meth:`Tradeoff.save`)."""
    owner = "Tradeoff.save"
    check_new(owner, path, overwrite, suffixes=FORMATS)
    is_json = path.suffix.lower() == ".json"
    content = as_json(about, rows, front) if is_json else as_csv(rows, front)
    write(owner, path, content.encode())


def as_json(about: dict[str, Any], rows: Sequence[Row], front: Sequence[Row]) -> str:
    """Everything; numbers that are not finite become null."""
    document = {
        **about,
        "rows": [
            {
                **_figures(row, front),
                "costs": row.costs,
                "values": row.values,
                "settings": dataclasses.asdict(row.settings),
                "options": row.options,
            }
            for row in rows
        ],
    }
    return json.dumps(_plain(document), indent=1, allow_nan=False) + "\n"


def as_csv(rows: Sequence[Row], front: Sequence[Row]) -> str:
    """One line a row: what varied, then what was measured."""
    lines = [{**row.values, **_figures(row, front)} for row in rows]
    stream = io.StringIO()
    writer = csv.DictWriter(stream, list(lines[0]) if lines else [], lineterminator="\n")
    writer.writeheader()
    writer.writerows(lines)
    return stream.getvalue()


def _figures(row: Row, front: Sequence[Row]) -> dict[str, Any]:
    """What was measured, with its units in the names."""
    several = len(row.errors) > 1
    return {
        "error": row.error,
        **({"error_low": row.interval.low, "error_high": row.interval.high} if several else {}),
        **({"relative_error": row.relative} if math.isfinite(row.relative) else {}),
        **{f"{name}_error": value for name, value in row.parts.items()},
        "diverged": row.diverged,
        "cause": row.cause,
        "wall_seconds_per_simulated_second": row.cost,
        "cpu_seconds_per_simulated_second": row.cpu_cost,
        "relative_spread": row.spread,
        "set_up_seconds": row.set_up,
        "compiling_seconds": row.compiling,
        "particle_substeps_per_second": row.rate,
        "particles": row.particles,
        "array_bytes": row.array_bytes,
        "pareto": any(row is each for each in front),
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


def lines(
    names: Iterable[str], rows: Sequence[Row], front: Sequence[Row], near: Sequence[Row], seeds: int
) -> list[str]:
    """The table for people: one line a row, a star on the Pareto front, a tilde near it."""
    columns = _columns(list(names), rows, seeds)
    body = [
        [*(cell(row) for cell in columns.values()), _mark(row, front, near)]
        for row in rows
    ]  # fmt: skip
    return grid([*((name, "right") for name in columns), ("", "left")], body)


def _columns(names: list[str], rows: Sequence[Row], seeds: int) -> dict[str, Cell]:
    """The columns, of what there is to show, and what each row has in them."""
    columns: dict[str, Cell] = {name: _value(name) for name in names}
    columns["error"] = lambda row: _number(row.error)
    if seeds > 1:
        columns["95 %"] = lambda row: " - ".join(_number(each) for each in row.interval)
    if any(math.isfinite(row.relative) for row in rows):
        columns["relative"] = lambda row: _number(row.relative)
    for part in {name: None for row in rows for name in row.parts}:
        columns[part] = _part(part)
    columns["s per s"] = lambda row: _number(row.cost)
    if any(row.cpu_costs for row in rows):
        columns["cpu s per s"] = lambda row: _number(row.cpu_cost)
    columns["spread"] = lambda row: f"{100 * row.spread:.0f} %" if len(row.costs) > 1 else "-"
    if any(math.isfinite(row.set_up) for row in rows):
        columns["set-up"] = lambda row: duration(row.set_up)
        columns["compiling"] = lambda row: duration(row.compiling)
    columns["particle-substeps/s"] = lambda row: amount(row.rate)
    columns["arrays"] = lambda row: f"{amount(row.array_bytes, 1024)}B"
    return columns


def _value(name: str) -> Cell:
    return lambda row: shown(row.values[name])


def _part(name: str) -> Cell:
    return lambda row: _number(row.parts.get(name, math.nan))


def _number(value: float) -> str:
    return shown(value) if math.isfinite(value) else "-"


def _mark(row: Row, front: Sequence[Row], near: Sequence[Row]) -> str:
    if row.diverged:
        return "diverged"
    if any(row is each for each in front):
        return "*"
    return "~" if any(row is each for each in near) else ""
