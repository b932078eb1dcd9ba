"""Smoothed particle hydrodynamics: a fluid of particles that carry mass and density."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ... import validate
from .density.continuity import ContinuityDensity
from .equations_of_state import EquationOfState
from .heat import ENERGY
from .interfaces.fluids import FLUID, PAIR, Fluids
from .lengths import LENGTH, AdaptiveSmoothing
from .passes import Passes
from .smoothing import SmoothingFunction, summable
from .viscosities import Viscosity, several

# What laws may name beside smoothing_length, rest_density and the parameters of their part.
VARIABLES = {
    "pressure": ("density", "internal_energy"),
    "energy": ("density", "internal_energy"),
    "sound_speed": ("density", "internal_energy", "pressure"),
    "term": ("approach", "distance_squared", "density", "sound_speed"),
    "drag": ("distance_squared", "density_i", "density_j", "sound_speed"),
}


class SPH(Passes):
    r"""A fluid: density by summation or continuity, symmetric pressure force, viscosity.

        rho_i = sum_j m_j W_ij                    (over all j in reach, i itself included)
        F_ij = -m_i m_j (P_i/rho_i^2 + P_j/rho_j^2 + Pi_ij) grad_i W_ij

    with W_ij = W(|x_i - x_j|, h) (Gingold and Monaghan 1977; Monaghan 1992, eq. 3.3). The pressure
    force is the exact gradient of the energy sum_i m_i u(rho_i), so that momentum and angular
    momentum are conserved to round-off and the energy to the integrator's order; viscosity takes
    energy out, or turns it into heat (:class:`IdealGas`). Coincident particles are
    pushed apart, equally and opposite.

    The step is bounded by the time of sound across a smoothing length and by the acceleration
    (Monaghan 1992, on time stepping): dt < 0.4 h / (c (1 + 0.6 alpha)) and dt < 0.25 sqrt(h / |a|).

    Several fluids in one, of a rest density and the numbers of one equation of state each, may
    differ in density by a factor of 1000. Theirs is summed by number, rho_i = m_i sum_j W_ij, as
    next to a lighter fluid the mass of the neighbours says nothing of one's own, and the force

        F_ij = -(P_i/n_i^2 + P_j/n_j^2 + m_i m_j Pi_ij) grad_i W_ij        (n = rho/m)

    is the gradient of the energy again (Hu and Adams 2006; Solenthaler and Pajarola 2008): of equal
    masses the same. All are to start at one spacing. A light fluid next to a heavy one feels the
    other's stiffness, and the step is that of c = sqrt(rho_1 c_1^2 / rho_2): choose sounds that
    make rho c^2 alike, or less in the light one, above its pressure by a hundred times.

    Over particles of mass rho0 s^d on a square lattice of spacing s the sum is a little more
    than rho0. A fluid that starts there rests there: its equation of state is given the sum for
    the rest density.

    Boundaries that hold the fluid are mirrors of it: images of its particles hold it up, and let
    it slip or stick (:class:`~particlesim.interactions.fluid.walls.Walls`); a wall that moves works
    on a gas as a piston does. One with lengths of its particles' own is held by their radius alone.

    A run warns of a start whose masses do not make the rest density at their spacing, whose
    particles overlap or lie behind walls that hold them, whose smoothing length is below the
    spacing, or whose sound is not ten times as fast as a liquid is, or as it will fall.

    State arrays ``density`` and ``pressure``, and ``smoothing_length`` of particles' own, belong to
    the positions at which the forces were taken last.

    Args:
        group: The fluid's particles; None: all. Pinned ones count in the sums and stay. Several
            fluids are a list of groups, with a list of rest densities, of equations of state that
            differ in their numbers, or of both.
        smoothing_length: h [length], above 0. Where W ends at 2 h, as most functions do, and at a
            spacing s of particles, h = 2 s makes 268 neighbours, 1.3 s makes 74, s makes 33.
            Or an :class:`AdaptiveSmoothing`: each particle its own.
        rest_density: rho0 [mass/length^d], where the equation of state asks for it; or one a fluid.
        equation_of_state: :class:`Tait`, :class:`Polytrope`, :class:`IdealGas` or another
            ``EquationOfState``; or one a fluid.
        smoothing: W, a :class:`SmoothingFunction` or the name of a ready one: ``"wendland_c2"``
            (does not clump at many neighbours), ``"wendland_c4"``, ``"wendland_c6"``,
            ``"cubic_spline"`` (sharper at few), ``"quintic_spline"``, ``"gaussian"``, ``"poly6"``,
            ``"spiky"``.
        viscosity: :class:`ArtificialViscosity`, :class:`LaminarViscosity`, :class:`XSPH` or another
            ``Viscosity``, or several of different kinds, with :class:`ParticleShifting`; None:
            inviscid.
        density: None: summed as above; or a :class:`ContinuityDensity`: it follows the motion.
        dimension: d of the normalisation of W: 3; 2 for scenes in a plane, whose density is a mass
            per area; 1 for scenes on a line. The plane is x-y and the line x where coincident
            particles are to stay in it.

    Raises:
        ValueError: A value out of range, a name that is not known, a rest density missing; several
            fluids with heat or with an :class:`AdaptiveSmoothing`; a :class:`ContinuityDensity`
            with any of these, or with a viscosity that has particles drift.

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
        equation_of_state: EquationOfState | Sequence[EquationOfState],
        rest_density: float | Sequence[float] | None = None,
        smoothing: str | SmoothingFunction = "wendland_c2",
        viscosity: Viscosity | Sequence[Viscosity] | None = None,
        density: ContinuityDensity | None = None, dimension: int = 3,
    ):  # fmt: skip
        self.group = group
        if dimension not in (1, 2, 3):
            raise validate.fail(
                self.name, "dimension", "be 1, 2 or 3", dimension, "choose one of these"
            )
        self.dimension, self.smoothing = dimension, summable(self.name, smoothing, dimension)
        self.parameters = self.take_length(smoothing_length)
        self.fluids = Fluids(self.name, group, rest_density, equation_of_state)
        self.equation_of_state = self.fluids.states[0]  # whose laws are those of all
        self.viscosity = several(self.name, viscosity)
        self.reads_velocity, self.conservative = bool(self.viscosity), not self.viscosity
        self.density = density
        self._check_adaptive()
        if self.fluids.densities:
            self.parameters |= self.fluids.keep("rest_density", self.fluids.densities)
        self.sources: dict[str, dict[str, str]] = {}
        self._take("state", *self.fluids.states)
        for each in self.viscosity:
            self._take("viscosity", each)
        laws = self.equation_of_state.laws.values()
        self.hot = any(ENERGY in law.parameters for law in laws)
        self._check_several()
        if self.hot:
            self.keep_heat()
        self.check_density()

    def _check_adaptive(self) -> None:
        """Of viscosities only those along the pair know of lengths of particles' own."""
        for each in self.viscosity:
            if self.adaptive and (each.switched or each.drifts or "drag" in each.law_names):
                raise validate.fail(
                    self.name, "viscosity", "act along the pair, without a switch, with an "
                    "AdaptiveSmoothing", each.name, "choose ArtificialViscosity, or one length",
                )  # fmt: skip

    def _check_several(self) -> None:
        """Of several fluids none has heat, or lengths of its particles' own."""
        if self.fluids.several and (self.hot or self.adaptive):
            argument = "equation_of_state" if self.hot else "smoothing_length"
            raise validate.fail(
                self.name, argument, "have no internal energy with several fluids" if self.hot
                else "be one number with several fluids", argument, "give each an SPH of its own",
            )  # fmt: skip

    def variables(self, name: str) -> tuple[str, ...]:
        """What a law is called with."""
        numbers = PAIR if name == "drag" else (FLUID,) * (name in EquationOfState.law_names)
        numbers = numbers if self.fluids.several else ()
        return (*VARIABLES[name], *[LENGTH] * bool(self.adaptive), *numbers)

    def _take(self, prefix: str, part: Any, *others: Any) -> None:
        """Note what fills the arguments of a part's laws; its parameters join the fluid's.

        ``others``: such parts of further fluids.
        """
        own = {LENGTH: f"p.{LENGTH}"}
        if prefix == "state" or not self.fluids.several:
            own["rest_density"] = self.fluids.source("rest_density")
        for name, value in part.parameters.items():
            field = f"{prefix}_{name}"
            if others:
                values = [value, *(other.parameters[name] for other in others)]
                self.parameters |= self.fluids.keep(field, values)
                own[name] = self.fluids.source(field)
            elif np.ndim(value):
                self.parameters |= self.fluids.keep(field, self.fluids.by_fluids(name, value))
                own |= {f"{name}{each[-2:]}": self.fluids.source(field, each) for each in PAIR}
            else:
                self.parameters[field] = value
                own[name] = f"p.{field}"
        for name, law in part.laws.items():
            sources = own | {variable: variable for variable in self.variables(name)}
            validate.known(part.name, law.parameters, sources, f"argument of {law.name}")
            if "rest_density" in law.parameters and self.fluids.densities is None:
                raise validate.fail(
                    self.name, "rest_density", "be given [mass/length^d]", None,
                    f"{part.name} asks for it",
                )  # fmt: skip
            self.sources[name] = sources

    def kind(self) -> tuple[Any, ...]:
        parts = [self.equation_of_state, *self.viscosity]
        laws = [law.func for part in parts for law in part.laws.values()]
        switched = tuple(each.switched for each in self.viscosity)
        switched += (self.density is not None and self.density.diffusion > 0,)
        own = self.smoothing.kind, self.dimension, tuple(self.parameters)
        return (type(self), *laws, switched, *own)

    def interpolate(self, points: Any, field: Any, **options: Any) -> np.ndarray:
        """Of a simulation: ``sim.interpolate(fluid, points, field)``."""
        raise self._elsewhere("interpolate", "points", "field")
