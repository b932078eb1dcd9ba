"""What a search has found, as an object, as a table, and as a line of Python to paste."""

from __future__ import annotations

import dataclasses
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
    """

    values: dict[str, Any]
    settings: Settings
    options: dict[str, Any]
    error: float
    cost: float
    cause: str = ""
    spread: float = 0.0

    @property
    def bound(self) -> float:
        """What the error of yet another seed may be: as far again as those tried differ."""
        return self.error + self.spread

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
    """

    scene: str
    tolerance: float
    measure: str
    best: Trial
    trials: Sequence[Trial]
    seeds: int
    device: str

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
        """The largest error of all seeds."""
        return self.best.error

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
        return (
            f"{self.scene} on {self.device}: error {self.error:.3g} of {self.tolerance:g} "
            f"allowed, {self.cost:.3g} wall seconds per simulated second\n"
            f"error: {self.measure}, the largest of {self.seeds} "
            f"{'seeds' if self.seeds > 1 else 'run'}; {len(self.trials)} settings tried\n\n"
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
