"""What a search has found, as an object, as a table, and as a line of Python to paste."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from ...engine.report import Report
from ...scene.settings import Settings
from ..table import assignments


@dataclass(frozen=True)
class Trial:
    """One setting that was tried.

    Args:
        values: Knobs and options that the search chose.
        settings: All knobs.
        options: Of ``build``.
        error: The largest of all seeds; infinite if one of them failed.
        cost: Wall seconds per simulated second.
        cause: Why it failed, if it did.
        spread: By how much the errors of the seeds differ.
        limit: The error to hold the tolerance against; None: as far again as those of the seeds
            differ.
        along: The largest error before the end, at times at which it is known to be one.
        series: Errors (times, seeds) where they were looked at along the run.
    """

    values: dict[str, Any]
    settings: Settings
    options: dict[str, Any]
    error: float
    cost: float
    cause: str = ""
    spread: float = 0.0
    limit: float | None = dataclasses.field(default=None, compare=False)
    along: float = dataclasses.field(default=0.0, compare=False)
    series: Any = dataclasses.field(default=None, repr=False, compare=False)

    @property
    def bound(self) -> float:
        """What the error of yet another seed may be: as far again as those tried differ."""
        return self.error + self.spread if self.limit is None else self.limit

    def __str__(self) -> str:
        knobs = assignments(self.values, 4)
        return f"{knobs}: error {self.error:.3g}, {self.cost:.3g} s per s"


@dataclass(frozen=True, repr=False)
class Tuned(Report):
    """The cheapest settings under a tolerance. ``str()`` makes a report.

    Args:
        scene: Name of the scene.
        tolerance: The error that was allowed.
        measure: What the error is, in words.
        best: What was chosen; its cost is the median of several runs in turn with its rivals.
        trials: All that was tried, in order.
        seeds: How many seeds each was tried with.
        device: Where.
        margin: Part of the tolerance that was stayed under.
        budget: Seconds that a run was allowed to take, where that was asked; else None.
        longer: Part of the run by which it was looked at for longer, the error included.
        seconds: Of a run.
        floor: How far off the reference may itself be.
    """

    scene: str
    tolerance: float
    measure: str
    best: Trial
    trials: Sequence[Trial]
    seeds: int
    device: str
    margin: float = 1.0
    budget: float | None = None
    longer: float = 0.0
    seconds: float = math.nan
    floor: float = 0.0

    @property
    def settings(self) -> Settings:
        """The knobs."""
        return self.best.settings

    @property
    def options(self) -> dict[str, Any]:
        """The options of ``build``, without seeds."""
        return self.best.options

    @property
    def error(self) -> float:
        """The largest error of all seeds, at all times at which it was held to the tolerance."""
        return max(self.best.error, self.best.along)

    @property
    def cost(self) -> float:
        """Wall seconds per simulated second."""
        return self.best.cost

    @property
    def line(self) -> str:
        """The settings as Python to paste."""
        return line(self.settings)

    def __str__(self) -> str:
        build = ", ".join(f"{name}={value!r}" for name, value in self.options.items())
        if self.budget is None:
            asked = f"error {self.error:.3g} of {self.tolerance:g} allowed"
        else:
            asked = f"error {self.error:.3g}, a run of {self.seconds:.3g} s of {self.budget:g} s"
        held = f"held to {100 * self.margin:.0f} % of it" if self.budget is None else "the least"
        longer = f", {100 * self.longer:.0f} % longer than the run" if self.longer else ""
        reference = f"; the reference is off by {self.floor:.2g}" if self.floor else ""
        return (
            f"{self.scene} on {self.device}: {asked}, "
            f"{self.cost:.3g} wall seconds per simulated second\n"
            f"error: {self.measure}, the largest of {self.seeds} "
            f"{'seeds' if self.seeds > 1 else 'run'}, {held}{longer}{reference}; "
            f"{len(self.trials)} settings tried\n\n"
            f"{self.line}{f'  # build({build})' if build else ''}"
        )


def line(settings: Settings) -> str:
    """``ps.Settings(...)`` with dt, substeps and what differs from the defaults."""
    default = Settings()
    words = [f"dt={_fraction(settings.dt)}", f"substeps={settings.substeps}"]
    for field in dataclasses.fields(settings):
        value = getattr(settings, field.name)
        if field.name not in ("dt", "substeps") and value != getattr(default, field.name):
            words.append(f"{field.name}={value!r}")
    return f"ps.Settings({', '.join(words)})"


def _fraction(dt: float) -> str:
    """dt as ``1 / 60`` where that is the very number, and shorter."""
    whole = round(1.0 / dt) if dt > 0 and 1.0 / dt < 1e6 else 0
    exact = whole > 1 and 1.0 / whole == dt
    return min([repr(dt), *([f"1 / {whole}"] if exact else [])], key=len)
