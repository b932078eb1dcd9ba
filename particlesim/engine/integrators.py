"""Time integration: one class a method, each saying what happens around the forces."""

from __future__ import annotations

from typing import Any

from ..kernels.engine.integrate import integration_kernels, motion_type, tick_kernel
from .execution.launch import launch
from .model import Model
from .state import State


class Integrator:
    """Moves particles. ``begin`` comes before the forces of a substep, the others after them."""

    name: str
    order: int  # of convergence in dt
    carries_forces = False  # a substep starts from the forces that the last one ended with

    def __init__(self, model: Model, state: State, *, constrained: bool, remember: bool):
        self.model, self.state, self.count = model, state, model.particle_count
        settings = model.settings
        forces = "force" in state
        names = {"position", "velocity"}
        if forces:
            names |= {"inverse_mass"}
        if settings.compensated:
            names |= {"position_error"} | ({"velocity_error"} if forces else set())
        if constrained:
            names |= {"correction", "inverse_mass"}
        if remember:
            names |= {"previous_position"}
        if model.periodic:
            names |= {"image", "world"}
        state.require(names)
        self.forces, self.constrained = forces, constrained
        self.kernels = integration_kernels(
            model.precision, model.periodic, forces, settings.compensated, constrained, remember
        )
        self.motion = _motion(model, state)

    def begin(self, dt: float) -> None:
        """Before the forces."""

    def advance(self, dt: float) -> None:
        """After the forces."""
        raise NotImplementedError

    def finish(self, dt: float) -> None:
        """After the constraints: velocities follow the projection, v += correction / dt.

        The same as v = (x - x_previous) / dt in exact arithmetic, without its cancellation.
        """
        if self.constrained and dt > 0:
            self._launch(self.kernels.follow_corrections, 1.0 / dt)

    def _move(self, dt_kick: float, dt: float) -> None:
        """v += w f dt_kick; x += v dt. The clock goes with the positions."""
        self._launch(self.kernels.advance, dt_kick, dt)
        if "time" in self.state:
            model = self.model
            launch(tick_kernel(), model.world_count, [dt, self.state.time], model.device)

    def _launch(self, kernel: Any, *scalars: float) -> None:
        launch(kernel, self.count, [*scalars, self.motion], self.model.device)


class SymplecticEuler(Integrator):
    """v += w f dt; x += v dt. First order, symplectic; the integrator that XPBD builds on."""

    name, order = "symplectic_euler", 1

    def advance(self, dt: float) -> None:
        self._move(dt, dt)


class VelocityVerlet(Integrator):
    """Kick dt/2, drift dt, forces, kick dt/2 (Swope et al. 1982, eq. 9). Second order.

    One evaluation of the forces a substep: the first kick uses those of the last substep. Forces
    that depend on velocity see it after the first kick.
    """

    name, order = "velocity_verlet", 2
    carries_forces = True

    def begin(self, dt: float) -> None:
        self._move(0.5 * dt, dt)

    def advance(self, dt: float) -> None:
        if self.forces:
            self._launch(self.kernels.kick_only, 0.5 * dt)


METHODS = {method.name: method for method in (SymplecticEuler, VelocityVerlet)}


def _motion(model: Model, state: State) -> Any:
    motion = motion_type(model.precision)()
    names = {
        "x": "position", "v": "velocity", "w": "inverse_mass", "f": "force",
        "x_error": "position_error", "v_error": "velocity_error",
        "x_previous": "previous_position", "correction": "correction", "image": "image",
        "world": "world",
    }  # fmt: skip
    for field, name in names.items():
        if name in state:
            setattr(motion, field, state[name])
    motion.box = model.box
    return motion
