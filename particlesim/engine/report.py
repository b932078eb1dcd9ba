"""Reports: results that show themselves as text, and what parts have to report of themselves."""

from __future__ import annotations

import html
import io
from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np


class Report:
    """A result whose ``str()`` is made to be read: what a prompt and a notebook show of it."""

    def __repr__(self) -> str:
        return str(self)

    def _repr_html_(self) -> str:
        """Its text for notebooks, in columns that no narrow page breaks."""
        return f'<pre style="white-space: pre; overflow-x: auto">{html.escape(str(self))}</pre>'


class Solved(NamedTuple):
    """What somebody who iterates in every substep has come to, by world.

    Args:
        what: What the error is of.
        error: Of the last substep, (worlds,).
        iterations: That it took, (worlds,).
        missed: The largest error of all substeps that ended above the tolerance; 0 where none did.
        tolerance: Of the error.
    """

    what: str
    error: np.ndarray
    iterations: np.ndarray
    missed: np.ndarray
    tolerance: float


def grid(heads: Iterable[tuple[str, Any]], rows: Iterable[Sequence[str]]) -> list[str]:
    """Lines of columns; a head is a name, and ``"left"`` or ``"right"``."""
    from rich import box
    from rich.console import Console
    from rich.table import Table

    table = Table(box=box.SIMPLE, show_edge=False, pad_edge=False)
    for name, justify in heads:
        table.add_column(name, justify=justify)
    for row in rows:
        table.add_row(*row)
    stream = io.StringIO()
    # Not of the notebook's kind: that one would be shown there at once.
    console = Console(
        file=stream, width=1000, color_system=None, markup=False, highlight=False,
        force_jupyter=False,
    )  # fmt: skip
    console.print(table)
    return [line.rstrip() for line in stream.getvalue().splitlines()]
