"""What a measurement has found, as an object and as a table."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from ...engine.report import Report, grid
from ...scene.settings import Settings
from ..table import amount
from ..tune.report import line


@dataclass(frozen=True)
class Part:
    """One part of an interval.

    Args:
        error: Its share of the half width.
        cost: CPU seconds of the runs that were made for it.
        work: Of these, in particle-substeps.
        how: How it was found, in words.
    """

    error: float
    cost: float
    work: float
    how: str


@dataclass(frozen=True, repr=False)
class Measured(Report):
    """A number with its error. ``str()`` makes a table.

    Args:
        scene: Name of the scene.
        observe: What was observed, in words.
        value: The number.
        low: Of the interval.
        high: Of the interval.
        confidence: With which it holds the true value.
        parts: What the interval's half width is made of, and what each has cost: by the names
            ``"time"``, ``"space"``, ``"chance"`` and ``"round-off"``.
        order: Order in the substep that was found; None where there is none to be seen.
        settings: What one plain run needs for the error that was allowed, at no more cost.
        options: Of ``build``, likewise.
        frames: Likewise.
        worlds: Seeds that it needs, from ``options["seed"]`` on.
        device: Where.
    """

    scene: str
    observe: str
    value: float
    low: float
    high: float
    confidence: float
    parts: Mapping[str, Part]
    order: float | None
    settings: Settings
    options: dict[str, Any]
    frames: int
    worlds: int
    device: str

    @property
    def error(self) -> float:
        """Half the width of the interval."""
        return 0.5 * (self.high - self.low)

    @property
    def cost(self) -> float:
        """CPU seconds of all runs."""
        return sum(part.cost for part in self.parts.values())

    @property
    def work(self) -> float:
        """Particle-substeps of all runs."""
        return sum(part.work for part in self.parts.values())

    def __str__(self) -> str:
        head = (
            f"{self.observe} of {self.scene} on {self.device}: {self.number} "
            f"({100 * self.confidence:g} %: {self.low:.8g} to {self.high:.8g})"
        )
        rows = [
            (name, f"{part.error:.2g}", f"{part.cost:.2g} s", amount(part.work), part.how)
            for name, part in self.parts.items()
        ]
        rows.append(("sum", f"{self.error:.2g}", f"{self.cost:.2g} s", amount(self.work), ""))
        heads = [
            ("part", "left"), ("+-", "right"), ("cost", "right"), ("particle-substeps", "right"),
            ("how", "left"),
        ]  # fmt: skip
        return "\n".join([head, "", *grid(heads, rows), "", self._plain()])

    @property
    def number(self) -> str:
        """The value with as many digits as the error leaves, as ``2.3683 +- 0.0006``."""
        if not self.error > 0:
            return f"{self.value:.12g}"
        lead = f"{self.error:.1e}"
        digits = 1 - int(lead.partition("e")[2])
        if digits < 0 or digits > 15:
            return f"{self.value:.12g} +- {self.error:.2g}"
        return f"{self.value:.{digits}f} +- {self.error:.{digits}f}"

    def _plain(self) -> str:
        """What one run needs, as Python."""
        build = ", ".join(f"{name}={value!r}" for name, value in self.options.items())
        words = [f"{self.frames} frames"]
        if self.worlds > 1:
            words.append(f"{self.worlds} seeds")
        return f"enough: {line(self.settings)}  # {', '.join(words)} of build({build})"
