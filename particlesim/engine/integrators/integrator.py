"""Integrator: what happens around the forces, and the base of every method."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from ... import validate
from ...kernels.engine.implicit import implicit_kernels
from ...kernels.engine.integrate import motion_type
from ...kernels.engine.motion_kernels import go_on_kernel, integration_kernels, tick_kernel
from ..execution.launch import launch
from ..limit import explicit_step
from ..model import Model
from ..state import State


class Integrator:
    """Moves particles; the base of ready integrators and of your own.

    A substep of ``dt`` is ``begin``; the interactions' forces at the positions that it leaves;
    ``advance``; the constraints; ``finish``. Constraints come after what moves positions. A member
    says what happens in ``begin`` and ``advance``, made of :meth:`kick`, :meth:`drift` and
    :meth:`move`; thermostats act in the middle of every drift. Its class is given to the settings,
    ``Settings(integrator=YourClass)``, and ``model`` and ``state`` are there to be read.

    A method of several evaluations of the forces names its ``stages``: all of that is done once for
    each of them, with the stage's part of ``dt``. They add up to 1. One may be negative: it goes
    back, and the clock with it, so that neither constraints, thermostats nor forces that depend on
    velocities are taken.

    What turns the velocity of a particle, as a magnetic field does, is taken at the velocity half a
    kick ahead, v' = v + w f(v') dt / 2, to first order in v' - v (Rosenbrock 1963): a kick then
    turns it without changing its speed (Boris 1970). A method of second order ``damps`` so, too:
    drag takes the velocity to (1 - gamma dt / 2) / (1 + gamma dt / 2) of it (Crank and Nicolson
    1947), with all other forces. In one of first order drag is explicit, and nothing where nothing
    moves, as where constraints hold it.

    ``order`` is that of convergence in ``dt``. ``carries_forces`` says that a substep starts from
    the forces that the last one ended with: such a method moves in ``begin``, which constraints
    and ``finish`` then follow.

    Example:
        >>> from particlesim import Scene, Settings, Simulation
        >>> class PositionVerlet(Integrator):
        ...     order = 2
        ...
        ...     def begin(self, dt):
        ...         self.drift(0.5 * dt)
        ...
        ...     def advance(self, dt):
        ...         self.move(dt, 0.5 * dt)
        >>> scene = Scene()
        >>> ball = scene.add_particles([(0, 0, 0)], velocity=(1, 0, 0))
        >>> sim = Simulation(scene, Settings(dt=0.5, integrator=PositionVerlet), device="cpu")
        >>> sim.step()
        >>> sim.position.tolist()
        [[0.5, 0.0, 0.0]]
    """

    order: int = 1
    stages: tuple[float, ...] = (1.0,)
    carries_forces = False

    @property
    def damps(self) -> bool:
        """Whether damping is implicit in the velocity, as turning is."""
        return self.order > 1

    host = False  # whether it works in Python, and so has to be called in every substep
    exchange: Callable[[float], None] | None = None  # has thermostats act; None: there are none

    def __init__(
        self, model: Model, state: State, *, constrained: bool = False, remember: bool = False,
        implicit: bool = False, predicted: bool = False,
    ):  # fmt: skip
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
        self.predicted = predicted and forces and self.carries_forces
        if implicit:
            names |= {"force_slope", "velocity_lead"} | (
                set() if self.damps else {"implicit_force"}
            )
        if self.predicted:
            names |= {"half_velocity"} | (
                {"half_velocity_error"} if settings.compensated else set()
            )
        state.require(names)
        self.forces, self.constrained = forces, constrained
        self.kernels = integration_kernels(
            model.precision, model.periodic, forces, settings.compensated, constrained, remember,
            model.vectorised,
        )  # fmt: skip
        self.go_on = go_on_kernel(model.precision, model.periodic, settings.compensated, remember)
        self.motion = motion_of(model, state)

    @property
    def name(self) -> str:
        """What reports call it: its own title, or its class."""
        return str(vars(type(self)).get("title", type(self).__name__))

    @classmethod
    def reach(cls) -> float:
        """The longest stage, in substeps."""
        return max(abs(weight) for weight in cls.stages)

    def largest_step(self, omega_squared: float, gamma: float) -> float:
        """Largest stable step of x'' = -omega^2 x - gamma x', the damping not implicit [time]."""
        return explicit_step(omega_squared, gamma)

    def begin(self, dt: float) -> None:
        """Before the forces."""

    def foresee(self, dt: float) -> None:
        """Before the forces, when what ``begin`` has moved is where constraints let it be."""

    def advance(self, dt: float) -> None:
        """After the forces, which are in ``state.force``."""
        raise validate.undefined(self, "advance(self, dt)")

    def finish(self, dt: float) -> None:
        """After the constraints: velocities follow the projection, v += correction / dt.

        The same as v = (x - x_previous) / dt in exact arithmetic, without its cancellation.
        """
        if self.constrained and dt > 0:
            self._launch_blocks(self.kernels.follow_corrections, 1.0 / dt)

    def lead(self, dt: float) -> None:
        """How far the velocity of the implicit forces is ahead, in ``state.velocity_lead``."""
        self._implicitly("lead", dt, self.state.velocity_lead)

    def settle(self, dt: float) -> None:
        """The sum of all forces is what takes the velocity there."""
        self._implicitly("settle", dt, self.state.velocity_lead)

    def respond(self, dt: float) -> None:
        """``lead`` and ``settle`` in one launch."""
        self._implicitly("respond", dt)

    def _implicitly(self, name: str, dt: float, *lead: Any) -> None:
        state, model = self.state, self.model
        own = None if self.damps else state.implicit_force
        kernel = getattr(implicit_kernels(model.precision, self.damps, self.predicted), name)
        inputs = [0.5 * dt, self.motion, state.force_slope, own, *lead]
        launch(kernel, self.count, inputs, model.device)

    def kick(self, dt: float) -> None:
        """v += w f dt, w = 1/m; nothing in a scene without forces."""
        if self.forces:
            self._launch_blocks(self.kernels.kick_only, dt)

    def drift(self, dt: float) -> None:
        """x += v dt, into the periodic box. The clock goes with the positions."""
        self.move(0.0, dt)

    def move(self, kick: float, drift: float) -> None:
        """v += w f kick; x += v drift, in one launch. The clock goes with the positions.

        Thermostats, where there are any, act in the middle of the drift.
        """
        if self.exchange is None:
            self._launch_blocks(self.kernels.advance, kick, drift)
            self._tick(drift)
            return
        self._launch_blocks(self.kernels.advance, kick, 0.5 * drift)
        self._tick(0.5 * drift)
        self.exchange(drift)
        self._launch(self.go_on, 0.5 * drift)
        self._tick(0.5 * drift)

    def _tick(self, dt: float) -> None:
        if "time" in self.state:
            model = self.model
            launch(tick_kernel(), model.world_count, [dt, self.state.time], model.device)

    def _launch_blocks(self, kernel: Any, *scalars: float) -> None:
        inputs, block = [*scalars, self.motion], self.kernels.block
        launch(kernel, self.count, inputs, self.model.device, block)

    def _launch(self, kernel: Any, *scalars: float) -> None:
        launch(kernel, self.count, [*scalars, self.motion], self.model.device)


def motion_of(model: Model, state: State) -> Any:
    """What integration touches, of the arrays that there are."""
    motion = motion_type(model.precision)()
    names = {
        "x": "position", "v": "velocity", "w": "inverse_mass", "f": "force",
        "x_error": "position_error", "v_error": "velocity_error",
        "x_previous": "previous_position", "correction": "correction", "image": "image",
        "v_half": "half_velocity", "v_half_error": "half_velocity_error",
        "world": "world",
    }  # fmt: skip
    for field, name in names.items():
        if name in state:
            setattr(motion, field, state[name])
    motion.box = model.box
    return motion
