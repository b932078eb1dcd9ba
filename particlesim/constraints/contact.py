"""Contacts between particles."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import warp as wp

from .. import validate
from ..engine import topology
from ..engine.easing import Easing
from ..engine.execution.launch import call, launch, repeat, when
from ..engine.limit import Limit
from ..engine.model import Model
from ..engine.neighbors.lists import Neighbors
from ..engine.probe import Probe
from ..engine.state import State
from ..kernels.constraints import contact as kernels
from ..kernels.constraints import contact_rows as rows
from ..kernels.constraints.contact_search import find_kernel
from ..kernels.engine.bounces import decide_kernel
from .easing import EasedConstraint
from .limits import contact_limits
from .solving.contact_bounce import ContactBounce
from .touching import Touching
from .tuples import bodies

CLOSEST = 1e-9  # parts of the cutoff: closer than this, particles count as coincident


class Contact(EasedConstraint):
    """Particles keep apart: r >= R_i + R_j, with Coulomb friction and restitution.

    Who touches whom is found once a substep, on the straight way that particles take in it. All
    contacts of a sweep are solved at once (Jacobi), each particle taken as split among its contacts
    (Tonge et al. 2012), so that no number of contacts makes them overshoot. Multipliers lam >= 0
    add up over the sweeps of a substep:

        dlam = (R_i + R_j - r - alpha~ lam) / (c_i w_i + c_j w_j + alpha~)

    with the crowding c. Corrections of a pair are opposite and equal, and lie along its direction
    where the substep began: momentum and angular momentum are kept to round-off, whatever the
    number of contacts (as by SHAKE, Ryckaert et al. 1977). Friction takes back the tangential way
    of the substep, up to mu lam (Macklin et al. 2014, eq. 24). Particles do not spin: friction
    keeps momentum, and not the angular momentum that its couple would give to their spins.

    What bounces is sent off where the substep began, a part of a substep early: with the speed v
    before the substep's forces, v' n >= -e v n for all that touch, and no impulse where it is
    more (Moreau 1988). This is swept until it holds to 1e-6 of the way, so that e = 1 keeps the
    energy, of any number that touch at once, too: a row of balls that touch shares a blow among
    all, a row with gaps passes it on to the last. What comes no faster than the forces of two
    substeps would make it rests, and does not bounce.

    What overlaps at the start, or after positions were written, does not explode: the particles
    count as smaller, by just as much as leaves no overlap, and grow back within some 30 frames, at
    no more than ``Settings.depenetration_speed``. A particle that passes through another in one
    substep is stopped where it came from; one that is out of the reach of the list of pairs
    afterwards is missed.

    Radii may differ as they like: a large particle among many small ones costs no more than the
    contacts that it has, since who may touch whom is looked for by size.

    A stack rests on overlaps: those of the lowest layer are a few times layers times g dt^2, which
    smaller substeps, or else more iterations, reduce.

    Args:
        group: Which particles touch each other; None: all. Those of radius 0 are points.
        friction: mu, at least 0.
        restitution: e, 0 to 1: speed after over speed before.
        compliance: alpha, overlap over force [length / force], at least 0; alpha~ = alpha / dt^2.

        exclude: Pairs that do not touch each other, (m, 2); or constraints and bonds that hold
            them, one or several; True: whatever a constraint of the scene holds together, as for a
            cloth that touches itself.

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
        compliance: float = 0.0, exclude: Any = None,
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
        self.exclude = exclude
        if exclude is not True:
            topology.excluded(name, exclude)  # which says what is wrong with it

    def prepare(self, model: Model, neighbors: Neighbors) -> None:
        self.model, self.neighbors = model, neighbors
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

    def attach(self, model: Model, state: State) -> None:
        if not self.count:
            return
        precision = model.precision
        self.bodies = bodies(model, state)
        self.radius = state.radius
        forced, compensated = "force" in state, "position_error" in state
        self.force = (
            state.force if forced else wp.empty(0, dtype=precision.vec3, device=model.device)
        )
        self.easing = Easing(model, state.count, precision.scalar, ends=2)
        tiny = np.finfo(precision.numpy).tiny
        columns = {
            "closest_squared": np.maximum((CLOSEST * self.cutoff) ** 2, tiny),
            **{name: self._column(name) for name in ("friction", "restitution", "compliance")},
        }
        Params, self.params = model.parameters("ContactParameters", columns)
        excluded = topology.merged(
            self.name, "exclude", model, [self._excluded(w) for w in range(model.world_count)]
        )
        self.apart = model.array(topology.partners(model, excluded), wp.int32)
        self.touching = Touching(model, rough=bool(columns["friction"].any()))
        self.neighbors.kept.append(self.touching)
        self.bouncing = bool(columns["restitution"].any())
        self.fresh = False  # whether bounces are yet to be settled in this substep
        self.start_kernel = kernels.start_kernel(precision, compensated, forced)
        self.find_kernel = find_kernel(precision, model.periodic, Params)
        self.count_kernel = rows.crowding_kernel(precision, Params)
        self.push_kernel = rows.push_kernel(precision, Params, compensated)
        # Particles by themselves have bounced off when they are projected.
        bodies_here = any(each.rank == 0 for each in model.scenes[0].constraints)
        self.through_bodies = ContactBounce(self) if self.bouncing and bodies_here else None

    def _excluded(self, w: int) -> np.ndarray:
        """Pairs of world w that do not touch each other."""
        given = self.peers[w].exclude
        if given is True:
            scene = self.model.scenes[w]
            given = [each for each in scene.constraints if hasattr(each, topology.HELD)]
        return topology.excluded(self.name, given)

    def _launch(self, kernel: wp.Kernel, inputs: Sequence[Any]) -> None:
        launch(kernel, self.count, [self.pairs.pairs, *inputs], self.model.device)

    def begin(self, state: State, neighbors: Neighbors, dt: float) -> None:
        # A static projection goes by the radii as they are, and leaves the marks to the first step.
        if not self.count or math.isinf(dt) or dt <= 0:
            return
        model, slack = self.model, self.easing.slack
        measure, run_out = kernels.slack_kernels(model.precision, model.periodic)
        with when(self.easing.any_marked):
            inputs = [
                model.box, self.easing.marked, self.apart, self.bodies, self.radius, dt, slack
            ]  # fmt: skip
            self._launch(measure, inputs)
            call(self.easing.unmark)
        self._launch(run_out, [self.radius, self.easing.struct, dt, slack])
        self.fresh = True
        self._find(dt, 1.0)

    def _find(self, dt: float, moving: float) -> None:
        """The pairs that touch from now on, on the way of ``dt``, in a static projection of 0."""
        touching = self.touching.struct
        touching.inverse_dt = 1.0 / dt if moving else 0.0
        inputs = [
            self.bodies, self.force, self.radius, self.easing.slack, moving, dt, moving, touching
        ]  # fmt: skip
        self._launch(self.start_kernel, inputs)
        inputs = [self.model.box, self.params, self.apart, self.bodies, dt, touching]
        self._launch(self.find_kernel, inputs)

    def project(self, state: State, neighbors: Neighbors, dt: float) -> None:
        if not self.count or dt <= 0:
            return
        moving = not math.isinf(dt)
        if not moving:
            self._find(0.0, 0.0)
        self._sweep(dt, moving, again=False)
        if self.bouncing and self.fresh:  # once a substep: what follows finds it settled
            self.fresh = False
            self._decide()
            with repeat(self.touching.flag):
                self._sweep(dt, moving, again=True)
                self._decide()
            call(self.touching.run)

    def _sweep(self, dt: float, moving: bool, again: bool) -> None:
        touching, own = self.touching.struct, dt if moving else 0.0
        take = kernels.way_kernel(self.model.precision)
        self._launch(take, [self.bodies, own, float(moving), int(again), touching])
        self._launch(self.count_kernel, [self.params, self.bodies, int(again), touching])
        self._launch(self.push_kernel, [self.params, int(again), touching, self.bodies])

    def _decide(self) -> None:
        """Which worlds are swept again."""
        model, it = self.model, self.touching
        call(it.flag.zero_)
        most = model.settings.bounce_iterations - 1  # besides that of the iteration
        inputs = [most, it.struct.running, it.struct.unsettled, it.sweeps, it.flag]
        launch(decide_kernel(), model.world_count, inputs, model.device)

    @property
    def bounces(self) -> bool:
        return bool(self.count) and self.through_bodies is not None

    def start_bounce(self, state: State, neighbors: Neighbors, bounces: Any, dt: float) -> None:
        if self.count and self.through_bodies:
            self.through_bodies.start(bounces)

    def bounce(self, state: State, neighbors: Neighbors, bounces: Any, dt: float) -> None:
        if self.count and self.through_bodies:
            self.through_bodies.sweep(bounces)

    def measure(self, state: State, energy: wp.array, virial: wp.array) -> None:
        """Add the virial of the last substep's contacts."""
        if self.count:
            inputs = [self.touching.struct.virial, virial]
            launch(kernels.share_kernel(), len(virial), inputs, self.model.device)

    def readable(self) -> dict[str, wp.array]:
        return {"virial": self.touching.struct.virial} if self.count else {}

    def reset(self, worlds: Sequence[int]) -> None:
        super().reset(worlds)
        self.forget(self.readable(), worlds)

    def limits(self, probe: Probe) -> list[Limit]:
        """By the speed of the particles against their radius."""
        return contact_limits(self, probe)
