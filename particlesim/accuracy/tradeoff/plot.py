"""A picture of a trade-off: error against cost, with the Pareto front."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from ...output.files import check_new
from ..table import shown, write
from .row import Row

FORMATS = (".png", ".svg", ".pdf")
LABELS = 60  # points that still get their value written beside them


def figure_class() -> Any:
    """matplotlib's Figure, which needs no display.

    Raises:
        ImportError: matplotlib is missing.
    """
    try:
        from matplotlib.figure import Figure
    except ModuleNotFoundError:
        raise ImportError(
            "Tradeoff.plot: matplotlib must be installed, got none; "
            "pip install 'particlesim[plot]'."
        ) from None
    return Figure


def plot(
    path: Path,
    overwrite: bool,
    about: tuple[str, str],
    vary: Mapping[str, Sequence[Any]],
    rows: Sequence[Row],
    front: Sequence[Row],
) -> None:
    """Draw rows (see :meth:`Tradeoff.plot`); ``about``: the title, and what the error is."""
    owner = "Tradeoff.plot"
    check_new(owner, path, overwrite, suffixes=FORMATS)
    figure = figure_class()(figsize=(7.0, 4.6), layout="constrained")
    axes = figure.add_subplot()
    # The lines follow the knob with the most values.
    along = max(vary, key=lambda name: len(vary[name]))
    # An error of zero has no place on a logarithmic axis.
    floor = 0.1 * min((row.error for row in rows if not row.diverged and row.error > 0), default=1)
    named = len(rows) <= LABELS
    for series, members in _series(rows, along).items():
        good = [row for row in members if not row.diverged]
        # No line and no legend for a single series without a name.
        axes.plot(
            [row.cost for row in good], [max(row.error, floor) for row in good],
            "o-", markersize=4, linewidth=1, label=series or None,
        )  # fmt: skip
        for row in good if named else []:
            axes.annotate(
                shown(row.values[along]), (row.cost, max(row.error, floor)), fontsize=7,
                xytext=(3, 3), textcoords="offset points",
            )  # fmt: skip
    if front:
        axes.step(
            [row.cost for row in front], [max(row.error, floor) for row in front],
            where="post", color="0.3", linestyle="--", linewidth=1, label="Pareto front", zorder=0,
        )  # fmt: skip
    _draw_diverged(axes, [row for row in rows if row.diverged and row.costs], along, named)
    axes.set(
        xscale="log", yscale="log" if front else "linear",
        xlabel="cost [wall seconds per simulated second]",
        ylabel="error", title=f"{about[0]} by {along}",
    )  # fmt: skip
    axes.set_title(about[1], fontsize=7, loc="right", y=-0.22)
    axes.grid(True, which="major", alpha=0.3)
    if axes.get_legend_handles_labels()[0]:
        axes.legend(fontsize=8)
    stream = io.BytesIO()
    figure.savefig(stream, format=path.suffix.lower()[1:], dpi=150)
    write(owner, path, stream.getvalue())


def _draw_diverged(axes: Any, rows: Sequence[Row], along: str, named: bool) -> None:
    """Crosses along the top edge, where there is no error to place them by."""
    if not rows:
        return
    edge = axes.get_xaxis_transform()
    axes.plot(
        [row.cost for row in rows], [0.97] * len(rows), "x", color="tab:red", transform=edge,
        label="diverged", clip_on=False,
    )  # fmt: skip
    for row in rows if named else []:
        axes.annotate(
            shown(row.values[along]), (row.cost, 0.97), xycoords=edge, fontsize=7,
            color="tab:red", xytext=(3, -8), textcoords="offset points",
        )  # fmt: skip


def _series(rows: Sequence[Row], along: str) -> dict[str, list[Row]]:
    """Rows that differ in the knob ``along`` only, by what the others are."""
    series: dict[str, list[Row]] = {}
    for row in rows:
        others = (f"{name}={value}" for name, value in row.values.items() if name != along)
        series.setdefault(", ".join(others), []).append(row)
    return series
