"""Smoothed particle hydrodynamics: a fluid of particles that carry mass and density."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from typing import Any

import numpy as np
import warp as wp

from ... import validate
from ...engine.limit import Limit
from ...engine.model import Model
from ...engine.neighbors.lists import Neighbors
from ...engine.neighbors.verlet import VerletList
from ...engine.probe import Probe
from ...engine.state import State
from ...kernels.interactions import sph as kernels
from ...scene.part import Interaction
from ..pair_loop import PairLoop
from .equations_of_state import EquationOfState
from .limits import fluid_limits
from .smoothing import SmoothingFunction, summable
from .starts import complaint
from .viscosities import Viscosity, several
from .viscous_passes import Drift, Switch

# What laws may name beside smoothing_length, rest_density and the parameters of their part.
VARIABLES = {
    "pressure": ("density",),
    "energy": ("density",),
    "sound_speed": ("density", "pressure"),
    "term": ("approach", "distance_squared", "density", "sound_speed"),
    "drag": ("distance_squared", "density_i", "density_j", "sound_speed"),
}
COINCIDENT = 1e-6  # closer than this, in parts of h, particles count as coincident


class SPH(Interaction):
    r"""A barotropic fluid: density by summation, symmetric pressure force, viscosity.

        rho_i = sum_j m_j W_ij                    (over all j in reach, i itself included)
        F_ij = -m_i m_j (P_i/rho_i^2 + P_j/rho_j^2 + Pi_ij) grad_i W_ij

    with W_ij = W(|x_i - x_j|, h) (Gingold and Monaghan 1977; Monaghan 1992, eq. 3.3). The pressure
    force is the exact gradient of the energy sum_i m_i u(rho_i), so that momentum and angular
    momentum are conserved to round-off and the energy to the integrator's order; viscosity takes
    energy out. Coincident particles are pushed apart, equally and opposite.

    The step is bounded by the time of sound across a smoothing length and by the acceleration
    (Monaghan 1992, on time stepping): dt < 0.4 h / (c (1 + 0.6 alpha)) and dt < 0.25 sqrt(h / |a|).

    A run warns of a start whose masses do not make the rest density at their spacing, whose
    smoothing length is below the spacing, or which moves faster than a liquid's sound.

    State arrays ``density`` and ``pressure`` belong to the positions at which the forces were
    taken last.

    Args:
        group: The fluid's particles; None: all. Pinned ones count in the sums and stay.
        smoothing_length: h [length], above 0. Where W ends at 2 h, as most functions do, and at a
            spacing s of particles, h = 2 s makes 268 neighbours, 1.3 s makes 74, s makes 33.
        rest_density: rho0 [mass/length^d], where the equation of state asks for it.
        equation_of_state: :class:`Tait`, :class:`Polytrope` or another ``EquationOfState``.
        smoothing: W, a :class:`SmoothingFunction` or the name of a ready one: ``"wendland_c2"``
            (does not clump at many neighbours), ``"wendland_c4"``, ``"wendland_c6"``,
            ``"cubic_spline"`` (sharper at few), ``"quintic_spline"``, ``"gaussian"``, ``"poly6"``,
            ``"spiky"``.
        viscosity: :class:`ArtificialViscosity`, :class:`LaminarViscosity`, :class:`XSPH` or another
            ``Viscosity``, or several of different kinds, with :class:`ParticleShifting`; None:
            inviscid.
        dimension: d of the normalisation of W: 3; 2 for scenes in a plane, whose density is a mass
            per area; 1 for scenes on a line. The plane is x-y and the line x where coincident
            particles are to stay in it.

    Raises:
        ValueError: A value out of range, a name that is not known, a rest density missing.

    Example:
        >>> from particlesim import Scene, Settings, Simulation, Tait, sample
        >>> scene = Scene()
        >>> block = sample.box((0, 0, 0), (1, 1, 1), spacing=0.1)
        >>> water = scene.add_particles(block, mass=1000 * 0.1**3)
        >>> fluid = scene.add_interaction(
        ...     SPH(water, smoothing_length=0.2, rest_density=1000.0,
        ...         equation_of_state=Tait(sound_speed=30.0)))
        >>> sim = Simulation(scene, Settings(dt=1 / 60, substeps=20), device="cpu")
        >>> sim.interpolate(fluid, [(0.5, 0.5, 0.5)], "density").round(-2).tolist()
        [1000.0]
    """

    requires = frozenset({"force", "velocity", "mass", "density", "pressure"})

    def __init__(
        self, group: Any = None, *, smoothing_length: float, equation_of_state: EquationOfState,
        rest_density: float | None = None, smoothing: str | SmoothingFunction = "wendland_c2",
        viscosity: Viscosity | Sequence[Viscosity] | None = None, dimension: int = 3,
    ):  # fmt: skip
        self.group = group
        h = validate.number(
            self.name, "smoothing_length", smoothing_length, above=0.0, unit="length"
        )
        self.equation_of_state = _of_kind(
            self.name, "equation_of_state", equation_of_state, EquationOfState,
            "Tait(sound_speed)",
        )  # fmt: skip
        self.viscosity = several(self.name, viscosity)
        self.reads_velocity, self.conservative = bool(self.viscosity), not self.viscosity
        if dimension not in (1, 2, 3):
            raise validate.fail(
                self.name, "dimension", "be 1, 2 or 3", dimension, "choose one of these"
            )
        self.dimension, self.smoothing = dimension, summable(self.name, smoothing, dimension)
        self.cutoff = self.smoothing.support * h
        self.parameters: dict[str, Any] = {"smoothing_length": h}
        if rest_density is not None:
            self.parameters["rest_density"] = validate.number(
                self.name, "rest_density", rest_density, above=0.0, unit="mass/length^d"
            )
        self.sources: dict[str, dict[str, str]] = {}
        self._take("state", equation_of_state)
        for each in self.viscosity:
            self._take("viscosity", each)

    def _take(self, prefix: str, part: EquationOfState | Viscosity) -> None:
        """Note what fills the arguments of a part's laws; its parameters join the fluid's."""
        own = {name: f"p.{name}" for name in ("smoothing_length", "rest_density")}
        for name, value in part.parameters.items():
            self.parameters[f"{prefix}_{name}"] = value
            own[name] = f"p.{prefix}_{name}"
        for name, law in part.laws.items():
            sources = own | {variable: variable for variable in VARIABLES[name]}
            validate.known(part.name, law.parameters, sources, f"argument of {law.name}")
            if "rest_density" in law.parameters and "rest_density" not in self.parameters:
                raise validate.fail(
                    self.name, "rest_density", "be given [mass/length^d]", None,
                    f"{part.name} asks for it",
                )  # fmt: skip
            self.sources[name] = sources

    def kind(self) -> tuple[Any, ...]:
        parts = [self.equation_of_state, *self.viscosity]
        laws = [law.func for part in parts for law in part.laws.values()]
        switched = tuple(each.switched for each in self.viscosity)
        return (
            type(self),
            *laws,
            switched,
            self.smoothing.kind,
            self.dimension,
            tuple(self.parameters),
        )

    def prepare(self, model: Model, neighbors: Neighbors) -> None:
        self.model = model
        columns = self.columns(self.parameters)
        h = columns["smoothing_length"]
        pairs = neighbors.of(self, {"mass"} | ({"velocity"} if self.viscosity else set()))
        assert isinstance(pairs, VerletList)  # as there is a cutoff
        self.pairs = pairs
        columns["inverse_h"] = 1.0 / h
        with np.errstate(divide="ignore", over="ignore", under="ignore"):
            columns["sigma"] = self.smoothing.sigma / h**self.dimension
        reach = self.smoothing.support * h
        columns |= {"cutoff_squared": reach**2, "closest_squared": (COINCIDENT * h) ** 2}
        self._check_range(columns)
        model.fits(self.name, {name: columns[name] for name in self.parameters})
        self.Params, self.params = model.parameters("FluidParameters", columns)

    def _check_range(self, columns: dict[str, np.ndarray]) -> None:
        """Powers of h must be normal numbers of the precision."""
        limits = np.finfo(self.model.precision.numpy)
        for name in ("sigma", "closest_squared"):
            bad = ~((columns[name] > limits.tiny) & (columns[name] < limits.max))
            if bad.any():
                raise validate.fail(
                    self.name, "smoothing_length",
                    f"have h^2 and h^-{self.dimension} within {limits.dtype}",
                    float(columns["smoothing_length"][np.argmax(bad)]),
                    "choose another unit of length, or precision=\"float64\"",
                )  # fmt: skip

    def attach(self, model: Model, state: State) -> None:
        precision, own = model.precision, self.pairs.fields
        # Mass, density, P / rho^2 and sound speed of each slot, together as they are read together.
        self.slot_state = self.pairs.array(precision.vector(4))
        fields = {"x": own["position"], "m": own["mass"], "state": self.slot_state}
        if self.viscosity:
            fields["v"] = own["velocity"]
        self.switch = Switch(self) if any(each.switched for each in self.viscosity) else None
        if self.switch:
            fields["balsara"] = self.switch.values
        drifts = (Drift(self, state, each) for each in self.viscosity if each.drifts)
        self.drift = next(drifts, None)
        self.loop = PairLoop.over(model, self.pairs, "Fluid", fields, self.Params, self.params)
        self.state = state
        self.laws = self._laws()
        self.weight = self.smoothing.weight.function(precision)
        types = precision, self.loop.Data, self.Params
        self.density_term = kernels.density_term(self.weight, *types)
        slope = self.smoothing.slope.function(precision)
        self.force_term = kernels.force_term(
            slope, self.laws, self.switch is not None, self.dimension, *types
        )

    def _laws(self) -> dict[str, wp.Function]:
        """The parts' laws as functions of their variables and the fluid's parameters."""
        precision = self.model.precision
        parts = [self.equation_of_state, *self.viscosity]
        return {
            name: kernels.bound_law(
                name, law.function(precision, part.name, float), VARIABLES[name],
                self.sources[name], precision, self.Params,
            )
            for part in parts
            for name, law in part.laws.items()
        }  # fmt: skip

    def apply(self, state: State, neighbors: Neighbors, dt: float) -> None:
        self._sum_density(state)
        self.loop.sum(self.force_term, kernels.add_force, {"f": state.force})
        if self.drift:
            self.drift.sum()

    def advance(self, state: State, dt: float) -> None:
        if self.drift:
            self.drift.move(dt)

    def _sum_density(self, state: State, sounds: bool = False) -> None:
        """Density, pressure and their slots; speeds of sound for a viscosity, or if asked for."""
        sounds = sounds or bool(self.viscosity)
        laws = self.laws["pressure"], self.laws["sound_speed"] if sounds else None
        store = functools.partial(kernels.keep_state, self.weight, *laws)
        out = {"state": self.slot_state, "rho": state.density, "pressure": state.pressure}
        self.loop.sum(self.density_term, store, out)
        if self.switch:
            self.switch.sum()

    def limits(self, probe: Probe) -> list[Limit]:
        """By sound with viscosity, and by acceleration."""
        return fluid_limits(self, probe)

    def complaint(self) -> str:
        """That masses, the smoothing length or the speed of sound do not fit the start."""
        return complaint(self)

    def sound_speeds(self, probe: Probe) -> np.ndarray:
        """Speed of sound at the present densities, of each member [length/time]."""
        probe.force([self])
        if not self.viscosity:  # whose passes have no need of it
            self._sum_density(probe.state, sounds=True)
        c = np.empty(self.pairs.count)
        members = self.pairs.members_host
        c[np.searchsorted(members, self.pairs.order.numpy())] = self.slot_state.numpy()[:, 3]
        return c

    def update_density(self) -> None:
        """Density, pressure and their slots at the present positions; not within a substep."""
        self.pairs.update(self.state)
        self.pairs.grow()
        self._sum_density(self.state)

    def measure(self, state: State, energy: wp.array, virial: wp.array) -> None:
        """Add the energy m u(rho) at the present positions, and the virial of all pair forces."""
        self._sum_density(state)
        precision, energy_law = self.model.precision, self.laws["energy"]
        term = kernels.virial_term(self.force_term, precision, self.loop.Data, self.Params)
        store = functools.partial(kernels.keep_measure, energy_law)
        self.loop.sum(term, store, {"energy": energy, "virial": virial})

    def interpolate(self, points: Any, field: Any, **options: Any) -> np.ndarray:
        """Of a simulation: ``sim.interpolate(fluid, points, field)``."""
        raise self._elsewhere("interpolate", "points", "field")


def _of_kind(owner: str, argument: str, value: Any, kind: type, example: str) -> Any:
    """``value``, checked to be of this kind."""
    if not isinstance(value, kind):
        article = "an" if kind.__name__[0] in "AEIOU" else "a"
        raise TypeError(
            f"{owner}: {argument} must be {article} {kind.__name__}, got {value!r}; give {example}."
        )
    return value
