"""Smoothed particle hydrodynamics: a fluid of particles that carry mass and density."""

from __future__ import annotations

import functools
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
from ...kernels.interactions.fluid import lengths as of_lengths
from ...kernels.interactions.fluid import sph as kernels
from ..pair_loop import PairLoop
from .equations_of_state import EquationOfState
from .evolving import Evolving
from .heat import ENERGY, Heat, check_energies
from .lattice import lattice_sums, spacings
from .lengths import LENGTH, AdaptiveSmoothing, Lengths
from .limits import fluid_limits
from .smoothing import SMOOTHING, SUPPORT
from .starts import complaint
from .viscosities import Viscosity
from .walls import Pass, Walls

# What laws may name beside smoothing_length, rest_density and the parameters of their part.
VARIABLES = {
    "pressure": ("density", "internal_energy"),
    "energy": ("density", "internal_energy"),
    "sound_speed": ("density", "internal_energy", "pressure"),
    "term": ("approach", "distance_squared", "density", "sound_speed"),
}
COINCIDENT = 1e-6  # closer than this, in parts of h, particles count as coincident


class SPH(Evolving):
    r"""A fluid: density by summation, symmetric pressure force, viscosity.

        rho_i = sum_j m_j W_ij                    (over all j within 2 h, i itself included)
        F_ij = -m_i m_j (P_i/rho_i^2 + P_j/rho_j^2 + Pi_ij) grad_i W_ij

    with W_ij = W(|x_i - x_j|, h) (Gingold and Monaghan 1977; Monaghan 1992, eq. 3.3). The pressure
    force is the exact gradient of the energy sum_i m_i u(rho_i), so that momentum and angular
    momentum are conserved to round-off and the energy to the integrator's order; viscosity takes
    energy out, or turns it into heat (:class:`IdealGas`). Coincident particles are
    pushed apart, equally and opposite.

    The step is bounded by the time of sound across a smoothing length and by the acceleration
    (Monaghan 1992, on time stepping): dt < 0.4 h / (c (1 + 0.6 alpha)) and dt < 0.25 sqrt(h / |a|).

    Over particles of mass rho0 s^d on a square lattice of spacing s the sum is a little more
    than rho0. A fluid that starts there rests there: its equation of state is given the sum for
    the rest density.

    Boundaries that hold the fluid are mirrors of it: images of its particles hold it up, and let
    it slip (:class:`~particlesim.interactions.fluid.walls.Walls`).

    A run warns of a start whose masses do not make the rest density at their spacing, whose
    smoothing length is below the spacing, or which moves faster than a liquid's sound.

    State arrays ``density`` and ``pressure``, and ``smoothing_length`` of particles' own, belong to
    the positions at which the forces were taken last.

    Args:
        group: The fluid's particles; None: all. Pinned ones count in the sums and stay.
        smoothing_length: h [length], above 0. W has the support 2 h, whichever the function: at
            a spacing s of particles, h = 2 s makes 268 neighbours, 1.3 s makes 74, s makes 33. Or
            an :class:`AdaptiveSmoothing`, by which each particle has its own.
        rest_density: rho0 [mass/length^d], where the equation of state asks for it.
        equation_of_state: :class:`Tait`, :class:`Polytrope`, :class:`IdealGas` or another
            ``EquationOfState``.
        smoothing: ``"wendland_c2"`` (Wendland 1995; does not clump at many neighbours) or
            ``"cubic_spline"`` (Monaghan and Lattanzio 1985; sharper at few).
        viscosity: :class:`ArtificialViscosity` or another ``Viscosity``; None: inviscid.
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
        self, group: Any = None, *, smoothing_length: float | AdaptiveSmoothing,
        equation_of_state: EquationOfState,
        rest_density: float | None = None, smoothing: str = "wendland_c2",
        viscosity: Viscosity | None = None, dimension: int = 3,
    ):  # fmt: skip
        self.group = group
        self.parameters: dict[str, Any] = self.take_length(smoothing_length)
        self.equation_of_state = _of_kind(
            self.name, "equation_of_state", equation_of_state, EquationOfState,
            "Tait(sound_speed)",
        )  # fmt: skip
        self.viscosity = viscosity
        self.reads_velocity = viscosity is not None
        self.conservative = viscosity is None
        if viscosity is not None:
            _of_kind(self.name, "viscosity", viscosity, Viscosity, "ArtificialViscosity(0.05)")
        validate.choice(self.name, "smoothing", smoothing, SMOOTHING)
        functions = SMOOTHING[smoothing]
        if dimension not in functions:
            raise validate.fail(
                self.name, "dimension", "be 1, 2 or 3", dimension, "choose one of these"
            )
        self.dimension, self.smoothing = dimension, functions[dimension]
        if rest_density is not None:
            self.parameters["rest_density"] = validate.number(
                self.name, "rest_density", rest_density, above=0.0, unit="mass/length^d"
            )
        self.sources: dict[str, dict[str, str]] = {}
        self._take("state", equation_of_state)
        if viscosity is not None:
            self._take("viscosity", viscosity)
        self.hot = any(ENERGY in law.parameters for law in equation_of_state.laws.values())
        if self.hot:
            self.keep_heat()

    def _variables(self, name: str) -> tuple[str, ...]:
        """What a law is called with."""
        return VARIABLES[name] if self.adaptive is None else (*VARIABLES[name], LENGTH)

    def _take(self, prefix: str, part: EquationOfState | Viscosity) -> None:
        """Note what fills the arguments of a part's laws; its parameters join the fluid's."""
        own = {name: f"p.{name}" for name in ("smoothing_length", "rest_density")}
        for name, value in part.parameters.items():
            self.parameters[f"{prefix}_{name}"] = value
            own[name] = f"p.{prefix}_{name}"
        for name, law in part.laws.items():
            sources = own | {variable: variable for variable in self._variables(name)}
            validate.known(part.name, law.parameters, sources, f"argument of {law.name}")
            if "rest_density" in law.parameters and "rest_density" not in self.parameters:
                raise validate.fail(
                    self.name, "rest_density", "be given [mass/length^d]", None,
                    f"{part.name} asks for it",
                )  # fmt: skip
            self.sources[name] = sources

    def kind(self) -> tuple[Any, ...]:
        parts = [self.equation_of_state, *([self.viscosity] if self.viscosity else [])]
        laws = [law.func for part in parts for law in part.laws.values()]
        return (type(self), *laws, self.smoothing, self.dimension, tuple(self.parameters))

    def prepare(self, model: Model, neighbors: Neighbors) -> None:
        self.model = model
        columns = self.columns(self.parameters)
        read = {"velocity": self.viscosity is not None, ENERGY: self.hot}
        names = {"mass"} | {name for name, on in read.items() if on}
        if self.adaptive is None:
            pairs = neighbors.of(self, names)
            assert isinstance(pairs, VerletList)  # as there is a cutoff
            least = most = columns[LENGTH]
        else:
            self.lengths = Lengths(self, model)
            pairs, columns = (
                self.lengths.request(neighbors, names),
                columns | self.lengths.columns(),
            )
            least, most = self.lengths.least, self.lengths.most
        self.pairs = pairs
        if self.hot:
            check_energies(self.name, model, pairs.members_host)
        self.walls = Walls(self, model)
        self.requires = self.requires | self.walls.requires
        columns |= {"cutoff_squared": (SUPPORT * most) ** 2}
        columns |= {"closest_squared": (COINCIDENT * least) ** 2}
        for h in (least, most):
            self.check_range(h, columns["closest_squared"])
        self.spacings = spacings(self, model)
        if self.lengths is None:
            columns |= {"inverse_h": 1.0 / h, "sigma": self.smoothing.sigma / h**self.dimension}
            if "rest_density" in columns:
                columns["rest_density"] = columns["rest_density"] * lattice_sums(self, model, h)
        model.fits(self.name, {name: columns[name] for name in self.parameters})
        self.Params, self.params = model.parameters("FluidParameters", columns)

    def attach(self, model: Model, state: State) -> None:
        precision, own = model.precision, self.pairs.fields
        # Mass, density, P / rho^2 and sound speed of each slot, together as they are read together.
        self.slot_state = self.pairs.array(precision.vector(4))
        fields = {"x": own["position"], "m": own["mass"], "state": self.slot_state}
        if self.viscosity is not None:
            fields["v"] = own["velocity"]
        if self.hot:
            fields["u"] = own[ENERGY]
        if self.lengths is not None:
            self.lengths.attach(state)
            fields["size"] = self.lengths.size
        self.fields = fields
        self.loop = PairLoop.over(model, self.pairs, "Fluid", fields, self.Params, self.params)
        self.state = state
        self.laws = self._laws()
        self.weight = self.smoothing.weight.function(precision)
        self._types = types = precision, self.loop.Data, self.Params
        slope = self.smoothing.slope.function(precision)
        made = kernels if self.lengths is None else of_lengths
        viscous = slope, self.laws.get("term"), self.dimension
        if self.hot:
            self.heat = Heat(self, state, functools.partial(made.heat_term, *viscous))
        if self.lengths is None:
            self.density_term = kernels.density_term(self.weight, *types)
            self.force_term = kernels.force_term(
                self.pull(*types), self.viscosity is not None, self.dimension, *types
            )
        else:
            self.force_term = of_lengths.force_term(*viscous, *types)
            self.lengths.over(self.loop, self.weight, slope)
            self.lengths.start()
        if self.walls:
            self.walls.attach(state, fields)

    def pull(self, *types: Any) -> wp.Function:
        """How strongly a pair pulls, for data and parameters of these types."""
        slope = self.smoothing.slope.function(self.model.precision)
        return kernels.pull_function(slope, self.laws.get("term"), *types)

    def _laws(self) -> dict[str, wp.Function]:
        """The parts' laws as functions of their variables and the fluid's parameters."""
        precision = self.model.precision
        parts = [self.equation_of_state, *([self.viscosity] if self.viscosity else [])]
        return {
            name: kernels.bound_law(
                name, law.function(precision, part.name, float), self._variables(name),
                self.sources[name], precision, self.Params,
            )
            for part in parts
            for name, law in part.laws.items()
        }  # fmt: skip

    def apply(self, state: State, neighbors: Neighbors, dt: float) -> None:
        self.sum_density(state)
        out = {"f": state.force}
        self.walls.sum_force(Pass(self.loop, self.force_term, kernels.add_force, out))

    def sum_density(self, state: State, sounds: bool = False) -> None:
        """Density, pressure and their slots; speeds of sound for a viscosity, or if asked for."""
        sounds = sounds or self.viscosity is not None
        laws = self.laws["pressure"], self.laws["sound_speed"] if sounds else None
        if self.lengths is not None:
            self.lengths.search(state, laws, self.slot_state)
            return
        out = {"state": self.slot_state, "rho": state.density, "pressure": state.pressure}
        own = kernels.own_weight(self.weight, *self._types)
        store = functools.partial(kernels.keep_state, own, *laws, self.hot)
        self.walls.sum_density(Pass(self.loop, self.density_term, store, out), (*laws, self.hot))

    def limits(self, probe: Probe) -> list[Limit]:
        """By sound with viscosity, and by acceleration."""
        return fluid_limits(self, probe)

    def complaint(self) -> str:
        """That masses, the smoothing length or the speed of sound do not fit the start."""
        return complaint(self)

    def sound_speeds(self, probe: Probe) -> np.ndarray:
        """Speed of sound at the present densities, of each member [length/time]."""
        probe.force([self])
        if self.viscosity is None:  # whose passes have no need of it
            self.sum_density(probe.state, sounds=True)
        c = np.empty(self.pairs.count)
        members = self.pairs.members_host
        c[np.searchsorted(members, self.pairs.order.numpy())] = self.slot_state.numpy()[:, 3]
        return c

    def update_density(self) -> None:
        """Density, pressure and their slots at the present positions; not within a substep."""
        self.pairs.update(self.state)
        self.pairs.grow()
        self.look_at_density(self.state)

    def measure(self, state: State, energy: wp.array, virial: wp.array) -> None:
        """Add the energy m u at the present positions, and the virial of all pair forces."""
        self.look_at_density(state)
        precision, energy_law = self.model.precision, self.laws["energy"]
        term = kernels.virial_term(self.force_term, precision, self.loop.Data, self.Params)
        keep = (kernels if self.lengths is None else of_lengths).keep_measure
        store = functools.partial(keep, energy_law, self.hot)
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
