"""Frames: recorded once, run as often as asked, and again when a row of neighbours was full."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...kernels.instruments.watchdog import peak_kernel
from .executors import Executor
from .launch import Frame, launch, record

if TYPE_CHECKING:
    import warp as wp

    from ...simulation.simulation import Simulation


def record_frame(sim: Simulation, substeps: int, peak: wp.array | None = None) -> Frame:
    """Record a frame of so many substeps; ``peak``: where to note the largest speeds."""
    frame = Frame(repeat=substeps)
    with record(frame.before):
        sim.snapshot.take()
    with record(frame.substep):
        sim.substep(sim.settings.dt / substeps)
        if peak is not None:
            kernel = peak_kernel(sim.model.precision)
            launch(kernel, sim.particle_count, [sim.state.velocity, peak], sim.device)
    with record(frame.after):
        sim.watchdog.look(sim)
    return frame


class Frames:
    """The ways a simulation's frame is run, by its number of substeps."""

    def __init__(self) -> None:
        self._executors: dict[int, Executor] = {}
        self._generation = 0

    def executor(self, sim: Simulation, substeps: int) -> Executor:
        """What runs a frame of so many substeps; made on first use."""
        if self._generation != sim.neighbors.generation:
            self.close()  # what was recorded points to rows that were too short
            self._generation = sim.neighbors.generation
        if substeps not in self._executors:
            frame = record_frame(sim, substeps)
            self._executors[substeps] = Executor(frame, sim.settings, sim.device)
        return self._executors[substeps]

    def run(self, sim: Simulation, substeps: int) -> None:
        """One frame. Nothing is ever left out of a full row: back to its start, and again."""
        self.executor(sim, substeps).run()
        while sim.neighbors.overflowing:
            sim.neighbors.lengthen()
            sim.snapshot.restore()
            sim.watchdog.flag.zero_()
            self.executor(sim, substeps).run()

    def peaks(self, sim: Simulation, substeps: int) -> np.ndarray:
        """One frame, and the largest |v_a| that each particle had at the end of a substep, (n,)."""
        peak = sim.model.array(np.zeros(sim.particle_count), sim.model.precision.scalar)
        while True:
            executor = Executor(record_frame(sim, substeps, peak), sim.settings, sim.device)
            executor.run()
            executor.close()
            if not sim.neighbors.overflowing:
                return peak.numpy().astype(np.float64)
            sim.neighbors.lengthen()
            sim.snapshot.restore()
            peak.zero_()

    def close(self) -> None:
        """Let go of graphs and threads."""
        for executor in self._executors.values():
            executor.close()
        self._executors.clear()


def evaluate_forces(sim: Simulation) -> None:
    """The forces that a first kick starts from, in the worlds where they are not known."""
    state, known = sim.state, set(range(sim.world_count)) - sim._unknown_forces
    forces = [state.force] if known and "force" in state else []
    if forces and sim.accounts is not None:
        forces += sim.accounts.forces()
    before = [each.numpy().copy() for each in forces]
    sim.forces(sim.settings.substep)
    if sim.neighbors.grow():
        sim.forces(sim.settings.substep)
    keep = np.isin(sim.model.world_of, list(known))
    for each, old in zip(forces, before, strict=True):
        # Forces that depend on velocity would not come out as they were within the step.
        force = each.numpy().copy()
        force[keep] = old[keep]
        each.assign(force)
    sim._unknown_forces.clear()
