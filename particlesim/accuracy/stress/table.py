"""Results of a stress sweep, as a table."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator
from dataclasses import dataclass

from ... import validate
from ...scene.settings import Settings
from ..table import grid

HELD, REFUSED, RECOVERED, FAILED = OUTCOMES = ("held", "refused", "recovered", "failed")


@dataclass(frozen=True)
class Result:
    """How a case ended.

    outcome: ``"held"``, ``"refused"``, ``"recovered"`` or ``"failed"``. energy, place: differences
    from the finer run, None where there was nothing to compare. words: what the user was told.
    stopped: the watchdog ended the run.
    """

    name: str
    outcome: str
    energy: float | None
    place: float | None
    words: str
    stopped: bool = False


@dataclass(frozen=True)
class Stress:
    """All cases of a sweep; ``str()`` makes the table."""

    results: tuple[Result, ...]
    settings: Settings
    frames: int
    tolerance: float

    def __iter__(self) -> Iterator[Result]:
        return iter(self.results)

    def __len__(self) -> int:
        return len(self.results)

    def count(self, outcome: str) -> int:
        """How many cases ended so."""
        validate.choice("Stress.count", "outcome", outcome, OUTCOMES)
        return sum(each.outcome == outcome for each in self.results)

    def __str__(self) -> str:
        heads = [(name, "left") for name in ("case", "outcome", "energy", "place", "what was said")]
        lines = grid(heads, [_cells(each) for each in self.results])
        total = ", ".join(f"{self.count(outcome)} {outcome}" for outcome in OUTCOMES)
        return "\n".join([*lines, "", f"{len(self)} cases: {total}"])


def _cells(result: Result) -> list[str]:
    numbers = (result.energy, result.place)
    shown = ("" if value is None else format(value, ".1e") for value in numbers)
    words = textwrap.shorten(result.words, 100, placeholder=" ...")
    return [result.name, result.outcome, *shown, words]
