"""Simulation: a scene, or a batch of them, on a device."""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any, Self

from .. import validate
from ..engine.frames import Frames, Runner
from ..engine.loop import Loop
from ..engine.model import batch
from ..instruments.ledger.accounts import Accounts
from ..instruments.pace import Pace, adaptive
from ..instruments.profile import Profile, profiled
from ..instruments.stability import automatic, warn_if_past
from ..instruments.watchdog.incident import SimulationWarning
from ..instruments.watchdog.rounds import Rounds
from ..instruments.watchdog.watch import Watchdog
from ..interactions.fusion import fuse
from ..output import checkpoint
from ..scene.scene import Scene
from ..scene.settings import ADAPTIVE, Settings
from .access import Writer
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
        settings = Settings() if settings is None else settings
        if not isinstance(settings, Settings):
            raise TypeError(
                f"Simulation: settings must be a Settings, got {settings!r}; use Settings(...)."
            )
        scenes = batch(scene, worlds)
        if settings.substeps == ADAPTIVE:
            settings = adaptive(scenes, settings, device)
        elif settings.automatic:
            settings = automatic(scenes, settings, device)
        # A ledger keeps account of every part by itself.
        self._show(Loop(scenes, settings, device, list if settings.ledger else fuse))
        self.accounts = None
        if settings.ledger:
            self.accounts = Accounts(self.loop)
            self.loop.observers.all.append(self.accounts)
        self.watchdog = Watchdog(self.loop.model, self.loop.neighbors)
        self.rounds = Rounds(self.loop, self.watchdog.limits)
        self.frames, self.pace = Frames(self.loop, self.watchdog), Pace(self.loop)
        self.writer = Writer(self.frames, self.watchdog, self.rounds, self.accounts)

    def substep(self, dt: float) -> None:
        """Advance by ``dt`` outside a frame (see :meth:`particlesim.engine.loop.Loop.substep`)."""
        self.loop.substep(dt)

    def forces(self, dt: float) -> None:
        """Interactions add forces at the present positions."""
        self.loop.forces(dt)

    def step(self) -> None:
        """Advance by one frame, ``settings.dt``.

        Raises:
            SimulationError: The watchdog has found a world wrong, and ``settings.on_failure`` says
                to stop, or no retry has helped. The message names the first such particle, its
                world, the time and what did it. The state is the last good frame's.
        """
        if self.loop.outdated:
            warnings.warn(
                "Simulation: scene must be complete when it is simulated, got particles or parts "
                "that were added since, which are not in it; make a new Simulation.",
                SimulationWarning,
                stacklevel=2,
            )
        moves = self.particle_count and self.settings.dt > 0
        if moves:
            self._look(first=True)
            self.pace.begin()
            if self.loop.integrator.carries_forces:
                self.loop.know_forces()
            self.pace.run(self.frames)
            if self.watchdog.alarmed:
                self.watchdog.attend(self.frames)
        self.loop.frame += 1
        if moves:
            self._look()

    def _look(self, first: bool = False) -> None:
        """Make a round of what is looked at now and then; ``first``: before anything has moved."""
        rounds = self.rounds
        if not self.settings.watchdog:
            return
        rounds.listen()
        if rounds.made < 0 if first else rounds.due(self.watchdog.hurried):
            rounds.make()
            self.watchdog.forget()

    def run(
        self,
        frames: int,
        *,
        record: Any = None,
        overwrite: bool = False,
        fields: str | Iterable[str] = (),
        progress: bool | Callable[[int, int], None] = False,
        history: Any = None,
        observe: Mapping[str, Callable[[Any], Any]] | None = None,
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
            fields: Names of further per-particle arrays to record, or one.
            progress: True for a bar on a terminal or in a notebook; or a function of
                (frame, frames).
            history: Path of a ``.csv`` or ``.jsonl`` file to write energies, momenta and errors of
                the start and every frame to (see ``ps.History``).
            observe: What else to write there: functions of the simulation by name, such as
                ``{"msd": ps.mean_square_displacement}``.
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
        names = (fields,) if isinstance(fields, str) else tuple(fields)
        warn_if_past(self.loop)
        run(
            self, self.step, frames, record=record, progress=progress, history=history,
            observe=observe, overwrite=overwrite, checkpoint=checkpoint, resume=resume,
            fields=names, **options,
        )  # fmt: skip

    def project(self, iterations: int) -> None:
        """Move the start positions onto the constraints, rigidly and without giving velocity.

        Args:
            iterations: Sweeps over all constraints.
        """
        validate.whole("Simulation.project", "iterations", iterations)
        self.frames.place_on_constraints(iterations)
        self.watchdog.placed(self.loop, range(self.world_count))

    def profile(self, frames: int) -> Profile:
        """Advance by ``frames`` frames, and measure where their time goes, launch by launch.

        It takes longer than a plain run, and gives the same bits (see :meth:`profiling`).

        Args:
            frames: How many, at least 1.
        """
        validate.whole("Simulation.profile", "frames", frames, minimum=1)
        with self.profiling() as found:
            for _ in range(frames):
                self.step()
        return found

    def profiling(self) -> AbstractContextManager[Profile]:
        """A context: what is run inside, by whatever way, is measured.

        Example:
            >>> scene = Scene()
            >>> ball = scene.add_particles([(0, 0, 0)], velocity=(1, 0, 0))
            >>> sim = Simulation(scene, Settings(dt=0.1, substeps=4), device="cpu")
            >>> with sim.profiling() as found:
            ...     sim.run(frames=5)
            >>> found.frames, found.substeps
            (5, 20)
        """
        return profiled(self.frames)

    @property
    def executor(self) -> Runner:
        """What runs the frames; made on first use."""
        return self.frames.executor(self.settings.substeps)

    def close(self) -> None:
        """Let go of graphs and threads; the next step makes them anew."""
        self.frames.close()

    # Writing ----------------------------------------------------------------------------

    def set(self, name: str, value: Any, rows: slice = slice(None)) -> None:
        """Write a per-particle array, or rows of it; what was derived from it is forgotten."""
        self.writer.set(name, value, rows)

    def reset(self, worlds: Iterable[int] | None = None) -> None:
        """Put worlds (None: all) back to their start, with nothing left of what they went through.

        A world that is reset goes as it went the first time, also if it was frozen; the others go
        on untouched.
        """
        self.writer.reset(worlds)

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
        saved = checkpoint.read(Path(path))
        scenes, settings = checkpoint.check(saved, scene, settings, worlds)
        sim = cls(scenes, settings, device)
        checkpoint.restore(sim.frames, sim.watchdog, saved)
        return sim
