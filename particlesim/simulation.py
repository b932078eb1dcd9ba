"""Simulation: a scene, or a batch of them, on a device; and the loop, on one screen."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterable, Sequence
from typing import Any, Self

import numpy as np
import warp as wp

from . import batch, checkpoint, validate
from .diagnostics import Diagnostics, measure
from .errors import SimulationError
from .executors import Executor
from .explain import Explanation, explain
from .integrators import METHODS
from .interactions.fusion import fuse
from .kernels.reduce import finite_kernel
from .launch import Frame, launch, owner, record
from .model import Model
from .neighbors import Neighbors
from .scene import Scene
from .settings import Settings
from .snapshot import Snapshot
from .state import State
from .world import World


class Simulation:
    """A scene, or worlds of one kind, in motion.

    Args:
        scene: A Scene; or a list of scenes of one kind, which become the worlds of a batch.
        settings: The knobs of speed and accuracy.
        device: ``"cpu"``, ``"cuda:0"``, ...; None: CUDA where there is one, else the CPU.
        worlds: With a single scene: how many copies of it to run.

    Raises:
        ValueError: Scenes of different kinds, a device that is not there, constraints with an
            integrator that cannot take them, and whatever an interaction finds wrong.

    Example:
        >>> scene = Scene()
        >>> ball = scene.add_particles([(0, 0, 0)], velocity=(1, 0, 0))
        >>> sim = Simulation(scene, Settings(dt=0.1), device="cpu")
        >>> sim.step()
        >>> sim.position.round(3).tolist()
        [[0.10000000149011612, 0.0, 0.0]]
    """

    def __init__(
        self,
        scene: Scene | Sequence[Scene],
        settings: Settings | None = None,
        device: Any = None,
        worlds: int | None = None,
    ):
        self.settings = Settings() if settings is None else settings
        if not isinstance(self.settings, Settings):
            raise TypeError(
                f"Simulation: settings must be a Settings, got {settings!r}; use Settings(...)."
            )
        self.scenes = batch.scenes(scene, worlds)
        self.model = Model(self.scenes, self.settings, device)
        self.device = self.model.device
        self.frame = 0
        self._build()

    def _build(self) -> None:
        """Prepare the parts; only what they require is allocated."""
        model = self.model
        self.interactions = batch.bound([scene.interactions for scene in self.scenes])
        self.constraints = batch.bound([scene.constraints for scene in self.scenes])
        self.state = State(model)
        self.neighbors = Neighbors(model)
        parts = [*self.interactions, *self.constraints]
        for part in parts:
            part.prepare(model, self.neighbors)
        required = frozenset[str]().union(*(part.requires for part in parts))
        method = METHODS[self.settings.integrator]
        if self.constraints and method.carries_forces:
            raise validate.fail(
                "Settings", "integrator", "be symplectic_euler in a scene with constraints",
                self.settings.integrator, "or leave the constraints out",
            )  # fmt: skip
        self.state.require({"position", "velocity"} | required)
        remember = "previous_position" in required
        self.integrator = method(
            model, self.state, constrained=bool(self.constraints), remember=remember
        )
        self.neighbors.allocate(self.state)
        for part in parts:
            part.attach(model, self.state)
        self.passes = fuse(self.interactions)
        self._status = wp.zeros(1, dtype=wp.int32, device=self.device)
        self.snapshot = Snapshot(self)
        self._executor: Executor | None = None
        self._rows_of_executor = 0
        self._unknown_forces = set(range(model.world_count))

    # The loop -------------------------------------------------------------------------------

    def substep(self, dt: float) -> None:
        """Advance by ``dt``: interactions, integration, constraints, velocities."""
        self.integrator.begin(dt)
        self.forces(dt)
        self.integrator.advance(dt)
        self.constrain(dt, self.settings.iterations)
        self.integrator.finish(dt)
        for constraint in self.constraints:
            with owner(constraint.name):
                constraint.finish(self.state, self.neighbors, dt)

    def forces(self, dt: float) -> None:
        """Interactions add forces at the present positions."""
        self.neighbors.update(self.state)
        self.state.clear_forces()
        for interaction in self.passes:
            with owner(interaction.name):
                interaction.apply(self.state, self.neighbors, dt)

    def constrain(self, dt: float, iterations: int) -> None:
        """Constraints project the positions, one after the other, in each iteration."""
        if not self.constraints:
            return
        self.neighbors.update_for_constraints(self.state)
        for constraint in self.constraints:
            with owner(constraint.name):
                constraint.begin(self.state, self.neighbors, dt)
        for _ in range(iterations):
            for constraint in self.constraints:
                with owner(constraint.name):
                    constraint.project(self.state, self.neighbors, dt)

    def step(self) -> None:
        """Advance by one frame, ``settings.dt``.

        Raises:
            SimulationError: A position or velocity is no longer finite; the message names the
                first such particle, its world and the time. The state is the last good frame's.
        """
        if self.particle_count and self.settings.dt > 0:
            if self.integrator.carries_forces and self._unknown_forces:
                self._evaluate_forces()
            self.executor.run()
            while self.neighbors.overflowing:
                self._redo_with_longer_rows()
            if self._status.numpy()[0]:
                self._report_nonfinite()
        self.frame += 1

    def run(
        self,
        frames: int,
        *,
        record: Any = None,
        overwrite: bool = False,
        fields: Iterable[str] = (),
        progress: bool | Callable[[int, int], None] = False,
    ) -> None:
        """Advance by ``frames`` frames.

        Args:
            frames: How many, at least 0.
            record: Path of a USD file to write the start and every frame to (see UsdRecorder).
            overwrite: Replace an existing output.
            fields: Names of further per-particle arrays to record.
            progress: True for a bar on the terminal, or a function of (frame, frames).
        """
        from .run import run

        validate.whole("Simulation.run", "frames", frames)
        run(self, frames, record=record, overwrite=overwrite, fields=fields, progress=progress)

    def project(self, iterations: int) -> None:
        """Move the start positions onto the constraints, rigidly and without giving velocity.

        Args:
            iterations: Sweeps over all constraints.
        """
        validate.whole("Simulation.project", "iterations", iterations)
        if "previous_position" in self.state:
            wp.copy(self.state.previous_position, self.state.position)
        # Without a time scale compliance is nothing: alpha / dt^2 = 0.
        self.constrain(math.inf, iterations)
        self.neighbors.grow()

    def _frame(self) -> Frame:
        """Record what a frame does."""
        frame = Frame(repeat=self.settings.substeps)
        with record(frame.before):
            self.snapshot.take()
        with record(frame.substep):
            self.substep(self.settings.substep)
        with record(frame.after):
            launch(
                finite_kernel(self.model.precision), self.particle_count,
                [self.state.position, self.state.velocity, self._status], self.device,
            )  # fmt: skip
        return frame

    @property
    def executor(self) -> Executor:
        """What runs the frames; made on first use."""
        if self._rows_of_executor != self.neighbors.generation:
            self.close()  # what it has recorded points to rows that were too short
        if self._executor is None:
            self._executor = Executor(self._frame(), self.settings, self.device)
            self._rows_of_executor = self.neighbors.generation
        return self._executor

    def _redo_with_longer_rows(self) -> None:
        """Nothing is ever left out of a full row: back to the start of the frame, and again."""
        self.neighbors.lengthen()
        self.snapshot.restore()
        self._status.zero_()
        self.executor.run()

    def _evaluate_forces(self) -> None:
        """The forces that a first kick starts from, in the worlds where they are not known."""
        state, known = self.state, set(range(self.world_count)) - self._unknown_forces
        before = state.force.numpy().copy() if known and "force" in state else None
        self.forces(self.settings.substep)
        if self.neighbors.grow():
            self.forces(self.settings.substep)
        if before is not None:
            # Forces that depend on velocity would not come out as they were within the step.
            force, keep = state.force.numpy().copy(), np.isin(self.model.world_of, list(known))
            force[keep] = before[keep]
            state.force.assign(force)
        self._unknown_forces.clear()

    def close(self) -> None:
        """Let go of graphs and threads; the next step makes them anew."""
        if self._executor is not None:
            self._executor.close()
            self._executor = None

    def _report_nonfinite(self) -> None:
        x, v = self.position, self.velocity  # copies: the state is about to be restored
        bad = ~(np.isfinite(x).all(axis=1) & np.isfinite(v).all(axis=1))
        row = int(np.argmax(bad)) if bad.any() else 0
        world = int(self.model.world_of[row])
        particle = row - int(self.model.offsets[world])
        self.snapshot.restore()
        self._status.zero_()
        raise SimulationError(
            f"Simulation: position and velocity must stay finite, got x = {x[row]}, v = {v[row]} "
            f"of particle {particle} in world {world} between t = {self.time:g} and "
            f"{self.time + self.settings.dt:g}; use more substeps, or look at what pushes it."
        )

    # Reading and writing --------------------------------------------------------------------

    @property
    def world_count(self) -> int:
        """How many worlds."""
        return self.model.world_count

    @property
    def particle_count(self) -> int:
        """Particles of all worlds."""
        return self.model.particle_count

    @property
    def time(self) -> float:
        """Simulated time since the start [s]."""
        return self.frame * self.settings.dt

    @property
    def position(self) -> np.ndarray:
        """Positions of all worlds, (n, 3), a copy on the host."""
        return self.get("position")

    @position.setter
    def position(self, value: Any) -> None:
        self.set("position", value)

    @property
    def velocity(self) -> np.ndarray:
        """Velocities of all worlds, (n, 3), a copy on the host."""
        return self.get("velocity")

    @velocity.setter
    def velocity(self, value: Any) -> None:
        self.set("velocity", value)

    def get(self, name: str) -> np.ndarray:
        """A per-particle array, copied to the host."""
        return self.state[name].numpy().copy()

    def set(self, name: str, value: Any, rows: slice = slice(None)) -> None:
        """Write a per-particle array, or rows of it; what was derived from it is forgotten."""
        array = self.state[name]
        host = array.numpy().copy()
        shape = host[rows].shape
        width = shape[1] if len(shape) == 2 else None
        host[rows] = validate.rows("Simulation.set", name, value, shape[0], width)
        if name == "mass":
            self._invert(host, rows)
        if name == "radius" and host.max() > self.model.column("radius").max():
            raise validate.fail(
                "Simulation.set", "radius", "be at most the largest at the start, which contacts "
                f"are looked for by ({self.model.column('radius').max():g})", float(host.max()),
                "give the scene the largest radius it will have",
            )  # fmt: skip
        array.assign(host)
        error = f"{name}_error"
        if error in self.state:
            kept = self.state[error].numpy().copy()
            kept[rows] = 0
            self.state[error].assign(kept)
        worlds = np.unique(self.model.world_of[rows]).tolist()
        if name == "position":
            self.neighbors.renew(self.state, worlds)
            for constraint in self.constraints:
                constraint.placed(worlds)
        self._unknown_forces.update(worlds)

    def _invert(self, mass: np.ndarray, rows: slice) -> None:
        """Have the inverse masses follow the masses; pinned particles stay pinned."""
        if not (mass[rows] > 0).all():
            raise validate.fail(
                "Simulation.set", "mass", "be above 0", float(mass[rows].min()), "give a mass"
            )
        if "inverse_mass" in self.state:
            inverse = self.get("inverse_mass")
            inverse[rows] = np.where(inverse[rows] > 0, 1.0 / mass[rows], 0.0)
            self.state.inverse_mass.assign(inverse)

    def world(self, index: int) -> World:
        """A view of one world."""
        return World(self, index)

    def reset(self, worlds: Iterable[int] | None = None) -> None:
        """Put worlds (None: all) back to their start, with nothing left of what they went through.

        A world that is reset goes as it went the first time; the others go on untouched.
        """
        owner, count = "Simulation.reset", self.world_count
        given = range(count) if worlds is None else worlds
        given = given if isinstance(given, Iterable) else [given]
        chosen = sorted({validate.whole(owner, "worlds", w) for w in given})
        if chosen and chosen[-1] >= count:
            raise validate.fail(
                owner, "worlds", f"be from 0 to {count - 1}", chosen[-1],
                "name worlds of this simulation",
            )  # fmt: skip
        if len(chosen) == count:
            self.frame = 0
        self.state.reset(chosen)
        self._status.zero_()
        self.neighbors.renew(self.state, chosen)
        for part in [*self.interactions, *self.constraints]:
            part.reset(chosen)
        self._unknown_forces.update(chosen)

    def save(self, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
        """Write a checkpoint: all that is needed to go on from here, bit for bit.

        Args:
            path: A ``.npz`` file; it appears whole or not at all.
            overwrite: Replace an existing file.

        Raises:
            ValueError: Another suffix. FileExistsError: It exists, and ``overwrite`` is not set.
            OSError: The folder is missing, or the file could not be written.
        """
        checkpoint.save(self, path, overwrite)

    @classmethod
    def load(
        cls,
        path: str | os.PathLike[str],
        scene: Scene | Sequence[Scene],
        settings: Settings | None = None,
        device: Any = None,
        worlds: int | None = None,
    ) -> Self:
        """The simulation that :meth:`save` wrote, on any device; on its kind, bit for bit.

        Args:
            path: The checkpoint.
            scene: What was simulated. Its structure must be as it was (particle counts, groups,
                kinds of interactions and constraints, their particles and tuples, the periodic
                box); with other values of parameters the run goes on with those.
            settings: None: as saved; else they must agree in ``dt``, ``integrator``,
                ``precision`` and ``compensated``.
            device: As for a new Simulation.
            worlds: As for a new Simulation; None: as many copies of a single scene as were saved.

        Raises:
            ValueError: Scenes or settings of another kind, and files that are damaged, newer or
                no checkpoint. OSError: The file is missing or cannot be read.
        """
        return checkpoint.load(cls, path, scene, settings, device, worlds)

    def diagnostics(self) -> Diagnostics:
        """Conserved quantities of every world at the present time."""
        return measure(self)

    def explain(self) -> Explanation:
        """What is allocated, compiled and launched, and why."""
        return explain(self)
