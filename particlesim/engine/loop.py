"""The loop: what moves, and one substep of it, on one screen."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import warp as wp

from .. import validate
from ..scene.constraint_base import ConstraintBase
from ..scene.fingerprint import laws_of
from ..scene.part import Interaction, Part, names_velocity
from ..scene.scene import Scene
from ..scene.settings import Settings
from ..scene.thermostat import Barostat, Thermostat
from .constraining.bounces import Bounces
from .constraining.sweeps import Sweeps
from .execution.acting import act
from .execution.launch import owner
from .integrators import Integrator, method
from .limit import Limit, Pacing
from .model import Model
from .neighbors.lists import Neighbors
from .observers import EXCHANGE, FINISH, FOLLOW, FORCE, Observers
from .state import State

LEFT_BY_FORCES = ("force", "density", "pressure", "smoothing_length")

Fuse = Callable[[Sequence[Interaction]], list[Interaction]]


class Loop:
    """Scenes in motion: their model, state, neighbours, parts and integrator.

    Args:
        scenes: One for each world, of one kind.
        settings: With numbers for ``dt`` and ``substeps``.
        device: As of :func:`~particlesim.engine.model.choose_device`.
        fuse: Makes the passes that evaluate the interactions; by default one for each.
    """

    def __init__(
        self, scenes: Sequence[Scene], settings: Settings, device: Any = None, fuse: Fuse = list
    ):
        self.scenes: Sequence[Scene] = list(scenes)
        self.settings = settings
        self.laws = laws_of(scenes[0])  # as they are read now
        self.model = model = Model(scenes, settings, device)
        self.frame, self.pacing = 0, Pacing()
        self._distinct = list({id(scene): scene for scene in scenes}.values())
        self._changes = self._counted()
        # What is prepared allocates only what it requires.
        self.interactions: Sequence[Interaction] = _bound([each.interactions for each in scenes])
        self.constraints: Sequence[ConstraintBase] = _bound([each.constraints for each in scenes])
        self.thermostats: Sequence[Thermostat] = _bound([each.thermostats for each in scenes])
        for bath in self.thermostats:
            if isinstance(bath, Barostat):
                bath.interactions = self.interactions
        for each in self.constraints:
            each.meet(self.constraints)
        self.state, self.neighbors = State(model), Neighbors(model)
        for part in self.parts:
            part.prepare(model, self.neighbors)
        required = frozenset[str]().union(*(part.requires for part in self.parts))
        moves = method(settings)
        for part in self.interactions:
            if part.reads_velocity is None:
                part.reads_velocity = names_velocity(type(part))
        self._check_takes(moves)
        self.implicit = [part for part in self.interactions if part.implicit]
        still = Interaction.advance
        self.moving = [part for part in self.interactions if type(part).advance is not still]
        self.state.require({"position", "velocity"} | required)
        self.integrator = moves(
            model, self.state, constrained=bool(self.constraints),
            remember="previous_position" in required, implicit=bool(self.implicit),
            predicted=any(part.reads_velocity for part in self.interactions),
        )  # fmt: skip
        if self.thermostats:
            self.integrator.exchange = self.exchange
        self.neighbors.allocate(self.state)
        for part in self.parts:
            part.attach(model, self.state)
        self.passes = in_turn(fuse(self.interactions))
        self.sweeps = Sweeps(model, self.state, self.constraints)
        self.bounces = Bounces(model, self.state, self.sweeps.constraints)
        self.observers = Observers()
        # Worlds that are not as the last evaluation of the forces, or the substep after it, left
        # them.
        self.unknown_forces = set(range(model.world_count))

    def substep(self, dt: float) -> None:
        """Advance by ``dt``, in the stages of the integrator: mostly one."""
        for weight in self.integrator.stages:
            self.stage(weight * dt)

    def stage(self, dt: float) -> None:
        """Advance by ``dt``: interactions, integration, constraints, velocities."""
        self.observers.begin(dt)
        act(self.integrator, self.integrator.begin, dt)
        if self.integrator.carries_forces:
            self.hold(dt)
        self._go_on("begin", dt)
        act(self.integrator, self.integrator.foresee, dt)
        self.forces(dt)
        self.follow(dt)
        act(self.integrator, self.integrator.advance, dt)
        self._go_on("advance", dt)
        if not self.integrator.carries_forces:
            self.hold(dt)
        for constraint in self.sweeps.constraints:
            inputs = self.state, self.neighbors, dt
            self.observers.act(constraint, FINISH, constraint.finish, *inputs)
        self.observers.end(dt)

    def hold(self, dt: float) -> None:
        """Positions have moved: constraints project them, velocities follow and bounce off."""
        self.constrain(dt, self.settings.iterations)
        act(self.integrator, self.integrator.finish, dt)
        self.bounces.act(self.observers, self.state, self.neighbors, dt)

    def _go_on(self, step: str, dt: float) -> None:
        """What interactions have of their own goes on."""
        for interaction in self.moving:
            with owner(interaction.name):
                act(interaction, getattr(interaction, step), self.state, dt)

    def exchange(self, dt: float) -> None:
        """Thermostats change velocities, in the middle of a drift of ``dt``."""
        for thermostat in self.thermostats:
            self.observers.act(thermostat, EXCHANGE, thermostat.exchange, self.state, dt)

    def forces(self, dt: float) -> None:
        """Interactions add forces at the present positions."""
        with owner("pair lists"):
            self.neighbors.update(self.state)
        self.state.clear_forces()
        now = self.state, self.neighbors, dt
        for interaction in self.passes:
            self.observers.act(interaction, FORCE, interaction.apply, *now)

    def follow(self, dt: float) -> None:
        """Forces that are implicit in the velocity follow it to where it will be in half a kick."""
        if not self.implicit:
            return
        if not self.observers.all:
            self.integrator.respond(dt)
            return
        self.integrator.lead(dt)
        now = self.state, self.integrator.damps
        for interaction in self.implicit:  # observers want each part's own
            self.observers.act(interaction, FOLLOW, interaction.follow, *now)
        self.integrator.settle(dt)

    def constrain(self, dt: float, iterations: int) -> None:
        """Constraints project the positions, in sweeps over all of them."""
        if not self.constraints:
            return
        with owner("pair lists"):
            self.neighbors.update_for_constraints(self.state)
        self.sweeps.act(self.observers, self.state, self.neighbors, dt, iterations)

    def _check_takes(self, moves: type[Integrator]) -> None:
        """Refuse what the integrator cannot move."""
        given, back = self.settings.plain["integrator"], min(moves.stages) < 0
        if self.constraints and len(moves.stages) > 1:
            raise validate.fail(
                "Settings", "integrator", "be symplectic_euler or velocity_verlet in a scene with "
                "constraints", given, "or leave them out",
            )  # fmt: skip
        answers = [part.name for part in self.interactions if part.answers]
        if answers and (moves.carries_forces or len(moves.stages) > 1):
            raise validate.fail(
                "Settings", "integrator", f"be symplectic_euler with {answers[0]}, whose force is "
                "that of one whole kick", given, "or leave that out",
            )  # fmt: skip
        on_velocity = [part for part in self.interactions if part.depends_on_velocity]
        for part in [*on_velocity, *self.thermostats] if back else ():
            raise validate.fail(
                "Settings", "integrator", f"be velocity_verlet or symplectic_euler with "
                f"{part.name}, which depends on velocities: its stages go back in time", given,
                "or leave that out",
            )  # fmt: skip

    # Outside a substep ------------------------------------------------------------------------

    def know_forces(self) -> None:
        """Evaluate the forces, and what is found with them, in worlds where they are not known."""
        if not self.unknown_forces:
            return
        known = set(range(self.model.world_count)) - self.unknown_forces
        left = []
        if known:
            found = [self.state.held(name) for name in LEFT_BY_FORCES if name in self.state]
            own = [array for part in self.interactions for array in part.carried()]
            left = [*found, *own, *self.observers.carried()]
        before = [each.numpy().copy() for each in left]
        self.forces(self.settings.substep)
        if self.neighbors.grow():
            self.forces(self.settings.substep)
        self._go_on("carry", self.settings.substep)
        keep = np.isin(self.model.world_of, list(known))
        for each, old in zip(left, before, strict=True):
            # Forces that depend on velocity would not come out as they were within the step.
            force = each.numpy().copy()
            force[keep] = old[keep]
            each.assign(force)
        self.unknown_forces.clear()

    def divide(self, substeps: int) -> None:
        """Frames are of so many substeps from now on."""
        if substeps == self.settings.substeps:
            return
        self.settings = self.model.settings = self.settings.replace(substeps=substeps)
        if any(part.carried() for part in self.interactions):  # which was for another substep
            self.unknown_forces.update(range(self.model.world_count))

    def place_on_constraints(self, iterations: int) -> None:
        """Move positions onto the constraints, rigidly and without giving velocity."""
        if "previous_position" in self.state:
            wp.copy(self.state.previous_position, self.state.position)
        # Without a time scale compliance is nothing: alpha / dt^2 = 0.
        self.constrain(math.inf, iterations)

    @property
    def outdated(self) -> bool:
        """Whether something was added to a scene since, which is not in motion; told once."""
        before, self._changes = self._changes, self._counted()
        return self._changes != before

    def _counted(self) -> int:
        return sum(scene.changes for scene in self._distinct)

    @property
    def parts(self) -> list[Interaction | ConstraintBase | Thermostat]:
        """All interactions, then all constraints, then all thermostats."""
        return [*self.interactions, *self.constraints, *self.thermostats]

    @property
    def actors(self) -> list[Any]:
        """Who acts in a substep."""
        acting = [*self.passes, *self.constraints, *self.thermostats]
        return [*acting, self.integrator, *self.observers.all]

    def bound(self, owner: str, part: Part) -> Any:
        """The copy of a scene's part that is in motion here.

        Raises:
            ValueError: It is no part of these scenes.
        """
        for each in self.parts:
            if part is each or any(part is peer for peer in each.peers):
                return each
        names = ", ".join(each.name for each in self.parts)
        raise validate.fail(
            owner, "part", "belong to a scene of this simulation", part,
            f"name one of its own ({names})",
        )  # fmt: skip

    @property
    def limiter(self) -> Limit | None:
        """What adaptive substeps were chosen by."""
        return self.pacing.limiter

    @property
    def time(self) -> float:
        """Simulated time since the start [s]."""
        return self.frame * self.settings.dt

    @property
    def work(self) -> float:
        """Particles and pairs that an evaluation of the forces looks at, about."""
        return self.model.particle_count + sum(each.work for each in self.neighbors.lists)

    def get(self, name: str) -> np.ndarray:
        """A per-particle array, copied to the host."""
        return self.held(name).numpy().copy()

    def held(self, name: str) -> wp.array:
        """A per-particle array, where it is; what forces leave behind is evaluated if need be."""
        if name in LEFT_BY_FORCES and name in self.state:
            self.know_forces()
        return self.state.held(name)


def in_turn(parts: Sequence[Interaction]) -> list[Interaction]:
    """As they act: those that answer to the others come last."""
    return sorted(parts, key=lambda each: each.answers)


def _bound(parts: Sequence[Sequence[Any]]) -> list[Any]:
    """One part for all worlds, from the corresponding ones of the scenes."""
    return [peers[0].bind(peers) for peers in zip(*parts, strict=True)]
