"""Frames: recorded once, run as often as asked, and again when a row of neighbours was full."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol

import numpy as np
import warp as wp

from .. import validate
from ..kernels.instruments.watchdog import peak_kernel
from ..scene.settings import Settings
from .execution.acting import record_acts
from .execution.executors import Executor
from .execution.frame import Frame
from .execution.launch import Program, launch, owner, record
from .loop import Loop
from .snapshot import Snapshot
from .state import State


class Guard(Protocol):
    """Who looks at the state at the end of every frame."""

    def look(self, state: State) -> None:
        """Launches only."""

    def forget(self) -> None:
        """What was seen is void: the frame is done again."""


class Runner(Protocol):
    """Who runs a frame, as an :class:`~.execution.executors.Executor` does."""

    frame: Frame
    chosen: Any

    def run(self) -> None:
        """Run it once."""

    def close(self) -> None:
        """End what runs beside."""


class Frames:
    """The ways a loop's frame is run, by its number of substeps.

    Args:
        loop: With all its observers.
        guard: Looks at the end of a frame.
    """

    def __init__(self, loop: Loop, guard: Guard):
        self.loop, self.guard = loop, guard
        self.snapshot = Snapshot(loop)
        self.runner: Callable[[Frame, Settings, Any], Runner] = Executor  # makes who runs a frame
        self._executors: dict[int, Runner] = {}
        self._generation = 0

    def executor(self, substeps: int) -> Runner:
        """What runs a frame of so many substeps; made on first use."""
        generation = self.loop.neighbors.generation
        if self._generation != generation:
            self.close()  # what was recorded points to rows that were too short
            self._generation = generation
        if substeps not in self._executors:
            self._executors[substeps] = self._new(substeps)
        return self._executors[substeps]

    def run(self, substeps: int) -> None:
        """One frame. Nothing is ever left out of a full row: back to its start, and again."""
        self.executor(substeps).run()
        while self.loop.neighbors.overflowing:
            self._restart()
            self.executor(substeps).run()
        self.loop.unknown_forces.clear()

    def back(self) -> None:
        """To the start of the last frame."""
        self.snapshot.restore()
        self.guard.forget()

    def place_on_constraints(self, iterations: int) -> None:
        """See :meth:`Loop.place_on_constraints`; again where a row of neighbours was full."""
        self.snapshot.take()
        self.loop.place_on_constraints(iterations)
        while self.loop.neighbors.overflowing:
            self._restart()
            self.loop.place_on_constraints(iterations)

    def peaks(self, substeps: int) -> np.ndarray:
        """One frame, and the largest |v_a| that each particle had at the end of a substep, (n,)."""
        model = self.loop.model
        peak = model.array(np.zeros(model.particle_count), model.precision.scalar)
        while True:
            executor = self._new(substeps, peak)
            executor.run()
            executor.close()
            if not self.loop.neighbors.overflowing:
                return peak.numpy().astype(np.float64)
            self._restart()
            peak.zero_()

    def close(self, *, but: int | None = None) -> None:
        """Let go of graphs and threads, but of those for so many substeps."""
        for substeps in self._executors.keys() - {but}:
            self._executors.pop(substeps).close()

    def _restart(self) -> None:
        """Make room in the rows that were full, and go back to the start of the frame."""
        self.loop.neighbors.lengthen()
        self.back()

    def _new(self, substeps: int, peak: wp.array | None = None) -> Runner:
        frame = self._record(substeps, peak)
        return self.runner(frame, self.loop.settings, self.loop.model.device)

    def _record(self, substeps: int, peak: wp.array | None) -> Frame:
        """A frame of so many substeps; ``peak``: where to note the largest speeds."""
        loop, frame = self.loop, Frame(repeat=substeps)
        model, state = loop.model, loop.state

        def substep() -> None:
            loop.substep(loop.settings.dt / substeps)
            if peak is not None:
                kernel = peak_kernel(model.precision)
                launch(kernel, model.particle_count, [state.velocity, peak], model.device)

        with record(frame.before), owner("snapshot"):
            self.snapshot.take()
        frame.substep = record_acts(loop.actors, substep)
        self._refuse_idle(frame.substep)
        with record(frame.after):
            self.guard.look(state)
        return frame

    def _refuse_idle(self, substep: Program) -> None:
        """Of a part of one's own nothing was recorded: what it does it has done once and for all.

        Ready parts know where there is nothing to do for them. Thermostats are asked by what moves.
        """
        loop = self.loop
        methods: list[tuple[Any, Callable[..., None]]]
        methods = [(part, part.apply) for part in loop.passes]
        methods += [(part, part.project) for part in loop.constraints]
        methods += [(part, part.exchange) for part in loop.thermostats]
        for part, method in methods:
            ready = method.__module__.partition(".")[0] == __name__.partition(".")[0]
            if id(part) not in substep.acted and not ready and self._has_members(part):
                raise validate.fail(
                    part.name, method.__name__, "launch something whenever it is called", None,
                    "use ps.launch or wp.launch, or set host = True where it works in NumPy",
                )  # fmt: skip

        for part in loop.thermostats:
            if id(part) not in substep.acted and self._has_members(part):
                raise validate.fail(
                    loop.integrator.name, "advance", f"drift by drift or move, where {part.name} "
                    "acts", None, "use these, or leave the thermostat out",
                )  # fmt: skip

    def _has_members(self, part: Any) -> bool:
        return len(self.loop.model.members([peer.group for peer in part.peers], part.name)) > 0
