"""Simulation: a scene, or a batch of them, on a device; and the loop, on one screen."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterable, Sequence
from typing import Any, Self

import warp as wp

from .. import validate
from ..engine import batch
from ..engine.execution.executors import Executor
from ..engine.execution.frames import Frames, evaluate_forces
from ..engine.execution.launch import owner
from ..engine.integrators import METHODS
from ..engine.model import Model
from ..engine.neighbors.lists import Neighbors
from ..engine.observers import FINISH, FORCE, PROJECT, Observers
from ..engine.snapshot import Snapshot
from ..engine.state import State
from ..instruments.ledger.accounts import Accounts
from ..instruments.stability.check import automatic, warn_if_past
from ..instruments.watchdog.incident import Incident
from ..instruments.watchdog.watch import Watchdog
from ..interactions.fusion import fuse
from ..output import checkpoint
from ..scene.scene import Scene
from ..scene.settings import Settings
from .assign import assign_rows, reset_worlds
from .reading import Reading


class Simulation(Reading):
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
        if self.settings.automatic:
            self.settings = automatic(self.scenes, self.settings, device)
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
        self.observers = Observers()
        self.passes = self.interactions if self.settings.ledger else fuse(self.interactions)
        self.accounts: Accounts | None = None
        if self.settings.ledger:
            self.accounts = Accounts(self)
            self.observers.all.append(self.accounts)
        self.snapshot = Snapshot(self)
        self.watchdog = Watchdog(model, self.neighbors)
        self.incidents: list[Incident] = []  # what the watchdog has found, and done about it
        self.frames = Frames()
        self._unknown_forces = set(range(model.world_count))

    # The loop -------------------------------------------------------------------------------

    def substep(self, dt: float) -> None:
        """Advance by ``dt``: interactions, integration, constraints, velocities."""
        self.observers.begin(dt)
        self.integrator.begin(dt)
        self.forces(dt)
        self.integrator.advance(dt)
        self.constrain(dt, self.settings.iterations)
        self.integrator.finish(dt)
        for constraint in self.constraints:
            with self.observers.acting(constraint, FINISH):
                constraint.finish(self.state, self.neighbors, dt)
        self.observers.end(dt)

    def forces(self, dt: float) -> None:
        """Interactions add forces at the present positions."""
        self.neighbors.update(self.state)
        self.state.clear_forces()
        for interaction in self.passes:
            with self.observers.acting(interaction, FORCE):
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
                with self.observers.acting(constraint, PROJECT):
                    constraint.project(self.state, self.neighbors, dt)

    def step(self) -> None:
        """Advance by one frame, ``settings.dt``.

        Raises:
            SimulationError: The watchdog has found a world wrong, and ``settings.on_failure`` says
                to stop, or no retry has helped. The message names the first such particle, its
                world, the time and what did it. The state is the last good frame's.
        """
        if self.particle_count and self.settings.dt > 0:
            if self.integrator.carries_forces and self._unknown_forces:
                evaluate_forces(self)
            self.frames.run(self, self.settings.substeps)
            if self.watchdog.alarmed:
                self.watchdog.attend(self)
        self.frame += 1

    def run(
        self,
        frames: int,
        *,
        record: Any = None,
        overwrite: bool = False,
        fields: Iterable[str] = (),
        progress: bool | Callable[[int, int], None] = False,
        history: Any = None,
        checkpoint: int | None = None,
        resume: bool = False,
        **options: Any,
    ) -> None:
        """Advance by ``frames`` frames.

        A recorded run has a checkpoint beside its output, ``<stem>.checkpoint.npz``. When it was
        ended, by whatever, call it in the same way from the same start with ``resume=True``: the
        simulation moves to the newest checkpoint and goes on to the same frames, bit for bit.

        Args:
            frames: How many, at least 0; of a resumed run all, those that are done included.
            record: Path to write the start and every frame to, beside the simulation: ``.usda``,
                ``.usd`` or ``.usdc`` (UsdRecorder), ``.npz``, ``.ply``, ``.gsd`` or ``.vtkhdf``
                (:func:`particlesim.output.recorders.open_recorder`).
            overwrite: Replace an existing output.
            fields: Names of further per-particle arrays to record.
            progress: True for a bar on the terminal, or a function of (frame, frames).
            history: Path of a ``.csv`` or ``.jsonl`` file to write energies, momenta and errors of
                the start and every frame to (see :class:`~particlesim.output.history.writer.History`).
            checkpoint: Frames from one checkpoint to the next; 0: none. None: by the clock, at
                less than 2 % of the time.
            resume: Go on with the run that recorded to ``record``; where there is none, start it.
                A run that is done is left as it is.
            **options: Of the recorder, such as ``every``, or ``color_by`` for USD.

        Raises:
            FileExistsError: The output exists. ValueError: Arguments that do not fit, or that are
                not those that a run to be resumed was started with. OSError: A frame could not be
                written; those before are kept.
        """
        from .run import run

        validate.whole("Simulation.run", "frames", frames)
        warn_if_past(self)
        run(
            self, frames, record=record, progress=progress, history=history, overwrite=overwrite,
            checkpoint=checkpoint, resume=resume, fields=tuple(fields), **options,
        )  # fmt: skip

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
        self.watchdog.placed(self, range(self.world_count))

    @property
    def executor(self) -> Executor:
        """What runs the frames; made on first use."""
        return self.frames.executor(self, self.settings.substeps)

    def close(self) -> None:
        """Let go of graphs and threads; the next step makes them anew."""
        self.frames.close()

    # Writing ----------------------------------------------------------------------------

    def set(self, name: str, value: Any, rows: slice = slice(None)) -> None:
        """Write a per-particle array, or rows of it; what was derived from it is forgotten."""
        assign_rows(self, name, value, rows)

    def reset(self, worlds: Iterable[int] | None = None) -> None:
        """Put worlds (None: all) back to their start, with nothing left of what they went through.

        A world that is reset goes as it went the first time, also if it was frozen; the others go
        on untouched.
        """
        reset_worlds(self, worlds)

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
                ``precision``, ``compensated`` and ``ledger``.
            device: As for a new Simulation.
            worlds: As for a new Simulation; None: as many copies of a single scene as were saved.

        Raises:
            ValueError: Scenes or settings of another kind, and files that are damaged, newer or
                no checkpoint. OSError: The file is missing or cannot be read.
        """
        return checkpoint.load(cls, path, scene, settings, device, worlds)
