"""A picture of a trade-off: error against cost, with the Pareto front."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

from .output import check_path, replace
from .table import Row, Tradeoff

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


def plot(table: Tradeoff, path: Path, overwrite: bool) -> None:
    """Draw a table (see :meth:`Tradeoff.plot`)."""
    check_path("Tradeoff.plot", path, FORMATS, overwrite)
    figure = figure_class()(figsize=(7.0, 4.6), layout="constrained")
    axes = figure.add_subplot()
    along, floor = _longest(table), _floor(table)
    for series, rows in _series(table, along).items():
        good = [row for row in rows if not row.diverged]
        # No line and no legend for a single series without a name.
        axes.plot(
            [row.cost for row in good], [max(row.error, floor) for row in good],
            "o-", markersize=4, linewidth=1, label=series or None,
        )  # fmt: skip
        for row in good if len(table.rows) <= LABELS else []:
            axes.annotate(
                _value(row, along), (row.cost, max(row.error, floor)), fontsize=7,
                xytext=(3, 3), textcoords="offset points",
            )  # fmt: skip
    front = table.pareto()
    if front:
        axes.step(
            [row.cost for row in front], [max(row.error, floor) for row in front],
            where="post", color="0.3", linestyle="--", linewidth=1, label="Pareto front", zorder=0,
        )  # fmt: skip
    _draw_diverged(axes, table, along)
    axes.set(
        xscale="log", yscale="log" if front else "linear",
        xlabel="cost [wall seconds per simulated second]",
        ylabel="error", title=f"{table.scene}: error by {along}",
    )  # fmt: skip
    axes.set_title(table.error, fontsize=7, loc="right", y=-0.22)
    axes.grid(True, which="major", alpha=0.3)
    if axes.get_legend_handles_labels()[0]:
        axes.legend(fontsize=8)
    stream = io.BytesIO()
    figure.savefig(stream, format=path.suffix.lower()[1:], dpi=150)
    replace(path, stream.getvalue())


def _draw_diverged(axes: Any, table: Tradeoff, along: str) -> None:
    """Crosses along the top edge, where there is no error to place them by."""
    rows = [row for row in table.diverged if row.costs]
    if not rows:
        return
    edge = axes.get_xaxis_transform()
    axes.plot(
        [row.cost for row in rows], [0.97] * len(rows), "x", color="tab:red", transform=edge,
        label="diverged", clip_on=False,
    )  # fmt: skip
    for row in rows if len(table.rows) <= LABELS else []:
        axes.annotate(
            _value(row, along), (row.cost, 0.97), xycoords=edge, fontsize=7, color="tab:red",
            xytext=(3, -8), textcoords="offset points",
        )  # fmt: skip


def _longest(table: Tradeoff) -> str:
    """The knob that the lines follow: of those that vary, the one with the most values."""
    return max(table.vary, key=lambda name: len(table.vary[name]))


def _series(table: Tradeoff, along: str) -> dict[str, list[Row]]:
    """Rows that differ in the knob ``along`` only, by what the others are."""
    series: dict[str, list[Row]] = {}
    for row in table.rows:
        others = (f"{name}={row.values[name]}" for name in table.vary if name != along)
        series.setdefault(", ".join(others), []).append(row)
    return series


def _floor(table: Tradeoff) -> float:
    """Where to draw an error of zero, which has no place on a logarithmic axis."""
    least = min((row.error for row in table.stable if row.error > 0), default=1.0)
    return 0.1 * least


def _value(row: Row, along: str) -> str:
    value = row.values[along]
    return f"{value:.3g}" if isinstance(value, float) else str(value)
