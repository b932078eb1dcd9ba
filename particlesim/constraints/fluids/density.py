"""Fluids that are nowhere denser than at rest."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import warp as wp

from ... import validate
from ...engine.easing import Easing
from ...engine.execution.launch import call, launch, when
from ...engine.limit import Limit
from ...engine.model import Model
from ...engine.neighbors.lists import Neighbors
from ...engine.probe import Probe
from ...engine.state import State
from ...interactions.fluid.smoothing import SmoothingFunction, summable
from ...kernels.constraints.constraints import bodies_type
from ...kernels.constraints.contact import share_kernel
from ...kernels.constraints.fluids import density as kernels
from ...kernels.engine.loops import Term
from ...kernels.interactions.pair import pair_kernel
from ..easing import EasedConstraint
from ..limits import passing_limits
from ..tuples import bodies
from .walls import Beyond

CLOSEST = 1e-9  # parts of the cutoff: closer than this, particles count as coincident


class FluidDensity(EasedConstraint):
    r"""A fluid that is nowhere denser than at rest: position-based fluids.

    Each particle fills a volume V_j = m_j / rho0_j, and no place may be filled more than once:

        C_i = sum_j V_j W_ij - 1 <= 0                 (over all j in reach, i itself included)

    of one rest density rho_i / rho0 - 1 (Macklin and Mueller 2013, eq. 1). In each iteration the
    multipliers of all particles grow by

        dlam_i = (C_i - alpha~ lam_i) / (D_i + alpha~),  lam_i >= 0,  alpha~ = alpha / dt^2

    and pairs are moved by m_i dx_i = -(V_j dlam_i + V_i dlam_j) grad_i W_ij (their eqs. 11 and 12,
    with masses). That is opposite and equal, so momentum is conserved, and along the pair as it was
    when the substep began, so angular momentum is. D_i splits each particle among the constraints
    that it is part of (see :mod:`particlesim.kernels.constraints.fluids.density`): no sweep takes
    back more than there is, and any step is stable.

    A sweep reaches from a particle to its neighbours. Deep or fast fluids are compressed by what
    the sweeps of a substep leave: as if sound went about sqrt(iterations) spacings a substep, which
    at a depth H leaves g H / c^2 of the density. That is told as ``constraint_error`` by
    ``diagnostics``. Halving the substep and four times the iterations do the same for it.

    Nothing is pulled: what is thinner than at rest, as at a free surface, is left alone, and so
    needs no artificial pressure against clumps (eq. 13).

    Boundaries that hold the fluid hold its density up too: beyond their surface the fluid goes on
    at rest (see :mod:`particlesim.kernels.constraints.fluids.walls`), and it slips along them, but
    for the friction of what touches them by its radius. Corners and curves of the size of h are
    met roughly. Pinned particles of the group are walls as well: they count in the sums.

    What is denser than at rest at the start, or after positions were written, does not explode:
    that is forgiven, and taken back at no more than ``Settings.depenetration_speed``.

    It is swept with the contacts, after what holds bodies together: a rope or a body in the group
    is immersed, and sinks or floats by its mass over its volume.

    Args:
        group: The fluid's particles; None: all.
        rest_density: rho0 [mass/length^d], above 0, of all or one for each particle of the group in
            the order of the scene.
        smoothing_length: h [length], above 0: 1.3 to 2 spacings of the particles.
        smoothing: W, as of :class:`SPH`.
        compliance: alpha [1/energy], at least 0: 1 / (m c^2) has sound go at c.
        dimension: d, 3, or 2 for scenes in a plane, or 1 on a line.

    Raises:
        ValueError: Values out of range, a name that is not known.

    Example:
        >>> from particlesim import Scene, Settings, Simulation, sample
        >>> scene = Scene()
        >>> block = sample.box((0, 0, 0), (1, 1, 1), spacing=0.1)
        >>> water = scene.add_particles(0.9 * block, mass=1000 * 0.1**3)
        >>> fluid = scene.add_constraint(
        ...     FluidDensity(water, rest_density=1000.0, smoothing_length=0.15))
        >>> sim = Simulation(scene, Settings(dt=1 / 60, iterations=4), device="cpu")
        >>> sim.run(60)
        >>> bool(sim.diagnostics().constraint_error < 0.01)
        True
    """

    requires = frozenset({"position", "velocity", "inverse_mass", "mass", "correction"})
    rank = 1

    def __init__(
        self, group: Any = None, *, rest_density: Any, smoothing_length: float,
        smoothing: str | SmoothingFunction = "wendland_c2", compliance: float = 0.0,
        dimension: int = 3,
    ):  # fmt: skip
        name = self.name
        self.group = group
        if dimension not in (1, 2, 3):
            raise validate.fail(name, "dimension", "be 1, 2 or 3", dimension, "choose one of these")
        self.dimension, self.smoothing = dimension, summable(name, smoothing, dimension)
        self.rest_density = validate.table(
            name, "rest_density", rest_density, above=0.0, unit=f"mass/length^{dimension}"
        )
        self.smoothing_length = validate.number(
            name, "smoothing_length", smoothing_length, above=0.0, unit="length"
        )
        self.compliance = validate.number(
            name, "compliance", compliance, minimum=0.0, unit="1/energy"
        )

    def kind(self) -> tuple[Any, ...]:
        return (type(self), self.smoothing.kind, self.dimension)

    def prepare(self, model: Model, neighbors: Neighbors) -> None:
        self.model = model
        members = model.members([peer.group for peer in self.peers], self.name)
        self.members, self.count = members, len(members)
        if not self.count:
            return
        self.h = np.array([peer.smoothing_length for peer in self.peers])
        self.cutoff = self.smoothing.support * self.h
        alpha = np.array([peer.compliance for peer in self.peers])
        model.squares_fit(self.name, "smoothing_length", self.h)
        model.fits(self.name, {"compliance": alpha, "1 / smoothing_length": 1.0 / self.h})
        self.pairs = neighbors.request(
            self.name, members, self.cutoff, {"position"}, for_constraint=True
        )
        self.beyond = Beyond(self, model)
        b = np.zeros(model.particle_count)
        hd = self.h[model.world_of[members]] ** self.dimension
        b[members] = self._volumes() * self.smoothing.sigma / hd
        model.fits(self.name, {"mass / (rest_density smoothing_length^d)": b})
        self.b = self.pairs.hold(model.array(b, model.precision.scalar))
        self.Params, self.params = model.parameters(
            "DensityParameters",
            {
                "cutoff_squared": self.cutoff**2,
                "closest_squared": np.maximum(
                    (CLOSEST * self.cutoff) ** 2, np.finfo(model.precision.numpy).tiny
                ),
                "h": self.h,
                "inverse_h": 1.0 / self.h,
                "compliance": alpha,
            },
        )

    def _volumes(self) -> np.ndarray:
        """V of each member [length^d]."""
        mass, world = self.model.column("mass")[self.members], self.model.world_of[self.members]
        rest = np.empty(self.count)
        for w, peer in enumerate(self.peers):
            own = world == w
            if np.shape(peer.rest_density) not in ((), (own.sum(),)):
                raise validate.fail(
                    self.name, "rest_density", f"be one number or {own.sum()}, one for each "
                    "particle of its group", f"an array of shape {np.shape(peer.rest_density)}",
                    "match the group",
                )  # fmt: skip
            rest[own] = peer.rest_density
        return mass / rest

    def complaint(self) -> str:
        """That places are too coarse for the smoothing length."""
        if not self.count:
            return ""
        h = self.h[self.model.world_of[self.members]]
        return self.model.unresolved(self.name, "smoothing_length", h, self.members)

    def attach(self, model: Model, state: State) -> None:
        if not self.count:
            return
        precision, pairs = model.precision, self.pairs
        real, vec3 = precision.scalar, precision.vec3
        self.bodies = bodies(model, state)
        self.compensated = "position_error" in state
        self.easing = Easing(model, state.count, real, ends=2)
        self.Data, Sums = kernels.density_types(precision)
        self.virial = wp.zeros(model.particle_count, dtype=wp.float64, device=model.device)
        self.lengths = model.array(self.h, real)
        self.copies = {k: pairs.array(vec3) for k in ("x", "way")}
        self.copies |= {k: pairs.array(real) for k in ("free", "share", "push")}
        self.walled = bool(self.beyond)
        if self.walled:
            self.copies |= {"open": pairs.array(real), "lean": pairs.array(vec3)}
            self.beyond.attach(state)
        self.error, self.own, self.steep = (pairs.array(real) for _ in range(3))
        self.lam = wp.zeros(model.particle_count, dtype=real, device=model.device)
        self.Sums, self.w = Sums, state.inverse_mass
        laws = self.smoothing.weight, self.smoothing.slope
        (weight, slope), given = (law.function(precision) for law in laws), (precision, self.Params)
        self.crowd = self._kernel(
            kernels.crowding_term(weight, slope, *given),
            kernels.store_crowding(weight, self.walled, *given), Sums,
        )  # fmt: skip
        self.share = self._kernel(
            kernels.share_term(slope, *given), kernels.store_multiplier(*given), Sums
        )
        self.push = self._kernel(
            kernels.push_term(slope, *given),
            kernels.store_correction(self.walled, *given, self.compensated), bodies_type(precision),
        )  # fmt: skip

    def _kernel(self, term: Term, store: Any, out: Any) -> wp.Kernel:
        model = self.model
        return pair_kernel(
            term, store, self.Data, self.Params, out, model.precision, model.periodic,
            self.pairs.partners, model.vectorised,
        )  # fmt: skip

    def begin(self, state: State, neighbors: Neighbors, dt: float) -> None:
        if not self.count or dt <= 0:
            return
        model, pairs = self.model, self.pairs.pairs
        if math.isinf(dt):  # a static projection leaves the marks to the first step
            call(self.lam.zero_)
            return
        forgive, begin = kernels.slack_kernels(model.precision)
        with when(self.easing.any_marked):
            _, sums = self._look(dt, back=1.0, eased=0.0)
            inputs = [pairs, self.easing.marked, self.lengths, sums]
            launch(forgive, self.count, inputs, model.device)
            call(self.easing.unmark)
        inputs = [pairs, self.lengths, self.easing.struct, dt, self.easing.slack, self.lam,
                  self.virial]  # fmt: skip
        launch(begin, self.count, inputs, model.device)

    def _look(self, dt: float, back: float = 0.0, eased: float = 1.0) -> tuple[Any, Any]:
        """C of every particle, where it is or ``back`` where the substep began; returns copies
        and what is summed.

        ``eased``: without what the start is forgiven.
        """
        model, moving = self.model, math.isfinite(dt) and dt > 0
        inverse = 1.0 / dt if moving else 0.0
        data, sums = self.Data(), self.Sums()
        data.slot, data.b, data.virial = self.pairs.slots, self.b, self.virial
        for name, array in self.copies.items():
            setattr(data, name, array)
        sums.error, sums.own, sums.steep = self.error, self.own, self.steep
        sums.share, sums.push = data.share, data.push
        sums.lam, sums.slack, sums.w = self.lam, self.easing.slack, self.w
        sums.relaxation, sums.eased = model.settings.relaxation, eased
        sums.pace = self.easing.struct.speed * dt if moving else 0.0
        sums.pace_in_h = self.easing.struct.radii_per_time * dt if moving else 0.0
        data.unit = sums.unit = model.mass_unit
        data.inverse_dt = sums.inverse_dt = inverse
        gather = kernels.gather_kernel(model.precision, self.compensated, self.walled)
        inputs = [self.pairs.pairs, self.bodies, dt if moving else 0.0, float(moving), back, data]
        launch(gather, self.count, inputs, model.device)
        if self.walled:
            self.beyond.close_in(data, back)
        self._sum(self.crowd, data, sums)
        return data, sums

    def _sum(self, kernel: wp.Kernel, data: Any, out: Any) -> None:
        self.pairs.sum(kernel, [self.pairs.pairs, self.model.box, self.params, data, out])

    def project(self, state: State, neighbors: Neighbors, dt: float) -> None:
        if not self.count or dt <= 0:
            return
        data, sums = self._look(dt, eased=float(math.isfinite(dt)))
        self._sum(self.share, data, sums)
        self._sum(self.push, data, self.bodies)

    def errors(self, forgiven: bool = False) -> tuple[np.ndarray, np.ndarray]:
        """C of each particle where it is now, and its world, in the order of the pair list.

        ``forgiven``: without what the start is forgiven.
        """
        self._look(0.0, eased=float(forgiven))
        return self.error.numpy().astype(np.float64), self.pairs.world.numpy()

    def measure(self, state: State, energy: wp.array, virial: wp.array) -> None:
        """Add the virial of the last substep's pushes."""
        if self.count:
            launch(share_kernel(), len(virial), [self.virial, virial], self.model.device)

    def readable(self) -> dict[str, wp.array]:
        return {"virial": self.virial} if self.count else {}

    def reset(self, worlds: Sequence[int]) -> None:
        super().reset(worlds)
        self.forget(self.readable(), worlds)

    def limits(self, probe: Probe) -> list[Limit]:
        """By the speed of the particles against the smoothing length."""
        if not self.count:
            return []
        length = self.h[probe.model.world_of[self.members]]
        return passing_limits(self.name, probe, self.members, length, "h")
