"""Walls of a fluid: boundaries that hold it up by its own pressure."""

from __future__ import annotations

import functools
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
import warp as wp

from ...engine.easing import Easing
from ...engine.execution.launch import call, launch, when
from ...engine.model import Model, filled, structure_of
from ...engine.state import State
from ...kernels.interactions.fluid import images, presses
from ...kernels.interactions.fluid import walls as kernels
from ...kernels.interactions.fluid.sph import DIRECTIONS
from ...scene.constraint_base import ConstraintBase
from ...scene.part import Part
from ..pair_loop import PairLoop

MOST = 4  # places of walls: each doubles the images


class Pass(NamedTuple):
    """What of a pass over pairs differs beside walls: a loop, its term, a store and what it writes.

    See :meth:`~particlesim.interactions.pair_loop.PairLoop.sum`.
    """

    loop: PairLoop
    term: Any
    store: Any
    out: Mapping[str, wp.array]


class Walls:
    """The boundaries that hold particles of a fluid, which see their images in them.

    The fluid beyond a wall is its own mirror image (Libersky and Petschek 1991; Morris et al.
    1997), without particles of its own (see :mod:`particlesim.kernels.interactions.fluid.images`).

    A side to which a start has placed particles nearer than half a spacing gives way by as much, at
    most by a spacing, and comes back slowly, as overlaps of contacts do: a tank that is no whole
    number of spacings wide does not burst.

    A fluid whose smoothing lengths are its particles' own sees none: boundaries hold such particles
    by their radius alone.

    Sides of boundaries take places: the three axes of a box one each, every other boundary one. Of
    more than four places walls share the last, and there a particle sees the nearest.

    Args:
        fluid: A bound ``SPH``.
        model: Its worlds.
    """

    def __init__(self, fluid: Any, model: Model):
        self.fluid, self.model = fluid, model
        kinds = zip(*(scene.constraints for scene in model.scenes), strict=True)
        bound = [
            peers[0].bind(peers) for peers in kinds if peers[0].solid and fluid.adaptive is None
        ]
        held = [(part, _held(model, fluid, part)) for part in bound]
        self.held = [(part, flags) for part, flags in held if flags.any()]
        peers = [peer for part, _ in self.held for peer in part.peers]
        self.requires = {"time"} if any(peer.moves for peer in peers) else set()

    def __bool__(self) -> bool:
        return bool(self.held)

    def attach(self, state: State, fields: Mapping[str, wp.array]) -> None:
        """Make the arrays and the terms; ``fields`` are what those of the fluid read."""
        moving = "v" in fields  # what approaches a wall counts
        model, precision = self.model, self.model.precision
        self.walls = [part.wall(model, state) for part, _ in self.held]
        self.flags = [model.array(flags, wp.int32) for _, flags in self.held]
        self.places, first = list[tuple[int, ...]](), 0
        for wall in self.walls:
            self.places.append(tuple(min(first + place, MOST - 1) for place in wall.places))
            first = max(self.places[-1]) + 1
        self.total = min(first, MOST)
        pairs, each = self.fluid.pairs, precision.vector(self.total)
        self.distance = pairs.array(each)
        self.rate = pairs.array(each) if moving else None
        none = wp.empty(0, dtype=each, device=model.device)
        self.struct = kernels.near_type(precision, self.total)()
        self.struct.distance = self.distance
        self.struct.rate = none if self.rate is None else self.rate
        viscous = bool(self.fluid.viscosity)
        sticks = [wall.sticky and viscous for wall in self.walls]
        carried = any(on and len(wall.pose) for on, wall in zip(sticks, self.walls, strict=True))
        vec3, count = precision.vec3, pairs.count if carried else 0
        self.against = pairs.array(vec3) if count else wp.empty(0, dtype=vec3, device=model.device)
        self.struct.against = self.against
        holds = {k for on, places in zip(sticks, self.places, strict=True) if on for k in places}
        self.sticky = tuple(k in holds for k in range(self.total)) if moving else None
        self.normal = pairs.array(kernels.normals_of(precision, self.total))
        self.struct.normal = self.normal
        self.struct.near = wp.zeros(pairs.rows, dtype=wp.int32, device=model.device)
        # Of every side in every world how far it gives way to the start.
        sides = [len(wall.places) for wall in self.walls]
        self.stride, self.begins = sum(sides), np.cumsum([0, *sides])[:-1].tolist()
        self.easing = Easing(model, model.world_count * self.stride, wp.float32, ends=1)
        # Density by continuity and heat answer to a wall that comes back.
        answers = self.fluid.continuity is not None or self.fluid.hot
        count = len(self.easing.slack) if answers else 0
        self.closing = wp.zeros(count, dtype=wp.float32, device=model.device)
        self.rest = model.array(0.5 * self.fluid.spacings, precision.scalar)
        self._make_terms(fields)

    def ease(self, dt: float) -> None:
        """The slack of the start runs out."""
        if dt <= 0:
            return
        easing = self.easing
        inputs = [self.rest, easing.struct, dt, self.stride, easing.slack, self.closing]
        kernel = kernels.ease_kernel(self.model.precision)
        launch(kernel, len(easing.slack), inputs, self.model.device)
        call(easing.unmark)

    def persistent(self) -> dict[str, wp.array]:
        """What outlives a substep."""
        closing = {"closing": self.closing} if len(self.closing) else {}
        return {**self.easing.persistent(), **closing}

    @property
    def worlds(self) -> np.ndarray:
        """The world of each row of the slack, and of how fast it closes."""
        return np.repeat(np.arange(self.model.world_count), self.stride)

    def _make_terms(self, fields: Mapping[str, wp.array]) -> None:
        model, fluid = self.model, self.fluid
        self.fields = beside = {**fields, "wall": self.distance}
        if self.rate is not None:
            beside["rate"] = self.rate
        if len(self.against):
            beside["against"] = self.against
        given = model, fluid.pairs, "FluidBesideWalls", beside, fluid.Params, fluid.params
        self.loop = PairLoop.over(*given)
        self.types = types = self.loop.types
        self.pulls, direction = fluid.pull(*types), DIRECTIONS[fluid.dimension]
        pair = self.pulls, fluid.dragged(*types)
        against = "against" if len(self.against) else "v"
        self.seen = images.Seen(self.total, self.sticky, against=against)
        one = None if self.sticky is None else self.sticky[:1]
        self.ways = [images.Seen(self.total, one, True, against), self.seen]
        self.sums = [fluid.beside_walls(each, *types) for each in self.ways]
        self.force_terms = [images.force_term(*pair, each, direction, *types) for each in self.ways]
        self.own_pushes = [images.own_push(*pair, each, *types) for each in self.ways]

    def look(self) -> None:
        """Find how far the walls are from where particles are now."""
        model, fluid, pairs = self.model, self.fluid, self.fluid.pairs
        precision, device = model.precision, model.device
        x, slack = pairs.fields["position"], self.easing.slack
        v = x if self.rate is None else pairs.fields["velocity"]
        seen = []
        for wall, places, flags in zip(self.walls, self.places, self.flags, strict=True):
            wall.follow()
            surface = kernels.Surface(
                wall.facing, places, self.total, precision, wall.Params, len(wall.pose) > 0,
                wall.sticky and len(self.against) > 0, fluid.dimension,
            )  # fmt: skip
            seen.append((surface, [pairs.pairs, wall.params, wall.pose, flags, x]))
        marked = self.easing.marked
        with when(self.easing.any_marked):
            forget = kernels.forget_kernel()
            launch(forget, len(slack), [marked, self.stride, slack], device)
            for begin, (surface, inputs) in zip(self.begins, seen, strict=True):
                own = [*inputs, marked, self.rest, begin, self.stride, slack]
                launch(kernels.overlap_kernel(surface), pairs.count, own, device)
        nowhere = kernels.nowhere_kernel(precision, self.total, fluid.Params)
        launch(nowhere, pairs.count, [pairs.pairs, fluid.params, v, self.struct], device)
        for begin, (surface, inputs) in zip(self.begins, seen, strict=True):
            own = [*inputs, v, begin, self.stride, slack, self.closing, self.struct]
            launch(kernels.distance_kernel(surface), pairs.count, own, device)
        alike = self.sticky is None or len(set(self.sticky)) == 1
        near = kernels.near_kernel(precision, self.total, alike, fluid.Params)
        launch(near, pairs.rows, [pairs.pairs, fluid.params, self.struct], device)

    def sum_density(self, plain: Pass, keep: Any) -> None:
        """The pass of densities, of which ``plain`` is that far from walls.

        ``keep`` makes the store of a particle's own term.
        """
        if not self:
            plain.loop.sum(*plain[1:])
            return
        self.look()
        beside = [
            Pass(self.loop, term, functools.partial(keep, own), plain.out)
            for term, own in self.sums
        ]
        self.sum(plain, *beside)

    def sum_force(self, plain: Pass) -> None:
        """The pass of forces, of which ``plain`` is that far from walls."""
        if not self:
            plain.loop.sum(*plain[1:])
            return
        out = {**plain.out, "normal": self.normal}
        beside = [
            Pass(self.loop, term, functools.partial(images.add_force, own, seen), out)
            for term, own, seen in zip(self.force_terms, self.own_pushes, self.ways, strict=True)
        ]
        self.sum(plain, *beside)

    def pressed(self, part: Part) -> tuple[np.ndarray, np.ndarray] | None:
        """What the fluid exerts on a boundary, at the last densities; None: nothing.

        Rows of its particles, and forces, (k, 3).

        To each of several walls the part along its normal, and what drags along them to the first
        to which it sticks.
        """
        for (wall, _), places in zip(self.held, self.places, strict=True):
            if wall.peers != part.peers:
                continue
            pairs, dragged = self.fluid.pairs, self.fluid.dragged(*self.types)
            given = self.pulls, dragged, self.seen, places
            term = presses.press_term(*given, *self.types)
            own = presses.own_press(*given, *self.types)
            store = functools.partial(presses.keep_press, own, places, self.total)
            pressed = pairs.array(self.model.precision.vec3)
            self.loop.sum(term, store, {"pressed": pressed, "normal": self.normal})
            return pairs.order.numpy(), -pressed.numpy().astype(np.float64)
        return None

    def sum(self, plain: Pass, *beside: Pass) -> None:
        """A pass over pairs; ``beside``: beside one wall, and beside several."""
        model, pairs, made = self.model, self.fluid.pairs, []
        for loop, term, store, out in (plain, *beside):
            Out = structure_of("PairSums", out)
            own = store(*loop.types, Out)
            made.append((term, own, loop.Data, Out))
        kernel = images.walled_kernel(
            *made, self.fluid.Params, model.precision, model.periodic, pairs.partners,
            model.vectorised, self.total,
        )  # fmt: skip
        written = [filled(made[k][3], each.out) for k, each in ((0, plain), (-1, beside[-1]))]
        inputs = [pairs.pairs, model.box, self.fluid.params, plain.loop.data, written[0]]
        pairs.sum(kernel, [*inputs, self.struct, beside[-1].loop.data, written[1]])


def _held(model: Model, fluid: Any, part: ConstraintBase) -> np.ndarray:
    """By particle, whether it is one of the fluid that a boundary holds, (n,) of 0 and 1."""
    members = model.members([peer.group for peer in part.peers], part.name)
    held = np.zeros(model.particle_count, dtype=np.int32)
    held[np.intersect1d(members, fluid.pairs.members_host)] = 1
    return held
