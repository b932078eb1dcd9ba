"""Results of a race: who was how fast, and whether all found the same."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from ...engine.report import Report, grid
from ..table import amount, duration
from .case import Case
from .row import Row

MANY = 500_000  # particles from which memory is theirs, and not that of compiled code


@dataclass(frozen=True, repr=False)
class Result(Report):
    """What a race gave. ``str()`` makes the table.

    rows: one for each entry and number of cores. versions: of the peers' packages and programs.
    missing: those that are not installed.
    """

    name: str
    case: Case
    device: str
    rows: list[Row]
    versions: dict[str, str]
    missing: list[str]

    @property
    def finished(self) -> list[Row]:
        """Who got to the end."""
        return [row for row in self.rows if not row.failure]

    @property
    def differences(self) -> list[str]:
        """Where answers differ by more than they may, in words."""
        found = []
        for key, tolerance in self.case.agree.items():
            have = [row for row in self.finished if key in row.answers]
            for row in have[1:]:
                mine, first = row.answers[key], have[0].answers[key]
                if not math.isclose(mine, first, rel_tol=tolerance):
                    found.append(
                        f"{key} of {row.name} on {row.threads} is {mine:.6g}, {first:.6g} of "
                        f"{have[0].name}: more than {tolerance:g} apart"
                    )
        return found

    @property
    def good(self) -> bool:
        """Everybody got to the end, and all agree."""
        return len(self.finished) == len(self.rows) and not self.differences

    def _first(self, row: Row) -> Row | None:
        """With whom a row is compared: the first one on as many cores."""
        return next((each for each in self.finished if each.threads == row.threads), None)

    def __str__(self) -> str:
        heads = ["", "precision", "cores", "a block", f"{self.case.unit}/s", "spread", "CPU",
                 "ratio", "B/particle", *self._answers]  # fmt: skip
        sides = ["left", "left", *["right"] * (len(heads) - 2)]
        lines = [f"{self.name}: {self.case.title}; {self.device}", ""]
        lines += grid(zip(heads, sides, strict=True), [self._cells(row) for row in self.finished])
        lines += [""]
        lines += [f"{row.name} on {row.threads} failed: {row.failure}"
                  for row in self.rows if row.failure]  # fmt: skip
        dropped = sum(row.dropped for row in self.finished)
        if dropped:
            blocks = sum(len(row.spans) for row in self.finished)
            lines += [f"{dropped} of {blocks} blocks were disturbed and do not count"]
        lines += [f"DIFFERENT: {each}" for each in self.differences] or [self._agreement()]
        if self.versions:
            lines += [", ".join(f"{name} {version}" for name, version in self.versions.items())]
        if self.missing:
            lines += [f"not installed: {', '.join(self.missing)}"]
        return "\n".join(lines)

    @property
    def _answers(self) -> list[str]:
        """Names of all answers, first those that are to agree."""
        given = [key for row in self.finished for key in row.answers]
        return list(dict.fromkeys([*self.case.agree, *given]))

    def _cells(self, row: Row) -> list[str]:
        first = self._first(row)
        return [
            row.name,
            row.precision,
            str(row.threads),
            duration(row.block),
            amount(row.rate),
            f"{100 * row.spread:.0f} %",
            duration(row.cpu),
            "-" if first is None else f"{row.times(first):.2f}",
            f"{row.memory / row.particles:.0f}" if row.particles >= MANY else "-",
            *(_shown(row.answers.get(key)) for key in self._answers),
        ]

    def _agreement(self) -> str:
        if not self.case.agree:
            return "nothing is compared but the time"
        bounds = ", ".join(f"{key} within {100 * t:g} %" for key, t in self.case.agree.items())
        return f"the answers agree: {bounds}"

    @property
    def plain(self) -> dict[str, Any]:
        """As numbers and words, for a file."""
        return {
            "name": self.name,
            "title": self.case.title,
            "unit": self.case.unit,
            "device": self.device,
            "rows": [row.plain for row in self.rows],
            "agree": dict(self.case.agree),
            "differences": self.differences,
            "versions": self.versions,
            "missing": self.missing,
        }


def _shown(value: float | None) -> str:
    return "-" if value is None else f"{value:.5g}"
