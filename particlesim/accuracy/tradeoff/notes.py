"""What a trade-off says in words: how errors fall, what cannot be told apart, what it costs."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from typing import Any

from ..statistics import Order
from ..table import amount, shown
from . import output
from .row import Row

FLAT = 0.25  # an order below this is none: errors hardly fall
KEPT = 1e-3  # a drift above this that does not fall is none of rounding
MODELS = 6  # of costs that are written out, at most


def credible(fit: Order) -> bool:
    """Whether errors fall by a power law: they do not lie about its line at random."""
    if fit.degrees < 1:
        return fit.value > FLAT
    return fit.value > FLAT and fit.interval().low > 0.0


def notes(table: Any) -> list[str]:
    """The lines of a table's text."""
    runs = "1 run" if table.repeats == 1 else f"median of {table.repeats} runs"
    seeds = f", {table.seeds} seeds" if table.seeds > 1 else ""
    chains = _chains(table)
    none = _not_conserved(table) or (len(chains) == 1 and len(table.stable) > 1)
    front, near = ([], []) if none else (table.pareto(), table.contenders())
    told = ", ~: as far as told" if near else ""
    legend = "no front" if none else f"*: nothing is both cheaper and more accurate{told}"
    return [
        f"{table.scene}: {table.duration:g} s on {table.device}, {runs}{seeds}",
        f"error: {table.error}",
        *_scale(table),
        f"s per s: wall seconds per simulated second; {legend}",
        "", *output.lines(table.vary, table.rows, front, near, table.seeds), "",
        *_orders(table), *_alike(chains), *([] if none else table.speedups()), *_costs(table),
        *_memory(table), *(f"diverged, {row.label()}: {row.cause}" for row in table.diverged),
    ]  # fmt: skip


def _scale(table: Any) -> list[str]:
    if not math.isfinite(table.scale):
        return []
    words = f"relative: over {shown(table.scale)}, the largest change of what is compared"
    if table.floor and any(row.error < table.floor for row in table.stable):
        words += f"; errors below {shown(table.floor)} mean nothing: the reference is off by that"
    return [words]


def _not_conserved(table: Any) -> bool:
    """Whether a drift of what should be kept does not fall, and is none of rounding."""
    fits = table.order_fits() if table.conserved else {}
    least = min((row.error for row in table.stable), default=0.0)
    return bool(fits) and least > KEPT and not any(credible(fit) for fit in fits.values())


def _orders(table: Any) -> list[str]:
    lines = []
    for knob, fit in table.order_fits().items():
        reach = fit.interval().high - fit.value
        if credible(fit):
            lines.append(f"order of convergence of {knob}: {fit.value:.2f}")
            if fit.degrees > 0:
                off = f"the worst point is off the line by {100 * (fit.off - 1):.1f} %"
                lines.append(f"    fitted within {reach:.2g} (95 %); {off}")
        elif fit.value <= FLAT and (fit.degrees < 1 or reach < 1.0):
            why = ": not conserved here" if _not_conserved(table) else ""
            lines.append(f"error does not fall with {knob}{why} (order {fit.value:.2f})")
        else:
            lines.append(
                f"no order of {knob}: {fit.value:.2g} within {reach:.2g} (95 %), the worst point "
                f"is off the line by a factor of {fit.off:.2g}"
            )
    return lines


def _chains(table: Any) -> list[list[Row]]:
    """Rows by their errors; together where these differ no more than seeds or chance explain."""
    chains: list[list[Row]] = []
    chance = max((row.parts.get("chance", 0.0) for row in table.stable), default=0.0)
    if table.seeds < 2 and chance == 0.0:
        return chains
    for row in sorted(table.stable, key=lambda row: row.error):
        first = chains[-1][0] if chains else row
        if chains and (row.error <= chance or not first.surely_better(row)):
            chains[-1].append(row)
        else:
            chains.append([row])
    return chains


def _alike(chains: list[list[Row]]) -> list[str]:
    """Rows that cannot be told apart, in words."""
    lines = [
        "errors cannot be told apart (95 %): " + "; ".join(row.label() for row in chain)
        for chain in chains
        if len(chain) > 1
    ]
    if len(lines) == len(chains) == 1:
        lines.append("no front and no order: all errors differ by chance only; run longer, or more")
    return lines


def _costs(table: Any) -> list[str]:
    found: Sequence[Any] = table.cost_models()
    return [str(each) for each in itertools.islice(found, MODELS)]


def _memory(table: Any) -> list[str]:
    if not table.process_bytes:
        return []
    return [f"most memory of the whole process: {amount(table.process_bytes, 1024)}B"]
