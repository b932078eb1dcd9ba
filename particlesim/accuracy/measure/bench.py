"""Bench: runs of a study's plans that are observed, and what they have cost."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ... import validate
from ...instruments.watchdog.incident import SimulationError
from ...simulation.simulation import Simulation
from .. import statistics
from ..study import SEED, Plan, Study
from ..table import assignments
from .over import OWNER, Reduction, final, mean

WORLDS = 64  # of one batch, at most
DRIFT = 0.99  # confidence with which the halves of a steady state must differ, to be none
PARTS = ("time", "space", "chance", "round-off")


@dataclass
class Spent:
    """What runs have cost: CPU seconds of stepping, and particle-substeps."""

    seconds: float = 0.0
    substeps: float = 0.0


@dataclass
class Bench:
    """Runs plans, with seeds of their own, and observes them.

    Args:
        study: The scene.
        observe: Of a simulation: a number, or one a world; then seeds are run as one batch.
        over: Makes one number of what is observed at the start and after every frame.
        first_seed: The first seed of ``build``; None: it has none.
        budget: Wall seconds that may be spent; None: any.
        tell: Gets a line before every run.
        start: Frames that are left out of the beginning.
    """

    study: Study
    observe: Callable[[Any], Any]
    over: Reduction
    first_seed: int | None
    budget: float | None = None
    tell: Callable[[str], None] = print
    start: int = 0
    spent: dict[str, Spent] = field(default_factory=lambda: {part: Spent() for part in PARTS})
    batched: bool | None = None  # whether worlds can be told apart; found with the first run
    began: float = field(default_factory=time.perf_counter)
    device: str = ""

    @property
    def chance(self) -> bool:
        """Whether there is any: other seeds make other scenes of the same kind."""
        return self.first_seed is not None

    @property
    def steady(self) -> bool:
        """Whether it is an average over time that is wanted, however long that takes."""
        return self.over is mean

    def lengthen(self) -> None:
        """Go on with twice the frames."""
        old = self.study
        self.study = Study(
            old.owner, old.build, old.given, old.options, 2 * old.frames, old.device
        )  # fmt: skip

    def leave_out(self, history: np.ndarray) -> None:
        """The start-up transient, of which more is to be seen the more samples there are."""
        if not self.steady:
            return
        count = history.shape[-1]
        found = statistics.transient(history)
        self.start = max(self.start, 1, count // 2 if found is None else found)
        while self.start < count // 2:
            low, high = statistics.drift(history[..., self.start :]).interval(DRIFT)
            if low <= 0.0 <= high:
                break
            self.start += max(1, count // 20)

    def rows(self, plan: Plan, seeds: Sequence[int], part: str) -> np.ndarray:
        """What is observed of each seed, (seeds, frames + 1), or (seeds, 1) where that is enough.

        Raises:
            SimulationError: One of them failed.
        """
        rows, left = [], list(seeds)
        if left:
            self.say(part, plan, plan.frames, len(left))
        while left:
            now = left[: WORLDS if self.batched else 1]
            sim = self.open(plan, now)
            rows += list(self.advance(sim, plan.frames, part).T)
            sim.close()
            left = left[len(now) :]
        return np.array(rows)

    def say(self, part: str, plan: Plan, frames: int, runs: int = 1) -> None:
        """Tell of runs that are about to be made."""
        knobs = assignments({**plan.options, **plan.values}, 4)
        times = f"{runs} times " if runs > 1 else ""
        self.tell(f"{part}: {times}{frames} frames, {knobs}")

    def open(self, plan: Plan, seeds: Sequence[int]) -> Simulation:
        """A simulation at its start, a world for each seed; of no seed, the scene itself."""
        first = self.first_seed
        options = [plan.options if first is None else {**plan.options, SEED: first + k}
                   for k in seeds]  # fmt: skip
        scenes = [self.study.scenes(each)[0] for each in options]
        sim = Simulation(scenes, plan.settings, device=self.study.device)
        self.device = str(sim.device)
        return sim

    def advance(self, sim: Simulation, frames: int, part: str) -> np.ndarray:
        """Run, and what is observed, (m, worlds): the start and every frame, or the end only."""
        rows = []
        if self.over is not final and sim.frame == 0:
            rows.append(self._look(sim))
        for frame in range(frames):
            self.step(sim, part)
            if self.over is not final or frame == frames - 1:
                rows.append(self._look(sim))
        return np.array(rows)

    def step(self, sim: Simulation, part: str) -> None:
        """Run one frame, and keep account of it."""
        self._keep_budget(part)
        spent, begin = self.spent[part], time.process_time()
        sim.step()
        spent.seconds += time.process_time() - begin
        spent.substeps += sim.settings.substeps * sim.particle_count
        if sim.frozen:
            raise SimulationError(f"world {sim.frozen[0]} froze at t = {sim.time:g}")

    def _look(self, sim: Simulation) -> np.ndarray:
        value = read(self.observe, sim)
        if self.batched is None:
            self.batched = value.ndim == 1
        if not np.isfinite(value).all():
            raise SimulationError(f"what is observed is not finite at t = {sim.time:g}")
        return value.reshape(-1)

    def _keep_budget(self, part: str) -> None:
        if self.budget is not None and time.perf_counter() - self.began > self.budget:
            raise validate.fail(
                OWNER, "budget", f"suffice for {part}", f"{self.budget:g} s",
                "give more, or allow a larger error",
            )  # fmt: skip


def read(observe: Callable[[Any], Any], sim: Any) -> np.ndarray:
    """What is observed now: a number of the simulation, (), or one a world, (worlds,)."""
    with np.errstate(all="ignore"):
        value = np.asarray(observe(sim), dtype=np.float64)
    if value.shape not in ((), (sim.world_count,)):
        raise validate.fail(
            OWNER, "observe", "return a number, or one a world", f"an array of {value.shape}",
            "have it return a float",
        )  # fmt: skip
    return value
