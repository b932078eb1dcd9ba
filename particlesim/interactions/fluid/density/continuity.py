"""Density by continuity: a state of the particles, which goes on as they approach each other."""

from __future__ import annotations

import functools
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import numpy as np
import warp as wp

from .... import validate
from ....engine.execution.launch import call, launch
from ....engine.model import Model
from ....engine.state import State
from ....kernels.interactions.fluid import continuity as kernels
from ....kernels.interactions.fluid import sph as of_sums
from ....kernels.interactions.fluid.seen import Seen
from ...pair_loop import PairLoop

START = "start_density"  # the attribute [mass/length^d]


class ContinuityDensity:
    r"""Densities that start at rest and change as particles approach each other.

        d rho_i/dt = sum_j m_j v_ij . grad_i W_ij + D_i                      (Monaghan 1994)
        D_i = delta h c sum_j m_j/rho_j (2 (rho_j - rho_i) x_ji/r^2 - g_i - g_j) . grad_i W_ij

    A surface is as dense as the rest, whatever is missing around it, so that a liquid with a
    surface may have a ``Tait`` with tension, and fluids of any start rest there. The force is that
    of a summed density: it is the gradient of the energy sum_i m_i u(rho_i) still, and without D
    that energy and the kinetic one are conserved to the integrator's order.

    D spreads the density where it is uneven from particle to particle (Molteni and Colagrossi
    2009), and leaves what is linear in space alone, by the gradients g of the density, which are
    corrected for what is missing (Antuono, Colagrossi, Marrone and Molteni 2010; c is the pair's).
    So a liquid at rest stays so, with a smooth pressure. No density passes through walls by D.

    An interval's change is taken in its middle: it adds up to what a sum over the particles, but
    for its start, would give, with an error of second order in the step. No density falls below a
    thousandth of the rest density. Mass stays where it is, on the particles.

    The density of the start is the fluid's ``rest_density``, or that of the particles by an
    attribute: ``add_particles(..., start_density=rho)`` [mass/length^d], as of a column under its
    own weight. Positions and velocities that are written in between change none.

    Args:
        diffusion: delta, at least 0; 0.1 is usual, 0 leaves D out. It takes a little energy.

    Raises:
        ValueError: A value out of range.

    Example:
        >>> water = SPH(smoothing_length=0.1, rest_density=1000.0, equation_of_state=Tait(30.0),
        ...             density=ContinuityDensity(diffusion=0.1))
        >>> water.parameters["density_diffusion"]
        0.1
    """

    def __init__(self, diffusion: float = 0.1) -> None:
        name = type(self).__name__
        self.diffusion = validate.number(name, "diffusion", diffusion, minimum=0.0)


class Continuity:
    """The densities of a fluid that go by continuity.

    The density at the forces is that of the last ones and what has been added since, in the time
    for which particles have moved: to be taken as often as anybody likes, until the substep goes
    on. So it belongs to the same positions as the forces do with every method of integration.

    Args:
        fluid: The ``SPH``, with a pair list. model: Its model.
    """

    def __init__(self, fluid: Any, model: Model):
        self.fluid, self.model, self.pairs = fluid, model, fluid.pairs
        self.diffuses = bool(fluid.density.diffusion)
        rho0 = fluid.columns({"rest_density": None})["rest_density"][model.world_of]
        members, excess = self.pairs.members_host, np.zeros(model.particle_count)
        if model.attributes.get(START, 0) is None:
            rho = model.column(START)[members]
            if not (rho > 0).all():
                k = int(np.argmin(rho))
                raise validate.fail(
                    fluid.name, START, "be above 0 [mass/length^d]", float(rho[k]),
                    f"mind particle {int(members[k])}",
                )  # fmt: skip
            excess[members] = rho - rho0[members]
        self.start = excess

    def attach(self, state: State) -> dict[str, wp.array]:
        """Make the arrays; returns those in slot order that terms read."""
        model, pairs, precision = self.model, self.pairs, self.model.precision
        self.excess = model.array(self.start, precision.scalar)
        self.found = wp.clone(self.excess)  # at the last forces
        self.since = wp.zeros(model.world_count, dtype=wp.float64, device=model.device)
        self.time = state.time
        self.reached = wp.clone(self.since)
        # Velocities that particles have moved with, which velocity Verlet's forces do not see.
        self.half = state.half_velocity if "half_velocity" in state else None
        self.fields = {
            "excess": pairs.array(precision.scalar),
            "lag": pairs.array(precision.scalar),
            "move": pairs.fields["velocity"] if self.half is None else pairs.array(precision.vec3),
        }
        if self.diffuses:
            self.fields["gradient"] = pairs.array(precision.vector(4))
        return self.fields

    def over(self, loop: PairLoop, slope: wp.Function, laws: dict[str, wp.Function]) -> None:
        """Make the terms of a loop that reads these."""
        self.loop, self.slope = loop, slope
        self.term = kernels.rate_term(slope, self.diffuses, *loop.types)
        self.gradient_term = kernels.gradient_term(slope, *loop.types) if self.diffuses else None
        self.keep_gradient = functools.partial(
            kernels.keep_gradient, laws["pressure"], laws["sound_speed"]
        )

    def beside_walls(self, seen: Seen, *types: Any) -> tuple[Any, wp.Function]:
        """The term over a pair and its images as they move, and that of a particle's own."""
        slips = seen._replace(sticky=(False,) * seen.places)
        term = kernels.walled_rate_term(self.slope, self.diffuses, slips, *types)
        return term, kernels.own_rate(self.slope, slips, *types)

    def look(self) -> None:
        """Put in order what the rate is taken of."""
        model, pairs, fields = self.model, self.pairs, self.fields
        inputs = [pairs.pairs, self.excess, self.time, self.since, fields["excess"], fields["lag"]]
        launch(kernels.gather_kernel(model.precision), pairs.count, inputs, model.device)
        if self.half is not None:
            pairs.sort(self.half, fields["move"])
        if self.gradient_term is not None:
            gradients = {"gradient": fields["gradient"]}
            self.loop.sum(self.gradient_term, self.keep_gradient, gradients)
        call(functools.partial(wp.copy, self.reached, self.time))

    def advance(self) -> None:
        """The substep goes on from what its forces have found."""
        call(functools.partial(wp.copy, self.excess, self.found))
        call(functools.partial(wp.copy, self.since, self.reached))

    def summed(self, weight: wp.Function) -> np.ndarray:
        """What sums over the particles would be, of all particles (n,), at the present."""
        loop, rho = self.loop, wp.zeros_like(self.excess)
        self.pairs.update(self.fluid.state)
        self.pairs.grow()
        keep = functools.partial(kernels.keep_sum, weight)
        loop.sum(of_sums.density_term(weight, *loop.types), keep, {"rho": rho})
        return rho.numpy().astype(np.float64)

    def persistent(self) -> dict[str, wp.array]:
        """What outlives a substep."""
        return {"excess": self.excess, "since": self.since}

    def reset(self, worlds: Sequence[int]) -> None:
        """Worlds start again."""
        for array, start, of in (
            (self.excess, self.start, self.model.world_of),
            (self.since, np.zeros(len(self.since)), np.arange(len(self.since))),
        ):
            host, mine = array.numpy().copy(), np.isin(of, list(worlds))
            host[mine] = start[mine]
            array.assign(host)

    @contextmanager
    def still(self) -> Iterator[None]:
        """Densities stay as they are at present, whatever velocities are tried."""
        kept = [(each, wp.clone(each)) for each in (self.excess, self.since)]
        self.advance()
        try:
            yield
        finally:
            for array, before in kept:
                wp.copy(array, before)
