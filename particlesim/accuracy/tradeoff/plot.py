"""A picture of a trade-off: a work-precision diagram, with the Pareto front and error bars."""

from __future__ import annotations

import io
import itertools
import math
import textwrap
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ...output.files import check_new
from ..table import shown, write
from .costs import along_of, series_of
from .row import Row

FORMATS = (".png", ".svg", ".pdf")
# Okabe and Ito 2008: told apart by all eyes, and by their markers in grey.
COLORS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
MARKERS = ("o", "s", "^", "D", "v", "P", "X")
LINES = ("-", "--", "-.", ":")
APART = 0.05  # of the height of the picture: labels that are nearer are not both written
FEW = 2.5  # decades, below which what lies between powers of ten gets numbers too
LINE = 96  # characters of the words below


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
    """Draw rows (see :meth:`Tradeoff.plot`); ``about``: the scene, and what the error is."""
    owner = "Tradeoff.plot"
    check_new(owner, path, overwrite, suffixes=FORMATS)
    figure = figure_class()(figsize=(8.0, 5.4), layout="constrained")
    axes = figure.add_subplot()
    along = along_of(vary)  # the lines follow the knob with the most values
    logarithmic = any(row.error > 0 for row in rows if not row.diverged)
    axes.set(xscale="log", yscale="log" if logarithmic else "linear")
    # An error of zero has no place on a logarithmic axis.
    floor = 0.1 * min((row.error for row in rows if not row.diverged and row.error > 0), default=1)
    if len(front) > 1:
        axes.step(
            [row.cost for row in front], [max(row.error, floor) for row in front],
            where="post", color="0.8", linewidth=5, solid_joinstyle="round", label="Pareto front",
            zorder=0,
        )  # fmt: skip
    series = series_of(rows, along)
    styles = itertools.product(LINES, zip(COLORS, MARKERS, strict=True))
    for (name, members), (line, (color, marker)) in zip(
        series.items(), itertools.cycle(styles), strict=False
    ):
        good = [row for row in members if not row.diverged and row.costs]
        label = name or f"by {along}"
        _draw(axes, good, floor, color=color, marker=marker, linestyle=line, label=label)
    diverged = [row for row in rows if row.diverged and row.costs]
    _draw_diverged(axes, diverged)
    _write_values(axes, rows, along, floor)
    _dress(figure, axes, about, along)
    stream = io.BytesIO()
    figure.savefig(stream, format=path.suffix.lower()[1:], dpi=120)
    write(owner, path, stream.getvalue())


def _draw(axes: Any, rows: Sequence[Row], floor: float, **style: Any) -> None:
    """A line of rows, with how far costs spread and where the medians of seeds lie."""
    x = np.array([row.cost for row in rows])
    y = np.array([max(row.error, floor) for row in rows])
    least, most = np.array([(min(row.costs), max(row.costs)) for row in rows]).reshape(-1, 2).T
    low, high = np.array([_bounds(row) for row in rows]).reshape(-1, 2).T
    axes.errorbar(
        x, y, xerr=[x - least, most - x],
        yerr=[np.maximum(y - np.maximum(low, floor), 0), np.maximum(high - y, 0)],
        markersize=5, linewidth=1.4, elinewidth=1, capsize=2.5, **style,
    )  # fmt: skip


def _bounds(row: Row) -> tuple[float, float]:
    """Of the error: the interval of the median, or of few seeds all they had."""
    low, high = row.interval
    return (low, high) if math.isfinite(low) else (min(row.errors), max(row.errors))


def _draw_diverged(axes: Any, rows: Sequence[Row]) -> None:
    """Crosses along the top edge, where there is no error to place them by."""
    if rows:
        axes.plot(
            [row.cost for row in rows], [0.97] * len(rows), "x", color="tab:red", markersize=7,
            transform=axes.get_xaxis_transform(), label="diverged", clip_on=False,
        )  # fmt: skip


def _write_values(axes: Any, rows: Sequence[Row], along: str, floor: float) -> None:
    """Write the value of the knob beside its points, where no other is in the way."""
    axes.margins(0.08, 0.12)
    axes.autoscale_view()
    taken: list[tuple[str, np.ndarray]] = []
    to_part = axes.transData + axes.transAxes.inverted()
    for row in rows:
        if not row.costs:
            continue
        where = (row.cost, 0.0) if row.diverged else (row.cost, max(row.error, floor))
        place = np.asarray(to_part.transform(where))
        if row.diverged:
            place[1] = 0.97
        text = shown(row.values[along])
        if any(np.abs(place - other).max() < APART for _, other in taken):
            continue
        taken.append((text, place))
        axes.annotate(
            text, place, xycoords="axes fraction", fontsize=9, xytext=(6, 5),
            textcoords="offset points", color="tab:red" if row.diverged else "0.25",
        )  # fmt: skip


def _between(value: float) -> str:
    """A label for 2 and 5 times a power of ten; of what lies closer there would be too many."""
    mantissa, exponent = f"{value:.0e}".split("e")
    wanted = mantissa in ("2", "5")
    return rf"${mantissa}\times10^{{{int(exponent)}}}$" if wanted else ""


def _dress(figure: Any, axes: Any, about: tuple[str, str], along: str) -> None:
    """Axes, title, legend and the words of what the error is."""
    axes.set_xlabel("cost [wall seconds per simulated second]", fontsize=11)
    axes.set_ylabel("error", fontsize=11)
    axes.set_title(f"{about[0]}: error against cost; numbers are {along}", fontsize=12)
    axes.tick_params(which="both", labelsize=10)
    for axis, (low, high) in ((axes.xaxis, axes.get_xlim()), (axes.yaxis, axes.get_ylim())):
        if axis.get_scale() == "log":
            few = math.log10(high / low) < FEW
            axis.set_minor_formatter(lambda value, _, few=few: _between(value) if few else "")
    axes.grid(True, which="major", alpha=0.35)
    axes.grid(True, which="minor", alpha=0.1)
    if axes.get_legend_handles_labels()[0]:
        axes.legend(fontsize=10, framealpha=0.9)
    figure.supxlabel("\n".join(textwrap.wrap(f"error: {about[1]}", LINE)), fontsize=9, color="0.35")
