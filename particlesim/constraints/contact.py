"""Contacts between particles."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import warp as wp

from .. import validate
from ..engine.easing import Easing
from ..engine.execution.launch import call, launch, when
from ..engine.limit import Limit
from ..engine.model import Model
from ..engine.neighbors.lists import Neighbors
from ..engine.probe import Probe
from ..engine.state import State
from ..kernels.constraints import contact as kernels
from ..kernels.constraints import contact_terms as terms
from ..kernels.constraints.constraints import bodies_type
from ..kernels.engine.loops import Term
from ..kernels.interactions.pair import pair_kernel
from .easing import EasedConstraint
from .limits import contact_limits
from .tuples import bodies

CLOSEST = 1e-9  # parts of the cutoff: closer than this, particles count as coincident


class Contact(EasedConstraint):
    """Particles keep apart: r >= R_i + R_j, with Coulomb friction and restitution.

    All contacts of an iteration are solved at once from the same positions (Jacobi), each particle
    taken as split among its contacts (Tonge et al. 2012): pair corrections are opposite and equal,
    so momentum is conserved, and no number of contacts makes them overshoot. Friction takes back
    the tangential way of the substep, up to mu times the normal correction (Macklin et al. 2014,
    eq. 24); particles do not spin. Restitution sets velocities after the solve (Mueller et al.
    2020, eq. 34).

    What overlaps at the start, or after positions were written, does not explode: the particles
    count as smaller, by just as much as leaves no overlap, and grow back within some 30 frames, at
    no more than ``Settings.depenetration_speed``. A particle that passes through the middle of
    another in one substep is stopped where it came from; one that passes it altogether is missed.

    Radii may differ as they like: a large particle among many small ones costs no more than the
    contacts that it has, since who may touch whom is looked for by size.

    A stack rests on overlaps: those of the lowest layer are a few times layers times g dt^2, which
    smaller substeps, or else more iterations, reduce.

    Args:
        group: Which particles touch each other; None: all. Those of radius 0 are points.
        friction: mu, at least 0.
        restitution: e, 0 to 1: speed after over speed before.
        compliance: Overlap over force [length / force], at least 0. A compliant contact is solved
            once a substep, so that it does not depend on the iterations.

    Raises:
        ValueError: Values out of range.

    Example:
        >>> Contact(friction=0.3).friction
        0.3
    """

    requires = frozenset({"position", "velocity", "inverse_mass", "radius", "correction"})
    rank = 1

    def __init__(
        self, group: Any = None, friction: float = 0.0, restitution: float = 0.0, *,
        compliance: float = 0.0,
    ):  # fmt: skip
        name = self.name
        self.group = group
        self.friction = validate.number(name, "friction", friction, minimum=0.0)
        self.restitution = validate.number(
            name, "restitution", restitution, minimum=0.0, maximum=1.0
        )
        self.compliance = validate.number(
            name, "compliance", compliance, minimum=0.0, unit="length/force"
        )

    def prepare(self, model: Model, neighbors: Neighbors) -> None:
        self.model = model
        members = model.members([peer.group for peer in self.peers], self.name)
        self.members = members
        radius, world = model.column("radius")[members], model.world_of[members]
        largest = np.zeros(model.world_count)
        np.maximum.at(largest, world, radius)
        self.count = len(members) if largest.max(initial=0.0) > 0 else 0
        if not self.count:
            return
        model.squares_fit(self.name, "radius", radius)
        model.fits(self.name, {"compliance": self._column("compliance")})
        self.pairs = neighbors.request(
            self.name, members, 2.0 * largest, {"position"}, for_constraint=True, half=radius
        )
        # A world of points has no contacts, and no list.
        self.cutoff = 2.0 * np.where(largest > 0, largest, largest.max())

    def complaint(self) -> str:
        """That nothing can touch, where all are points, or that places are too coarse for radii."""
        members = self.members
        if self.count or len(members) < 2:
            return self.model.unresolved_radii(self.name, members)
        return (
            f"{self.name}: radius must be above 0 for particles to touch, got 0 for all "
            f"{len(members)}; give add_particles(..., radius=...)."
        )

    def _column(self, name: str) -> np.ndarray:
        return np.array([getattr(peer, name) for peer in self.peers], dtype=float)

    def _params(self, active: np.ndarray) -> tuple[Any, wp.array]:
        """Parameters with which the worlds that are not ``active`` find no pairs."""
        columns = {
            "cutoff_squared": np.where(active, self.cutoff**2, 0.0),
            "closest_squared": np.maximum(
                (CLOSEST * self.cutoff) ** 2, np.finfo(self.model.precision.numpy).tiny
            ),
            **{name: self._column(name) for name in ("friction", "restitution", "compliance")},
        }
        return self.model.parameters("ContactParameters", columns)

    def attach(self, model: Model, state: State) -> None:
        if not self.count:
            return
        precision = model.precision
        self.bodies = bodies(model, state)
        self.radius = state.radius
        self.forced = "force" in state
        self.force = (
            state.force if self.forced else wp.empty(0, dtype=precision.vec3, device=model.device)
        )
        self.compensated = "position_error" in state
        self.easing = Easing(model, state.count, precision.scalar, ends=2)
        rough, hard = self._column("friction") > 0, self._column("compliance") == 0
        bouncing = self._column("restitution") > 0
        self.rough, self.bouncing = bool(rough.any()), bool(bouncing.any())
        Data, Shares = kernels.contact_types(precision)
        self.copies = {k: self.pairs.array(precision.vec3) for k in ("x", "way")}
        self.copies |= {k: self.pairs.array(precision.scalar) for k in ("radius", "share")}
        if self.rough:
            self.copies["grip"] = self.pairs.array(precision.scalar)
        if self.bouncing:
            self.copies["v"] = self.pairs.array(precision.vec3)
        self.Data = Data
        self.virial = wp.zeros(model.particle_count, dtype=wp.float64, device=model.device)
        self.shares, self.bounce_shares = Shares(), Shares()
        for shares, relaxation in (
            (self.shares, model.settings.relaxation), (self.bounce_shares, 1.0)
        ):  # fmt: skip
            shares.share, shares.w = self.copies["share"], state.inverse_mass
            shares.unit, shares.relaxation = model.mass_unit, relaxation
        if self.rough:
            self.shares.grip = self.bounce_shares.grip = self.copies["grip"]
        self.everywhere = self._params(np.ones_like(rough))
        self.bounce_params = self._params(bouncing)
        # A world is solved by the kernel that it would be solved by alone. First come the passes of
        # the first sweep, then those of all others, from which compliant contacts are left out.
        self.passes = [
            [
                (self._push_kernel(with_friction), self._params(chosen)[1])
                for with_friction, chosen in ((False, ~rough & also), (True, rough & also))
                if chosen.any()
            ]
            for also in (np.ones_like(rough), hard)
        ]
        self.count_kernel, self.count_bounces = (
            self._kernel(
                terms.crowding_term(precision, self._Params, bounce),
                terms.store_share,
                Shares,
            )
            for bounce in (False, True)
        )
        self.bounce_kernel = self._kernel(
            terms.bounce_term(precision, self._Params), terms.store_impulse,
            bodies_type(precision),
        )  # fmt: skip

    @property
    def _Params(self) -> Any:
        return self.everywhere[0]

    def _kernel(self, term: Term, store: Any, out: Any) -> wp.Kernel:
        model = self.model
        return pair_kernel(
            term, store(model.precision, self._Params), self.Data, self._Params, out,
            model.precision, model.periodic, self.pairs.partners, model.vectorised,
        )  # fmt: skip

    def _push_kernel(self, friction: bool) -> wp.Kernel:
        precision = self.model.precision
        return self._kernel(
            terms.contact_term(precision, self._Params, friction),
            lambda *types: terms.store_correction(*types, self.compensated),
            bodies_type(precision),
        )  # fmt: skip

    def begin(self, state: State, neighbors: Neighbors, dt: float) -> None:
        self.sweep = 0
        # A static projection goes by the radii as they are, and leaves the marks to the first step.
        if not self.count or math.isinf(dt) or dt <= 0:
            return
        model, pairs = self.model, self.pairs.pairs
        measure, run_out = kernels.slack_kernels(model.precision, model.periodic)
        slack = self.easing.slack
        with when(self.easing.any_marked):
            launch(
                measure,
                self.count,
                [pairs, model.box, self.easing.marked, self.bodies, self.radius, dt, slack],
                model.device,
            )
            call(self.easing.unmark)
        inputs = [pairs, self.radius, self.easing.struct, dt, slack, self.virial]
        launch(run_out, self.count, inputs, model.device)

    def _data(self, dt: float) -> Any:
        """The copies in slot order, as the terms take them."""
        data = self.Data()
        data.slot = self.pairs.slots
        for name, array in self.copies.items():
            setattr(data, name, array)
        data.virial, data.inverse_dt, data.unit = self.virial, 1.0 / dt, self.model.mass_unit
        return data

    def _sum(self, kernel: wp.Kernel, params: wp.array, data: Any, out: Any) -> None:
        inputs = [self.pairs.pairs, self.model.box, params, data, out]
        self.pairs.sum(kernel, inputs)

    def project(self, state: State, neighbors: Neighbors, dt: float) -> None:
        passes = self.passes[min(self.sweep, 1)] if self.count and dt > 0 else []
        self.sweep += 1
        if not passes:
            return
        model, data = self.model, self._data(dt)
        moving = not math.isinf(dt)
        gather = kernels.gather_kernel(model.precision, self.compensated)
        launch(
            gather,
            self.count,
            [self.pairs.pairs, self.bodies, self.radius, self.easing.slack, float(moving),
             dt if moving else 0.0, float(moving), data],
            model.device,
        )  # fmt: skip
        self._sum(self.count_kernel, self.everywhere[1], data, self.shares)
        for kernel, params in passes:
            self._sum(kernel, params, data, self.bodies)

    def finish(self, state: State, neighbors: Neighbors, dt: float) -> None:
        if not self.count or not self.bouncing or dt <= 0:
            return
        model, data = self.model, self._data(dt)
        gather = kernels.gather_bounce_kernel(model.precision, self.compensated, self.forced)
        launch(
            gather,
            self.count,
            [self.pairs.pairs, self.bodies, self.force, self.radius, self.easing.slack, dt,
             1.0 / dt, data],
            model.device,
        )  # fmt: skip
        self._sum(self.count_bounces, self.bounce_params[1], data, self.bounce_shares)
        self._sum(self.bounce_kernel, self.bounce_params[1], data, self.bodies)

    def measure(self, state: State, energy: wp.array, virial: wp.array) -> None:
        """Add the virial of the last substep's contacts."""
        if self.count:
            launch(kernels.share_kernel(), len(virial), [self.virial, virial], self.model.device)

    def readable(self) -> dict[str, wp.array]:
        return {"virial": self.virial} if self.count else {}

    def reset(self, worlds: Sequence[int]) -> None:
        super().reset(worlds)
        self.forget(self.readable(), worlds)

    def limits(self, probe: Probe) -> list[Limit]:
        """By the speed of the particles against their radius."""
        return contact_limits(self, probe)
