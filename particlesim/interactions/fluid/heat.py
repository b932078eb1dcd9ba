"""The internal energy of a fluid: what the work of its forces makes of it."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np
import warp as wp

from ... import validate
from ...engine.execution.launch import call, launch
from ...engine.integrators import method
from ...engine.model import Model
from ...engine.state import State
from ...kernels.engine.loops import Term
from ...kernels.interactions.fluid import heat as kernels
from ...kernels.interactions.fluid import heat_images as of_images
from ..pair_loop import PairLoop
from .walls import Pass

ENERGY = "internal_energy"  # the attribute, per mass [length^2/time^2]


def check_energies(owner: str, model: Model, members: np.ndarray) -> None:
    """Refuse particles that have no internal energy, or a negative one."""
    if model.attributes.get(ENERGY, 0) is not None:
        raise validate.fail(
            owner, ENERGY, "be a number of the particles [length^2/time^2]", None,
            f"write add_particles(..., {ENERGY}=...)",
        )  # fmt: skip
    u = model.column(ENERGY)[members]
    if (u < 0).any():
        k = int(np.argmin(u))
        raise validate.fail(
            owner, ENERGY, "be at least 0 [length^2/time^2]", float(u[k]),
            f"mind particle {int(members[k])}",
        )  # fmt: skip


class Heat:
    r"""What the forces of a fluid take from the motion goes into its internal energy u, and back.

        du_i/dt = sum_j m_j (P_i/rho_i^2 + Pi_ij/2) (v_i - v_j) . grad_i W_ij

    (Monaghan 1992). A kick from v to v' changes the kinetic energy by m (v' - v) . (v + v') / 2;
    with the mean (v + v') / 2 of each kick in the place of v, what a pair of particles gains in
    motion is what the two lose in u, whatever the step (Owen 2014). So the sum of both changes by
    round-off only where nothing but the fluid acts, and with other forces as these are integrated.

    Symplectic Euler, and every method whose kick follows the forces, has one kick an evaluation of
    the forces. Velocity Verlet has two halves of one, with drifts before and behind: the rates of
    the second are kept until the next substep, which begins with it, and the pressure is taken at
    a u that is foreseen with them, as velocities are; then u is of second order too.

    Walls work where they move, by what they exert: then the sum changes by that.

    Args:
        fluid: The ``SPH``, attached with its walls.
        term: Makes the term of its rates, of kicks, precision and the structs of data and
            parameters.
    """

    def __init__(self, fluid: Any, state: State, term: Any):
        self.model, self.pairs, self.state = fluid.model, fluid.pairs, state
        model, precision, count = self.model, self.model.precision, self.model.particle_count
        self.kicks = 2 if method(model.settings).carries_forces else 1
        self.means = [self.pairs.array(precision.vec3) for _ in range(self.kicks)]
        self.rates = [
            wp.zeros(count, dtype=precision.scalar, device=model.device) for _ in range(self.kicks)
        ]
        self.early = wp.zeros_like(self.rates[0]) if self.kicks == 2 else None
        fields = {**fluid.fields, **{f"u{k}": each for k, each in enumerate(self.means)}}
        self.loop = PairLoop.over(model, self.pairs, "Heat", fields, fluid.Params, fluid.params)
        self.term: Term = term(self.kicks, precision, self.loop.Data, fluid.Params)
        self.walls = HeatBesideWalls(self, fluid) if fluid.walls else None
        self.error = wp.zeros_like(self.rates[0]) if model.settings.compensated else None
        self.kernels = kernels.heat_kernels(precision, self.error is not None)

    def persistent(self) -> dict[str, wp.array]:
        """What outlives a substep: rates of the next kick, and what rounding has kept from u."""
        kept = {"early": self.early, "error": self.error}
        return {name: array for name, array in kept.items() if array is not None}

    def carried(self) -> list[wp.array]:
        """What :meth:`carry` writes."""
        return [] if self.early is None else [self.early]

    def begin(self, dt: float) -> None:
        """u as it will be with the forces, if it goes on as at the start of the substep."""
        if self.early is not None:
            inputs = [self.pairs.members, dt, self.early, self.state[ENERGY], self.error]
            launch(self.kernels.heat, self.pairs.count, inputs, self.model.device)

    def advance(self, dt: float) -> None:
        """u after the kick of ``dt`` that has just been, by the last forces."""
        u, device = self.state[ENERGY], self.model.device
        if self.kicks == 1:
            self._sum(-0.5 * dt)
            inputs = [self.pairs.members, dt, self.rates[0], u, self.error]
            launch(self.kernels.heat, self.pairs.count, inputs, device)
            return
        self._sum(-0.25 * dt, 0.25 * dt)
        inputs = [self.pairs.members, 0.5 * dt, *self.rates, self.early, u, self.error]
        launch(self.kernels.heat_late, self.pairs.count, inputs, device)

    def carry(self, dt: float) -> None:
        """What the next substep of ``dt`` begins with, by the last forces."""
        if self.kicks == 2:
            self._sum(-0.25 * dt, 0.25 * dt)
            call(functools.partial(wp.copy, self.early, self.rates[1]))

    def _sum(self, *back: float) -> None:
        """Rates at the mean velocities of kicks, which are so long away from the present ones."""
        state, device = self.state, self.model.device
        moving = [state.velocity, state.force, state.inverse_mass]
        for dt, mean in zip(back, self.means, strict=True):
            inputs = [self.pairs.order, *moving, dt, mean]
            launch(self.kernels.mean_velocity, self.pairs.count, inputs, device)
        out = {f"rate{k}": each for k, each in enumerate(self.rates)}
        store = functools.partial(kernels.keep_rates, self.kicks, None)
        if self.walls is None:
            self.loop.sum(self.term, store, out)
        else:
            self.walls.sum(Pass(self.loop, self.term, store, out))


class HeatBesideWalls:
    """The same over images in walls, which work where they move.

    Args:
        heat: That of the fluid. fluid: The ``SPH``, attached, with walls.
    """

    def __init__(self, heat: Heat, fluid: Any):
        model, pairs, walls = fluid.model, fluid.pairs, fluid.walls
        self.model, self.pairs, self.held, self.means = model, pairs, walls, heat.means
        precision, kicks = model.precision, heat.kicks
        each, vec3, carried = precision.vector(walls.total), precision.vec3, len(walls.against)
        self.closing = [pairs.array(each) for _ in range(kicks)]
        none = wp.empty(0, dtype=vec3, device=model.device)
        self.against = [pairs.array(vec3) if carried else none for _ in range(kicks)]
        fields = {**walls.fields}
        for k in range(kicks):
            fields |= {f"u{k}": self.means[k], f"closing{k}": self.closing[k]}
            if carried:
                fields[f"against{k}"] = self.against[k]
        given = model, pairs, "HeatBesideWalls", fields, fluid.Params, fluid.params
        self.loop = PairLoop.over(*given)
        types, drags = self.loop.types, "drag" in fluid.laws
        heating = kernels.heating_function(
            fluid.slope, fluid.laws, fluid.switch is not None, *types
        )
        warm = kernels.warm_function(heating, drags, fluid.dimension, kicks, *types)
        images = heating, drags, kicks
        self.terms = [of_images.heat_term(warm, *images, seen, *types) for seen in walls.ways]
        owns = [of_images.own_heat(*images, seen, *types) for seen in walls.ways]
        self.stores = [functools.partial(kernels.keep_rates, kicks, own) for own in owns]
        self.kernel = of_images.mean_rate_kernel(precision, walls.total)

    def sum(self, plain: Pass) -> None:
        """The pass of heat, of which ``plain`` is that far from walls."""
        v, device = self.pairs.fields["velocity"], self.model.device
        for k, mean in enumerate(self.means):
            inputs = [self.pairs.pairs, v, mean, self.held.struct]
            written = [self.closing[k], self.against[k]]
            launch(self.kernel, self.pairs.count, [*inputs, *written], device)
        both = zip(self.terms, self.stores, strict=True)
        self.held.sum(plain, *(Pass(self.loop, term, store, plain.out) for term, store in both))
