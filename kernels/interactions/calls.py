"""How terms ask laws of a distance: by kinds, truncated, derived."""

from collections.abc import Sequence
from dataclasses import dataclass

import warp as wp

from ..warp_internals import arguments as arguments_of
from .selection import ALL, Selection

# A potential whose first argument is called so takes r^2, and so does a force, to give F / r.
SQUARED = "distance_squared"
# Where a law is truncated, and from what part of that on it is smoothed: parameters of a term.
CUT, SWITCH = "truncation_radius", "switching_ratio"


@dataclass(frozen=True)
class Call:
    """How a term asks a law, in source; r and its ``square`` are there.

    Args:
        law: Of the distance, and more.
        arguments: Source of its further arguments, in terms of i, j, d and p.
        selection: Which pairs count, and what goes by their kinds.
        truncation: As of :class:`~particlesim.interactions.pair.Pair`.
    """

    law: wp.Function
    arguments: Sequence[str]
    selection: Selection = ALL
    truncation: str = "cut"

    @property
    def squared(self) -> bool:
        """It takes the square of the distance."""
        return next(iter(arguments_of(self.law))) == SQUARED

    @property
    def potential(self) -> str:
        """Lines that find u, which is the law, truncated."""
        lines = [*self._cut]
        if self.truncation == "force_shift":
            # In front of the law's value: Warp derives nothing of what is called as it is before.
            lines += self._slope
        lines.append(f"u = law{self._of_pair}")
        if self.truncation in ("shift", "force_shift"):
            lines.append(f"u = u - law{self._of_cut}")
        if self.truncation == "force_shift":
            lines.append("u = u - (r - cut) * slope")
        if self.truncation == "xplor":
            lines += [*self._smoothing, "u = u * smooth"]
        return _text(lines)

    @property
    def derivative(self) -> str:
        """Lines that derive the law, a potential, and make w of it, which is F / r."""
        lines = [
            *self._cut, f"{self._names('g')} = wp.grad(law){self._of_pair}",
            f"w = {'real(-2.0) * g0' if self.squared else '-g0 / r'}",
        ]  # fmt: skip
        if self.truncation == "force_shift":
            lines += [*self._slope, "w = w + slope / r"]
        if self.truncation == "xplor":
            lines += [
                *self._smoothing, f"whole = law{self._of_pair}",
                "w = w * smooth - real(2.0) * whole * smooth_slope",
            ]  # fmt: skip
        return _text(lines)

    @property
    def force(self) -> str:
        """Lines that find w by the law, which is a force."""
        lines = [*self._cut, f"w = law{self._of_pair}{'' if self.squared else ' / r'}"]
        if self.truncation == "force_shift":
            at_cut = f"law{self._of_cut}"
            lines.append(f"w = w - {f'{at_cut} * cut' if self.squared else at_cut} / r")
        return _text(lines)

    @property
    def _of_pair(self) -> str:
        return self._given("square" if self.squared else "r")

    @property
    def _of_cut(self) -> str:
        """Of what does not differ from pair to pair, this is found once."""
        return self._given("cut * cut" if self.squared else "cut")

    def _given(self, distance: str) -> str:
        of_pair = [self.selection.there(each) for each in self.arguments]
        return f"({', '.join([distance, *of_pair])})"

    def _names(self, letter: str) -> str:
        return ", ".join(f"{letter}{k}" for k in range(len(self.arguments) + 1))

    @property
    def _cut(self) -> list[str]:
        cut = self.selection.there(f"p.{CUT}")
        return [] if self.truncation == "cut" else [f"cut = {cut}"]

    @property
    def _slope(self) -> list[str]:
        """du/dr at the cutoff."""
        by_r = "real(2.0) * cut * c0" if self.squared else "c0"
        return [f"{self._names('c')} = wp.grad(law){self._of_cut}", f"slope = {by_r}"]

    @property
    def _smoothing(self) -> list[str]:
        """What the potential is multiplied with, and its derivative by r^2.

        S = (c - x)^2 (c + 2 x - 3 a) / (c - a)^3 from x = a = r_on^2 to c = r_cut^2.
        """
        return [
            "c = cut * cut",
            f"a = c * p.{SWITCH} * p.{SWITCH}",
            "x = wp.where(square > a, wp.where(square < c, square, c), a)",
            "per = real(1.0) / ((c - a) * (c - a) * (c - a))",
            "smooth = (c - x) * (c - x) * (c + real(2.0) * x - real(3.0) * a) * per",
            "smooth_slope = real(-6.0) * (c - x) * (x - a) * per",
        ]


def _text(lines: Sequence[str]) -> str:
    return "".join(f"    {line}\n" for line in lines)
