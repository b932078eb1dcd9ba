"""Divergence-free SPH: a liquid that pressures keep from being compressed."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import warp as wp

from .... import validate
from ....engine.limit import Limit
from ....engine.model import Model
from ....engine.probe import Probe
from ....engine.report import Solved
from ....engine.state import State
from ....scene.law import law
from ....scene.part import Interaction
from ..equations_of_state import EquationOfState
from ..smoothing import SmoothingFunction
from ..sph import SPH
from ..viscosities import Viscosity
from .limits import flow_limits
from .solver import PressureSolver


@law
def nothing(rest_density: float):
    return 0.0 * rest_density


class Incompressible(EquationOfState):
    """That of a liquid whose pressure does not follow from its density, and stores no energy."""

    pressure = energy = sound_speed = nothing


class _Viscous(Interaction):
    """The viscosity of a fluid by itself."""

    def __init__(self, fluid: DFSPH) -> None:
        self.fluid = fluid

    def apply(self, state: State, neighbors: Any, dt: float) -> None:
        self.fluid.sum_viscous_force(state)


class DFSPH(SPH):
    r"""An incompressible liquid: divergence-free SPH (Bender and Koschier 2015, 2017).

        a_i = -sum_j m_j (P_i/rho_i^2 + P_j/rho_j^2) grad_i W_ij

    with the pressures P >= 0 under which the flow compresses nothing, and under which no density is
    above that of rest at the end of the substep. They are found in two solves in every substep,

        (1) drho_i/dt <= 0 where rho_i >= rho0, else rho_i + dt drho_i/dt <= rho0
        (2) rho_i + dt drho_i/dt <= rho0, with what all other forces do in dt

    where drho_i/dt = sum_j m_j v_ij . grad_i W_ij. Nothing pulls, so that liquids part; and where
    neighbours are few, (1) keeps nobody from coming nearer. Both start from the pressures of the
    substep before, and end when the error is within ``Settings(density_tolerance=,
    divergence_tolerance=)`` on average, in every world by itself, or after ``pressure_iterations``:
    then a warning says so. ``sim.diagnostics()`` has the error and the iterations of the last
    substep.

    Density, walls, viscosity and what is read of it are those of :class:`SPH`; momentum and angular
    momentum are conserved to round-off likewise. There is no sound, so that substeps are bounded by
    the flow alone, 0.4 spacings over the largest speed, and by the acceleration of other forces:
    five times those of a weakly compressible fluid, each of some twenty passes over the pairs in
    place of two, so that it is chosen for its density and not to save time. Energy is lost where
    liquids meet. It comes after all other forces of its particles, and takes
    ``integrator="symplectic_euler"``.

    Args:
        group: The fluid's particles; None: all. Pinned ones count in the sums and stay.
        smoothing_length: h [length], above 0, the same for all (see :class:`SPH`).
        rest_density: rho0 [mass/length^d].
        smoothing: W, as of :class:`SPH`.
        viscosity: :class:`LaminarViscosity` or another ``Viscosity`` that is a force and does not
            ask for the speed of sound, or several; None: inviscid.
        dimension: As of :class:`SPH`.

    Raises:
        ValueError: A value out of range, a name that is not known, a viscosity of another kind.
            When a simulation is made, of another integrator.

    Example:
        >>> from particlesim import PlaneBoundary, Scene, Settings, Simulation, UniformGravity
        >>> from particlesim import sample
        >>> scene = Scene()
        >>> block = sample.box((0, 0, 0), (0.6, 0.6, 0.6), spacing=0.1)
        >>> water = scene.add_particles(block, mass=1000 * 0.1**3, radius=0.05)
        >>> fall = scene.add_interaction(UniformGravity((0, -9.81, 0)))
        >>> fluid = scene.add_interaction(DFSPH(water, smoothing_length=0.2, rest_density=1000.0))
        >>> floor = scene.add_constraint(PlaneBoundary((0, 0, 0), (0, 1, 0)))
        >>> settings = Settings(dt=1 / 60, substeps=4, precision="float64")
        >>> sim = Simulation(scene, settings, device="cpu")
        >>> sim.run(6)
        >>> bool(sim.diagnostics().density_error < 1e-3)
        True
    """

    answers = True
    moving = True
    requires = SPH.requires | {"inverse_mass"}

    def __init__(
        self, group: Any = None, *, smoothing_length: float, rest_density: float,
        smoothing: str | SmoothingFunction = "wendland_c2",
        viscosity: Viscosity | Sequence[Viscosity] | None = None, dimension: int = 3,
    ):  # fmt: skip
        h = validate.number(self.name, "smoothing_length", smoothing_length, above=0.0)
        super().__init__(
            group, smoothing_length=h, equation_of_state=Incompressible(),
            rest_density=rest_density, smoothing=smoothing, viscosity=viscosity,
            dimension=dimension,
        )  # fmt: skip
        self.reads_velocity, self.conservative = True, False
        for each in self.viscosity:
            asked = {name for part in each.laws.values() for name in part.parameters}
            if each.drifts or each.switched or "sound_speed" in asked:
                raise validate.fail(
                    self.name, "viscosity", "be a force that knows of no sound", each.name,
                    "choose LaminarViscosity",
                )  # fmt: skip

    def attach(self, model: Model, state: State) -> None:
        super().attach(model, state)
        self.solver = PressureSolver(self)

    def apply(self, state: State, neighbors: Any, dt: float) -> None:
        self.sum_viscous_force(state)
        if dt > 0:
            self.solver.solve(state, dt)

    def sum_viscous_force(self, state: State) -> None:
        """Density at the present positions, and the forces of viscosity there."""
        super().sum_density(state)
        if self.viscosity:
            self.sum_force(state)

    def advance(self, state: State, dt: float) -> None:
        super().advance(state, dt)
        for solve in self.solver.solves:
            solve.go_on()

    def sum_density(self, state: State, sounds: bool = False) -> None:
        """Density at the present positions, with the pressures that were found last."""
        self.solver.recall(state)
        super().sum_density(state)
        self.solver.give(state)

    def limits(self, probe: Probe) -> list[Limit]:
        """By the flow, by viscosity, and by acceleration."""
        return flow_limits(self, _Viscous(self), probe)

    def iterated(self) -> list[Solved]:
        return [solve.iterated() for solve in self.solver.solves]

    def persistent(self) -> dict[str, wp.array]:
        own = {f"{each.what}_pressure": each.warm for each in self.solver.solves}
        return {**super().persistent(), **own}

    def readable(self) -> dict[str, wp.array]:
        return {name: array for each in self.solver.solves for name, array in each.told.items()}

    def reset(self, worlds: Sequence[int]) -> None:
        super().reset(worlds)
        self.forget(self.readable(), worlds)
