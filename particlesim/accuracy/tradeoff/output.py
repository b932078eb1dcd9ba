"""The rows of a trade-off as text, as JSON and as CSV."""

from __future__ import annotations

import csv
import dataclasses
import io
import json
import math
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from ...engine.report import grid
from ...output.files import check_new
from ..table import amount, shown, write
from .row import Row

FORMATS = (".json", ".csv")


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
    return {
        "error": row.error,
        "diverged": row.diverged,
        "cause": row.cause,
        "wall_seconds_per_simulated_second": row.cost,
        "relative_spread": row.spread,
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


def lines(names: Iterable[str], rows: Sequence[Row], front: Sequence[Row]) -> list[str]:
    """The table for people: one line a row, a star on the Pareto front."""
    names = list(names)
    measured = ("error", "s per s", "spread", "particle-substeps/s", "arrays")
    heads = [(name, "right") for name in (*names, *measured)]
    return grid([*heads, ("", "left")], [_cells(row, names, front) for row in rows])


def _cells(row: Row, names: list[str], front: Sequence[Row]) -> list[str]:
    star = "*" if any(row is each for each in front) else ""
    return [
        *(shown(row.values[name]) for name in names),
        *(shown(value) if math.isfinite(value) else "-" for value in (row.error, row.cost)),
        f"{100 * row.spread:.0f} %" if len(row.costs) > 1 else "-",
        amount(row.rate),
        f"{amount(row.array_bytes, 1024)}B",
        "diverged" if row.diverged else star,
    ]
