"""Settings: every knob that trades speed for accuracy, and nothing about the scene itself."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any

from .. import validate

INTEGRATORS = ("symplectic_euler", "velocity_verlet", "yoshida4", "yoshida6")
PRECISIONS = ("float32", "float64")
SOLVERS = ("gauss_seidel", "jacobi")
EXECUTIONS = ("auto", "graph", "threads")
ON_FAILURE = ("stop", "retry", "freeze")
AUTO = "auto"  # a dt or substeps that a simulation chooses when it is made
ADAPTIVE = "adaptive"  # substeps that it chooses anew for every frame
MOST = 10_000  # of them


@dataclass(frozen=True, kw_only=True)
class Settings:
    """How a scene is simulated. Frozen; :meth:`replace` makes a changed copy.

    Args:
        dt: Time of one frame, that is of one ``sim.step()`` [s]. ``"auto"``: the simulation takes
            ``substeps`` times what ``safety`` says, and has that number in its own ``settings``.
        safety: Part of the largest safe substep, ``stability().dt`` at the start, that ``"auto"``
            takes, above 0, at most 1. None: 0.5, or less where the energy would not stay within a
            tenth of itself on the path that ``stability()`` looks ahead on. Adaptive substeps take
            0.5, which is stable; orbits keep their energy by a tenth of that.
        substeps: Substeps a frame; each advances by ``dt / substeps``. ``"auto"``: as many as make
            a substep at most what ``safety`` says. ``"adaptive"``: so for every frame, by the
            limits at its start; a frame that ends past them is done again with more. What begins
            and ends within one frame goes unseen: let frames be shorter than that. The simulation
            has the number of the last frame in its own ``settings``, and says in
            ``diagnostics()`` what limited it. All worlds of a batch have as many.
        most_substeps: Where a number is given, substeps are adaptive, whatever ``substeps`` is:
            one of 1, 2, 3, 4, 6, 8, 12, 16, 23 ..., each by sqrt(2) the last, or so many at most. A
            run that wants more warns of what does. None: with ``"adaptive"`` 10 000.
        iterations: Sweeps over the constraints a substep (XPBD). Compliant constraints do not
            depend on it; stiff ones come closer to C = 0.
        constraint_tolerance: Sweeps end when no tuple is off by more, in parts of its extent (see
            ``Diagnostics.constraint_error``), in any world of a batch; ``iterations`` is then how
            many there are at most. None: that many.
        acceleration: Each sweep over tuples goes on in the direction in which they come (Chebyshev;
            Wang 2015), as for errors of which sweeps leave this part, rho, at least 0, below 1.
            With fewer iterations than some 3 / sqrt(1 - rho) it does harm. 0: not at all.
        solver: How a sweep goes over the tuples of a constraint. ``"gauss_seidel"``: colour by
            colour, each from where the last one has left the particles; ``"jacobi"``: all at once,
            each particle split among its tuples: some sweeps more, but in no order.
        bounce_iterations: Sweeps over what bounces in a substep, at most. A pair or a rigid body
            takes a few; rods of many particles, and many that touch at once, up to a hundred.
        integrator: ``"symplectic_euler"`` (first order, any scene); ``"velocity_verlet"`` (second
            order, with rigid constraints too); ``"yoshida4"`` and ``"yoshida6"`` (fourth and sixth
            order, 3 and 7 evaluations of the forces a substep, with forces of positions alone,
            without constraints); or a class of your own derived from
            :class:`particlesim.Integrator`.
        precision: ``"float32"`` or ``"float64"``, in every kernel.
        skin: Added to the cutoff of neighbour lists [length]; they are rebuilt when a particle has
            moved half of it. Changes the cost, not the forces. None: as thick as pays in each
            world, by how long its lists have lasted; on CUDA 0.12 of the cutoff, 0.4 of that of
            contacts.
        opening_angle: Gravity is summed by a tree, whose cells act as a whole where they are seen
            under at most this angle, their radius over their distance; from 0 (none do) to 1. 0.5
            is a good choice (see :class:`particlesim.Gravity`). None: over all pairs.
        density_tolerance: By how much the density of a :class:`particlesim.DFSPH` may exceed its
            rest density, on average and as foreseen for the end of a substep, in parts of it.
        divergence_tolerance: By how much its flow may still compress it in a substep, likewise.
            What is left of both stirs a liquid at rest: the usual 1e-3 takes half as long.
        pressure_iterations: Corrections of its pressures in a substep, at most, for each of these.
        compensated: Carry the rounding error of positions and velocities along (Kahan 1965), so
            that neither freezes where an increment is below the last bit.
        relaxation: Factor on averaged (Jacobi) contact corrections, above 0, at most 1: more would
            feed energy into stacks.
        depenetration_speed: Largest speed at which contacts push overlapping particles apart
            [length/s]. None: one radius a frame.
        execution: ``"graph"``, ``"threads"`` (CPU) or ``"auto"``, the faster as measured. Changes
            the cost, not one bit of the result.
        threads: CPU threads. None: as many as the process may use.
        watchdog: Look at every particle once a frame: that it is finite, where it may be, and
            without a runaway energy. False: what goes wrong stays unseen.
        on_failure: What happens to a world that the watchdog finds wrong. ``"stop"``: a
            ``SimulationError``, from the last good frame. ``"retry"``: the frame is done again from
            there with twice the substeps, and twice of those. ``"freeze"``: it stays at its last
            good frame until it is reset. The other worlds never notice.
        retries: How often ``"retry"`` doubles the substeps of a frame before it stops.
        energy_growth: Factor, above 1, by which the kinetic energy of a particle may exceed the
            largest so far (at least that of crossing the scene in a frame) unasked. Beyond it the
            frame is done again with two and four times the substeps: an energy that these agree on
            within a factor of two has a cause and is accepted; another is a runaway.
        ledger: Keep account of the work and impulse of every interaction and constraint (see
            ``Simulation.ledger``).

    Raises:
        ValueError: A value out of range. TypeError: An unknown knob; the message lists all.

    Example:
        >>> Settings(dt=1 / 60, substeps=20).replace(precision="float64").substeps
        20
    """

    dt: float | Any = 1.0 / 60.0  # or AUTO
    substeps: int | Any = 10  # or AUTO or ADAPTIVE
    most_substeps: int | None = None
    iterations: int = 1
    constraint_tolerance: float | None = None
    acceleration: float = 0.0
    solver: str = "gauss_seidel"
    bounce_iterations: int = 40
    integrator: str | type = "symplectic_euler"
    precision: str = "float32"
    skin: float | None = None
    density_tolerance: float = 1e-4
    divergence_tolerance: float = 1e-4
    pressure_iterations: int = 100
    compensated: bool = True
    relaxation: float = 1.0
    depenetration_speed: float | None = None
    execution: str = "auto"
    threads: int | None = None
    watchdog: bool = True
    on_failure: str = "stop"
    retries: int = 4
    energy_growth: float = 100.0
    ledger: bool = False
    safety: float | None = None
    opening_angle: float | None = None

    def __new__(cls, *args: Any, **knobs: Any) -> Settings:
        validate.known("Settings", knobs, [f.name for f in dataclasses.fields(cls)], "knob")
        return super().__new__(cls)

    def __post_init__(self) -> None:
        owner = "Settings"
        checked: dict[str, Any] = {
            "safety": None
            if self.safety is None
            else validate.number(owner, "safety", self.safety, above=0.0, maximum=1.0),
            **{
                name: validate.whole(owner, name, getattr(self, name), minimum=1)
                for name in ("iterations", "bounce_iterations", "pressure_iterations")
            },
            **{
                name: validate.number(owner, name, getattr(self, name), above=0.0)
                for name in ("density_tolerance", "divergence_tolerance")
            },
            "retries": validate.whole(owner, "retries", self.retries, minimum=1),
            "energy_growth": validate.number(owner, "energy_growth", self.energy_growth, above=1.0),
            "relaxation": validate.number(
                owner, "relaxation", self.relaxation, above=0.0, maximum=1.0
            ),
        }
        checked |= self._steps()
        if not isinstance(self.integrator, type):
            validate.choice(owner, "integrator", self.integrator, INTEGRATORS)
        validate.choice(owner, "precision", self.precision, PRECISIONS)
        validate.choice(owner, "solver", self.solver, SOLVERS)
        validate.choice(owner, "execution", self.execution, EXECUTIONS)
        validate.choice(owner, "on_failure", self.on_failure, ON_FAILURE)
        checked["acceleration"] = validate.number(
            owner, "acceleration", self.acceleration, minimum=0.0, maximum=1.0 - 1e-9
        )
        if self.constraint_tolerance is not None:
            checked["constraint_tolerance"] = validate.number(
                owner, "constraint_tolerance", self.constraint_tolerance, above=0.0
            )
        if self.skin is not None:
            checked["skin"] = validate.number(owner, "skin", self.skin, minimum=0.0, unit="length")
        if self.depenetration_speed is not None:
            checked["depenetration_speed"] = validate.number(
                owner, "depenetration_speed", self.depenetration_speed, above=0.0, unit="length/s"
            )
        if self.threads is not None:
            checked["threads"] = validate.whole(owner, "threads", self.threads, minimum=1)
        if self.opening_angle is not None:
            checked["opening_angle"] = validate.number(
                owner, "opening_angle", self.opening_angle, minimum=0.0, maximum=1.0
            )
        for name in ("compensated", "watchdog", "ledger"):
            value = getattr(self, name)
            if not isinstance(value, bool):
                raise validate.fail(owner, name, "be True or False", value, "choose one")
        for name, value in checked.items():  # plain numbers, whatever kind was given
            object.__setattr__(self, name, value)

    def _steps(self) -> dict[str, Any]:
        """dt and the numbers of substeps, checked, where they are numbers."""
        owner, checked = "Settings", dict[str, Any]()
        left_open = {"dt": _is(self.dt, AUTO), "substeps": _is(self.substeps, AUTO, ADAPTIVE)}
        chosen = [name for name, is_open in left_open.items() if is_open]
        if len(chosen) == 2:
            raise validate.fail(
                owner, "substeps", 'be a number with dt="auto"', self.substeps, "choose one of them"
            )
        if "dt" not in chosen:
            checked["dt"] = validate.number(owner, "dt", self.dt, minimum=0.0, unit="s")
        if "substeps" not in chosen:
            checked["substeps"] = validate.whole(owner, "substeps", self.substeps, minimum=1)
        if self.most_substeps is not None:
            least = checked.get("substeps", 1)
            most = validate.whole(owner, "most_substeps", self.most_substeps, minimum=least)
            checked["most_substeps"] = most
        elif _is(self.substeps, ADAPTIVE):
            checked["most_substeps"] = MOST
        return checked

    @property
    def automatic(self) -> bool:
        """Whether dt or substeps are yet to be chosen, by the simulation."""
        return _is(self.dt, AUTO) or _is(self.substeps, AUTO, ADAPTIVE)

    @property
    def adaptive(self) -> bool:
        """Whether every frame has a number of substeps of its own."""
        return self.most_substeps is not None

    @property
    def plain(self) -> dict[str, Any]:
        """The knobs as they can be written down: an integrator of one's own by its name."""
        values = dataclasses.asdict(self)
        if isinstance(self.integrator, type):
            values["integrator"] = self.integrator.__name__
        return values

    @property
    def substep(self) -> float:
        """Time of one substep [s]."""
        return self.dt / self.substeps

    def replace(self, **knobs: Any) -> Settings:
        """A copy with some knobs changed."""
        validate.known("Settings", knobs, [f.name for f in dataclasses.fields(self)], "knob")
        return dataclasses.replace(self, **knobs)


def _is(value: Any, *words: str) -> bool:
    return isinstance(value, str) and value in words
