"""Time integration: one class a method, each saying what happens around the forces."""

from __future__ import annotations

from typing import Any

from .. import validate
from ..kernels.engine.integrate import integration_kernels, motion_type, tick_kernel
from ..scene.settings import INTEGRATORS, Settings
from .execution.launch import launch
from .model import Model
from .state import State


class Integrator:
    """Moves particles; the base of ready integrators and of your own.

    A substep of ``dt`` is ``begin``; the interactions' forces at the positions that it leaves;
    ``advance``; the constraints; ``finish``. A member says what happens in ``begin`` and
    ``advance``, made of :meth:`kick`, :meth:`drift` and :meth:`move`. Its class is given to the
    settings, ``Settings(integrator=YourClass)``, and ``model`` and ``state`` are there to be read.

    ``order`` is that of convergence in ``dt``. ``carries_forces`` says that a substep starts from
    the forces that the last one ended with; such a method takes no constraints.

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
    carries_forces = False
    host = False  # whether it works in Python, and so has to be called in every substep

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

    @property
    def name(self) -> str:
        """What reports call it."""
        return next((n for n, each in METHODS.items() if each is type(self)), type(self).__name__)

    def begin(self, dt: float) -> None:
        """Before the forces."""

    def advance(self, dt: float) -> None:
        """After the forces, which are in ``state.force``."""
        raise validate.undefined(self, "advance(self, dt)")

    def finish(self, dt: float) -> None:
        """After the constraints: velocities follow the projection, v += correction / dt.

        The same as v = (x - x_previous) / dt in exact arithmetic, without its cancellation.
        """
        if self.constrained and dt > 0:
            self._launch(self.kernels.follow_corrections, 1.0 / dt)

    def kick(self, dt: float) -> None:
        """v += w f dt, w = 1/m; nothing in a scene without forces."""
        if self.forces:
            self._launch(self.kernels.kick_only, dt)

    def drift(self, dt: float) -> None:
        """x += v dt, into the periodic box. The clock goes with the positions."""
        self.move(0.0, dt)

    def move(self, kick: float, drift: float) -> None:
        """v += w f kick; x += v drift, in one launch. The clock goes with the positions."""
        self._launch(self.kernels.advance, kick, drift)
        if "time" in self.state:
            model = self.model
            launch(tick_kernel(), model.world_count, [drift, self.state.time], model.device)

    def _launch(self, kernel: Any, *scalars: float) -> None:
        launch(kernel, self.count, [*scalars, self.motion], self.model.device)


class SymplecticEuler(Integrator):
    """v += w f dt; x += v dt. First order, symplectic; the integrator that XPBD builds on."""

    order = 1

    def advance(self, dt: float) -> None:
        self.move(dt, dt)


class VelocityVerlet(Integrator):
    """Kick dt/2, drift dt, forces, kick dt/2 (Swope et al. 1982, eq. 9). Second order.

    One evaluation of the forces a substep: the first kick uses those of the last substep. Forces
    that depend on velocity see it after the first kick.
    """

    order = 2
    carries_forces = True

    def begin(self, dt: float) -> None:
        self.move(0.5 * dt, dt)

    def advance(self, dt: float) -> None:
        self.kick(0.5 * dt)


METHODS: dict[str, type[Integrator]] = dict(
    zip(INTEGRATORS, (SymplecticEuler, VelocityVerlet), strict=True)
)


def method(settings: Settings) -> type[Integrator]:
    """The class that settings name or give.

    Raises:
        TypeError: A class that is no Integrator.
    """
    given = settings.integrator
    if isinstance(given, str):
        return METHODS[given]
    if not issubclass(given, Integrator):
        raise TypeError(
            f"Settings: integrator must be a name or a subclass of Integrator, got {given!r}; "
            "derive it from particlesim.Integrator."
        )
    return given


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
