"""Tradeoff: the table of a sweep, and the questions it answers."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ... import validate
from ...engine.report import Report
from ..statistics import Order, independent
from . import output
from .costs import CostModel, along_of, models, speedups
from .notes import credible, notes
from .orders import fitted_order
from .plot import plot
from .row import Row

STEPS = ("dt",)  # of these less is finer


@dataclass(frozen=True, repr=False)
class Tradeoff(Report):
    """What the settings of a sweep cost, and how accurate they are. ``str()`` makes the table.

    Args:
        scene: Name of the scene.
        error: What the error is, in words.
        rows: One a setting, in the order of the sweep, those that diverged included.
        vary: The names that vary, and their values.
        duration: Simulated time of each run [s].
        repeats: Runs of each setting.
        device: Where it ran.
        bound: Error beyond which a run counts as diverged.
        process_bytes: Most memory the process has held so far; 0: not known.
        scale: What errors are compared with, the largest change of what is observed; nan: nothing.
        floor: How far off the reference may itself be: smaller errors mean nothing.
        conserved: Whether the error is of what a right run would keep.
        seeds: How many seeds the errors are of.
    """

    scene: str
    error: str
    rows: Sequence[Row]
    vary: dict[str, list[Any]] = field(default_factory=dict)
    duration: float = 0.0
    repeats: int = 1
    device: str = ""
    bound: float = math.inf
    process_bytes: int = 0
    scale: float = math.nan
    floor: float = 0.0
    conserved: bool = False
    seeds: int = 1

    @property
    def stable(self) -> list[Row]:
        """The rows that did not diverge, the cheapest first."""
        return sorted((row for row in self.rows if not row.diverged), key=lambda row: row.cost)

    @property
    def diverged(self) -> list[Row]:
        """The rows that did."""
        return [row for row in self.rows if row.diverged]

    def pareto(self) -> list[Row]:
        """The rows than which none is both as cheap and as accurate, the cheapest first.

        Of several seeds a row counts as more accurate only if it is not so by chance.
        """
        front: list[Row] = []
        for row in sorted(self.stable, key=lambda row: (row.cost, row.error)):
            if not front or (row.error < front[-1].error and row.surely_better(front[-1])):
                front.append(row)
        return front

    def contenders(self) -> list[Row]:
        """Rows beside the front that its costs cannot be told from.

        What keeps them off is cheaper by less than both spread from repeat to repeat.
        """
        front = self.pareto()
        found = []
        for row in self.stable:
            rivals = [each for each in front if not row.surely_better(each)]
            if not any(row is each for each in front) and all(
                row.cost * (1 - row.spread) < each.cost * (1 + each.spread) for each in rivals
            ):
                found.append(row)
        return found

    def cheapest(self, *, error: float) -> Row:
        """The cheapest row whose error is at most ``error``.

        Raises:
            ValueError: There is none (the message says how small the error got), or the reference
                is itself farther off.
        """
        owner = "Tradeoff.cheapest"
        error = validate.number(owner, "error", error, minimum=0.0)
        if error < self.floor < math.inf:
            raise validate.fail(
                owner, "error", f"be at least {self.floor:.3g}, by which the reference may be off",
                error, "use fewer frames, averages over time, or another error",
            )  # fmt: skip
        for row in self.stable:
            if row.error <= error:
                return row
        least = min((row.error for row in self.stable), default=math.inf)
        raise validate.fail(
            owner, "error", f"be at least {least:.3g}, the smallest of the sweep",
            error, "vary towards finer settings",
        )  # fmt: skip

    def fastest_stable(self) -> Row:
        """The cheapest row that did not diverge, however large its error.

        Raises:
            ValueError: All diverged.
        """
        if not self.stable:
            raise validate.fail(
                "Tradeoff.fastest_stable", "rows", "hold one that did not diverge",
                f"{len(self.rows)} that did", "vary towards finer settings",
            )  # fmt: skip
        return self.stable[0]

    # Orders -------------------------------------------------------------------------------------

    def order(self, knob: str, **others: Any) -> float:
        """Order of convergence p of a knob: error ~ knob^-p, or dt^p for dt.

        Fitted by least squares in logarithms over the part of the sweep that converges; with one
        height for each combination of the other names that vary, and one exponent. Positive when
        finer is better, about 0 where the knob does not matter. For ``dt`` smaller is finer, for
        whole numbers larger is; for other options whichever the errors fall with.

        Args:
            knob: A name that varies, with numbers for values.
            **others: Fit only where other names have these values: ``precision="float64"``.

        Raises:
            ValueError: Not a number, or fewer than two settings with an error above 0.
        """
        return self.order_fit(knob, **others).value

    def order_fit(self, knob: str, **others: Any) -> Order:
        """:meth:`order` with its standard error, and how far off the line the worst point is.

        Of several seeds the error is that of how the seeds' own orders differ, if that is larger.
        """
        owner, names = "Tradeoff.order", list(self.vary)
        validate.choice(owner, "knob", knob, names)
        validate.known(owner, others, [name for name in names if name != knob], "name")
        for value in self.vary[knob]:
            if isinstance(value, bool) or not isinstance(value, int | float) or value <= 0:
                raise validate.fail(
                    owner, f"values of {knob}", "be numbers above 0", value, "vary another knob"
                )
        fit = self._fit(knob, others, None)
        if fit is None:
            raise validate.fail(
                owner, f"settings that differ in {knob}", "be at least two with an error above 0",
                [row.error for row in self.rows], "vary it further",
            )  # fmt: skip
        if self.seeds > 1:
            each = [self._fit(knob, others, seed) for seed in range(self.seeds)]
            own = independent([one.value for one in each if one is not None])
            if own.error > fit.error or fit.degrees < 1:
                return Order(fit.value, own.error, int(own.degrees), fit.off)
        return fit

    def _fit(self, knob: str, others: dict[str, Any], seed: int | None) -> Order | None:
        """The fit of medians, or of one seed; None where there are too few points."""
        groups: dict[str, list[tuple[float, float]]] = {}
        for row in self.stable:
            rest = {name: value for name, value in row.values.items() if name != knob}
            error = row.error if seed is None else row.errors[seed]
            if error > 0 and others.items() <= rest.items():
                groups.setdefault(repr(rest), []).append((row.values[knob], error))
        points = [np.array(group).T for group in groups.values()]
        usable = [(x, y) for x, y in points if len(np.unique(x)) > 1]
        if not usable:
            return None
        whole = all(isinstance(value, int) for value in self.vary[knob])
        return fitted_order(usable, -1 if knob in STEPS else 1 if whole else 0)

    def order_fits(self) -> dict[str, Order]:
        """The fit of every knob that has three values or more and can be fitted."""
        found = {}
        for knob, values in self.vary.items():
            if len(values) > 2:
                try:
                    found[knob] = self.order_fit(knob)
                except ValueError:
                    continue
        return found

    def orders(self) -> dict[str, float]:
        """The orders that the errors bear out: they fall, and on a line."""
        return {knob: fit.value for knob, fit in self.order_fits().items() if credible(fit)}

    # Costs --------------------------------------------------------------------------------------

    def cost_models(self) -> list[CostModel]:
        """What frames cost by their substeps and particles, of every way of running them."""
        return models(self.rows)

    def cost_of(
        self, *, substeps: int, dt: float | None = None, particles: int | None = None, **way: Any
    ) -> float:
        """Wall seconds per simulated second of what was not run, by the model of costs.

        Args:
            substeps: Of a frame.
            dt: Of a frame [s]; None: that of the first row.
            particles: How many; None where their number does not vary.
            **way: Values of the other names that vary, as ``precision="float64"``.

        Raises:
            ValueError: No such way, or not enough rows of it to know.
        """
        owner = "Tradeoff.cost_of"
        substeps = validate.whole(owner, "substeps", substeps, minimum=1)
        found = [each for each in self.cost_models() if way.items() <= each.values.items()]
        if len(found) != 1:
            raise validate.fail(
                owner, "names", "choose one model of costs", way,
                f"there are {[str(each) for each in self.cost_models()]}",
            )  # fmt: skip
        if particles is None and found[0].particles is None:
            raise validate.fail(
                owner, "particles", "be given where their number varies", None, "say how many"
            )
        step = self.rows[0].settings.dt if dt is None else validate.number(owner, "dt", dt, above=0)
        return found[0].seconds(substeps, particles or 0) / step

    def speedups(self, error: float | None = None) -> list[str]:
        """How many times as fast one way is as another at the same error, in words.

        Args:
            error: At which; None: the smallest power of ten that two ways reach.
        """
        return speedups(self.rows, along_of(self.vary), error) if self.vary else []

    # Output -------------------------------------------------------------------------------------

    def save(self, path: str | Path, *, overwrite: bool = False) -> None:
        """Write the table as ``.json``, everything, or ``.csv``, one line a row.

        Args:
            path: The file; its suffix chooses.
            overwrite: Replace an existing one.

        Raises:
            ValueError: Another suffix, or a file that exists.
        """
        about = {name: getattr(self, name) for name in self.__dataclass_fields__ if name != "rows"}
        about["order"] = self.orders()
        output.save(Path(path), overwrite, about, self.rows, self.pareto())

    def plot(self, path: str | Path, *, overwrite: bool = False) -> None:
        """Draw error against cost with the Pareto front into a picture; needs matplotlib.

        Args:
            path: The picture; its suffix, ``.png``, ``.svg`` or ``.pdf``, chooses the format.
            overwrite: Replace an existing one.

        Raises:
            ImportError: matplotlib is missing. ValueError: Another suffix, or a file that exists.
        """
        about = self.scene, self.error
        plot(Path(path), overwrite, about, self.vary, self.rows, self.pareto())

    def __str__(self) -> str:
        return "\n".join(notes(self))
