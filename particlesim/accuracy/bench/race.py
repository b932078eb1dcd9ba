"""Races: all entries of a case in turn, round by round, so that a noisy machine slows all alike."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from .case import Case, Entry, Place
from .files import load_case
from .machine import version_of
from .result import Result
from .row import Row
from .worker import Failed, Worker


def race(
    path: Path,
    options: Mapping[str, Any],
    *,
    threads: Sequence[int],
    device: str,
    peers: bool,
    repeats: int | None = None,
    progress: Callable[[int, int, str], None] = lambda done, total, doing: None,
) -> Result:
    """Run a case.

    Args:
        path: Its file.
        options: Of its ``case``.
        threads: Numbers of cores; every entry runs on each of them.
        device: Of the simulations.
        peers: Whether other programs take part, where they are installed.
        repeats: Timed blocks; None: the case's own.
        progress: Called with blocks done, all blocks, and what is being done.
    """
    case = load_case(path, options)
    rounds = case.repeats if repeats is None else repeats
    wanted = {**case.ours, **(case.peers if peers else {})}
    needs = {each.needs: each.there for each in wanted.values() if each.needs}
    lanes = [
        _Lane(path, options, name, entry, name in case.peers, Place(count, device))
        for count in threads
        for name, entry in wanted.items()
        if entry.there
    ]
    total = (1 + rounds) * len(lanes)
    try:
        for number, lane in enumerate(lanes):
            progress(number, total, f"starting {lane.row.name}")
            lane.start(case)
        for turn in range(rounds):
            for number, lane in enumerate(lanes):
                progress((1 + turn) * len(lanes) + number, total, lane.row.name)
                lane.advance()
        for lane in lanes:
            lane.ask()
    finally:
        for lane in lanes:
            lane.close()
    progress(total, total, "")
    versions = {name: version_of(name) for name, there in needs.items() if there}
    missing = [name for name, there in needs.items() if not there]
    return Result(path.stem, case, device, [lane.row for lane in lanes], versions, missing)


class _Lane:
    """An entry of the race, and the row that it fills."""

    def __init__(
        self, path: Path, options: Mapping[str, Any], name: str, entry: Entry, peer: bool,
        place: Place,
    ):  # fmt: skip
        self.row = Row(name, peer, entry.precision, place.threads)
        self._make = lambda: Worker(path, options, name, place)
        self._worker: Worker | None = None

    def start(self, case: Case) -> None:
        """Make it, and have it run warm."""
        try:
            self._worker = self._make()
            self.row.work, self.row.particles = self._worker.work, self._worker.particles
        except Failed as error:
            self._fail(error)
        for _ in range(case.warm):
            self._do(lambda worker: worker.advance())

    def advance(self) -> None:
        """A timed block."""
        self._do(lambda worker: self.row.spans.append(worker.advance()))

    def ask(self) -> None:
        """What it has found."""
        self._do(lambda worker: self.row.answers.update(worker.answers()))
        self._do(lambda worker: vars(self.row).update(memory=worker.memory()))

    def close(self) -> None:
        """End its process."""
        if self._worker is not None:
            self._worker.close()
            self._worker = None

    def _do(self, what: Callable[[Worker], Any]) -> None:
        if self._worker is None:
            return
        try:
            what(self._worker)
        except Failed as error:
            self._fail(error)

    def _fail(self, error: Failed) -> None:
        self.row.failure = str(error)
        self.close()
