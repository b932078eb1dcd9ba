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
from ..table import amount
from . import output
from .plot import plot
from .row import Row, fitted_order

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

    @property
    def stable(self) -> list[Row]:
        """The rows that did not diverge, the cheapest first."""
        return sorted((row for row in self.rows if not row.diverged), key=lambda row: row.cost)

    @property
    def diverged(self) -> list[Row]:
        """The rows that did."""
        return [row for row in self.rows if row.diverged]

    def pareto(self) -> list[Row]:
        """The rows than which none is both as cheap and as accurate, the cheapest first."""
        front: list[Row] = []
        for row in sorted(self.stable, key=lambda row: (row.cost, row.error)):
            if not front or row.error < front[-1].error:
                front.append(row)
        return front

    def cheapest(self, *, error: float) -> Row:
        """The cheapest row whose error is at most ``error``.

        Raises:
            ValueError: There is none; the message says how small the error got.
        """
        error = validate.number("Tradeoff.cheapest", "error", error, minimum=0.0)
        for row in self.stable:
            if row.error <= error:
                return row
        least = min((row.error for row in self.stable), default=math.inf)
        raise validate.fail(
            "Tradeoff.cheapest", "error", f"be at least {least:.3g}, the smallest of the sweep",
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
        owner, names = "Tradeoff.order", list(self.vary)
        validate.choice(owner, "knob", knob, names)
        validate.known(owner, others, [name for name in names if name != knob], "name")
        for value in self.vary[knob]:
            if isinstance(value, bool) or not isinstance(value, int | float) or value <= 0:
                raise validate.fail(
                    owner, f"values of {knob}", "be numbers above 0", value, "vary another knob"
                )
        groups: dict[str, list[tuple[float, float]]] = {}
        for row in self.stable:
            rest = {name: value for name, value in row.values.items() if name != knob}
            if row.error > 0 and others.items() <= rest.items():
                groups.setdefault(repr(rest), []).append((row.values[knob], row.error))
        points = [np.array(group).T for group in groups.values()]
        usable = [(x, y) for x, y in points if len(np.unique(x)) > 1]
        if not usable:
            raise validate.fail(
                owner, f"settings that differ in {knob}", "be at least two with an error above 0",
                [row.error for row in self.rows], "vary it further",
            )  # fmt: skip
        whole = all(isinstance(value, int) for value in self.vary[knob])
        finer = -1 if knob in STEPS else 1 if whole else 0
        return fitted_order(usable, finer)

    def orders(self) -> dict[str, float]:
        """The order of every knob that has three values or more and can be fitted."""
        found = {}
        for knob, values in self.vary.items():
            if len(values) > 2:
                try:
                    found[knob] = self.order(knob)
                except ValueError:
                    continue
        return found

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
        about = f"{self.scene}: error", self.error
        plot(Path(path), overwrite, about, self.vary, self.rows, self.pareto())

    def __str__(self) -> str:
        runs = "1 run" if self.repeats == 1 else f"median of {self.repeats} runs"
        notes = [f"order of convergence of {knob}: {p:.2f}" for knob, p in self.orders().items()]
        if self.process_bytes:
            notes.append(f"most memory of the whole process: {amount(self.process_bytes, 1024)}B")
        return "\n".join([
            f"{self.scene}: {self.duration:g} s on {self.device}, {runs}",
            f"error: {self.error}",
            "s per s: wall seconds per simulated second; *: nothing is both cheaper and more "
            "accurate",
            "", *output.lines(self.vary, self.rows, self.pareto()), "",
            *notes, *(f"diverged, {row.label()}: {row.cause}" for row in self.diverged),
        ])  # fmt: skip
