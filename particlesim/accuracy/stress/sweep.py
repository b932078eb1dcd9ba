"""The sweep: every case beside a finer run of the same start."""

from __future__ import annotations

import textwrap
import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from ... import validate
from ...engine.report import Report, grid
from ...instruments.watchdog.incident import SimulationError
from ...scene.scene import Scene
from ...scene.settings import Settings
from ..study import Plan, Study
from .cases import Case, cases
from .trace import Trace

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


@dataclass(frozen=True, repr=False)
class Stress(Report):
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


OWNER = "stress"
FINER = 4  # times the substeps of the scene, in the run that shows what is right
TOLERANCE = 0.2  # of the scales in Trace.difference


def stress(
    build: Callable[[], Scene | Sequence[Scene]],
    settings: Settings,
    *,
    frames: int = 5,
    tolerance: float = TOLERANCE,
    device: Any = None,
    worlds: int | None = None,
    progress: Callable[[int, int, str], None] | None = None,
) -> Stress:
    """Run a scene at the extremes of its knobs and of its state, and say how each case ended.

    A case *held* if it ended finite, within ``tolerance`` of the places of a run with four times
    the substeps of the scene, and with no more energy than that (numerical damping is bounded, and
    only reported). It was *refused* if an error or a warning said what is wrong, and it *recovered*
    if it held once the watchdog was told to retry. Otherwise, finite and wrong without a word, or
    not finite, it *failed*.

    Args:
        build: Makes the scene, a new one at each call.
        settings: The scene's own settings.
        frames: Frames of each case.
        tolerance: Largest difference in energy and place, over the scales of the finer run.
        device: As for a Simulation.
        worlds: As for a Simulation.
        progress: Called as (done, total, name) before each case.

    Returns:
        A table of all cases.

    Raises:
        ValueError: The scene itself, at its own settings, cannot be run.

    Example:
        >>> import particlesim as ps
        >>> def build():
        ...     scene = ps.Scene()
        ...     scene.add_particles([(0, 1, 0), (1, 1, 0)], velocity=(1, 0, 0))
        ...     scene.add_interaction(ps.UniformGravity((0, -9.81, 0)))
        ...     return scene
        >>> ps.stress(build, ps.Settings(), frames=2, device="cpu").count("failed")
        0
    """
    validate.whole(OWNER, "frames", frames, minimum=1)
    validate.number(OWNER, "tolerance", tolerance, above=0.0)
    study = Study(OWNER, build, settings, frames=frames, device=device, worlds=worlds)
    sweep, every = _Sweep(study, tolerance), cases(study.settings)
    results = []
    for k, case in enumerate(every):
        if progress:
            progress(k, len(every), case.name)
        results.append(sweep.run(case))
    return Stress(tuple(results), study.settings, frames, tolerance)


class _Sweep:
    def __init__(self, study: Study, tolerance: float):
        self.study, self.settings, self.tolerance = study, study.settings, tolerance
        self._references: dict[Any, Trace] = {}

    def run(self, case: Case) -> Result:
        """One case, and once more with retries if the watchdog stopped it."""
        result = self._try(case, self.settings)
        if result.outcome == REFUSED and result.stopped:
            again = self._try(case, self.settings.replace(on_failure="retry"))
            if again.outcome == HELD:
                return Result(case.name, RECOVERED, again.energy, again.place, result.words)
        return result

    def _try(self, case: Case, settings: Settings) -> Result:
        with warnings.catch_warnings(record=True) as said:
            warnings.simplefilter("always")
            try:
                trace = self._trace(case, case.knobs(settings))
            except (ValueError, SimulationError, MemoryError) as error:
                return Result(
                    case.name, REFUSED, None, None, str(error), isinstance(error, SimulationError)
                )
        words = "; ".join(dict.fromkeys(str(each.message) for each in said))
        if not trace.finite:
            return Result(case.name, FAILED, None, None, words or "not finite, without a word")
        if not case.comparable:
            return Result(case.name, HELD, None, None, words)
        energy, place = trace.difference(self._reference(case))
        held = energy <= self.tolerance and place <= self.tolerance
        if held and energy < -self.tolerance:
            # What XPBD and one-sided contacts do at large steps; stable, but worth a word.
            words = words or f"held by damping: {-energy:.0%} of the energy is lost to the method"
        outcome = HELD if held else (REFUSED if words else FAILED)
        return Result(case.name, outcome, energy, place, words)

    def _reference(self, case: Case) -> Trace:
        """The finer run of the same start; one for all cases that start alike."""
        if case.disturb not in self._references:
            finer = self.settings.replace(substeps=FINER * self.settings.substeps)
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                self._references[case.disturb] = self._finest(case, finer)
        return self._references[case.disturb]

    def _finest(self, case: Case, settings: Settings) -> Trace:
        """A disturbed start may ask for still finer steps than the scene's own start."""
        for _ in range(3):
            try:
                return self._trace(case, settings)
            except SimulationError:
                settings = settings.replace(substeps=FINER * settings.substeps)
        return self._trace(case, settings)

    def _trace(self, case: Case, settings: Settings) -> Trace:
        trace = Trace()
        sim = self.study.simulation(Plan({}, self.study.options, settings, self.study.frames))
        try:
            if case.disturb is not None:
                sim.diagnostics()  # has every array there that a case may change
                case.disturb(sim)
            trace.add(sim)
            sim.run(self.study.frames, progress=lambda done, frames: trace.add(sim))
        finally:
            sim.close()
        return trace
