"""What a solve for pressures sums over pairs: rates of density, their answer to pressures."""

from __future__ import annotations

import functools
from collections.abc import Mapping
from typing import Any

import warp as wp

from ....kernels.interactions.fluid import images
from ....kernels.interactions.fluid.incompressible import dfsph as kernels
from ....kernels.interactions.fluid.seen import Seen
from ....kernels.interactions.fluid.sph import DIRECTIONS, force_term
from ....kernels.interactions.fluid.walls import normals_of
from ...pair_loop import PairLoop
from ..walls import Pass


class PressurePasses:
    """Passes over the pairs of a fluid, and over their images in walls.

    Args:
        fluid: A ``DFSPH``, attached, and its walls.
    """

    def __init__(self, fluid: Any):
        self.fluid, self.model, self.walls = fluid, fluid.model, fluid.walls
        pairs, precision = fluid.pairs, fluid.model.precision
        self.places = self.walls.total if self.walls else 0
        # Speeds at which walls are left, by place; of accelerations likewise.
        each = precision.vector(max(self.places, 1))
        self.parting, self.parting_faster = pairs.array(each), pairs.array(each)
        none = wp.empty(0, dtype=normals_of(precision, 1), device=self.model.device)
        self.normal = self.walls.normal if self.walls else none
        self.rate_at_walls = self.walls.rate if self.walls else self.parting
        self.a, self.u = pairs.array(precision.vec3), pairs.array(precision.vec3)
        self.k, self.rate, self.diagonal = (pairs.array(precision.scalar) for _ in range(3))
        x, m = pairs.fields["position"], pairs.fields["mass"]
        self.of_velocity = self._rates({"x": x, "m": m, "v": self.u}, self.parting)
        self.of_acceleration = self._rates({"x": x, "m": m, "v": self.a}, self.parting_faster)
        self.diagonals = self._diagonals({"x": x, "m": m})
        self.accelerations = self._accelerations({"x": x, "m": m, "k": self.k})

    def sum_diagonal(self) -> None:
        """A_ii."""
        self._sum(self.diagonals)

    def answer(self) -> None:
        """The acceleration by the present pressures, and the rate of density that it has."""
        for passes in (self.accelerations, self.of_acceleration):
            self._sum(passes)

    def sum_rate(self) -> None:
        """The rate of density by the velocities u."""
        self._sum(self.of_velocity)

    def _sum(self, passes: list[Pass]) -> None:
        if self.walls:
            self.walls.sum(*passes)
        else:
            passes[0].loop.sum(*passes[0][1:])

    # What each is made of ---------------------------------------------------------------------

    def _loop(self, name: str, fields: Mapping[str, wp.array]) -> PairLoop:
        fluid = self.fluid
        return PairLoop.over(self.model, fluid.pairs, name, fields, fluid.Params, fluid.params)

    def _seen(self, counts: bool) -> list[Seen]:
        """One wall, and several; fluids slip along them, where how they approach ``counts``."""
        total = self.walls.total
        slips = (False,) * total if counts else None
        return [Seen(total, None if slips is None else slips[:1], True), Seen(total, slips)]

    def _steep(self, approaching: bool, loop: PairLoop) -> wp.Function:
        return kernels.steepness(self.fluid.slope, approaching, *loop.types)

    def _rates(self, fields: Mapping[str, wp.array], parting: wp.array) -> list[Pass]:
        loop, dimension = self._loop("Rates", fields), self.fluid.dimension
        term = kernels.rate_term(self._steep(True, loop), dimension, *loop.types)
        out = {"rate": self.rate}
        found = [Pass(loop, term, kernels.keep_rate, out)]
        if self.walls:
            beside = {**fields, "wall": self.walls.distance, "rate": parting}
            loop = self._loop("RatesBesideWalls", beside)
            steep, types = self._steep(True, loop), loop.types
            for seen in self._seen(True):
                term = kernels.walled_rate_term(steep, seen, dimension, *types)
                own = kernels.own_rate(steep, seen, *types)
                store = functools.partial(kernels.keep_walled_rate, own)
                found.append(Pass(loop, term, store, out))
        return found

    def _diagonals(self, fields: Mapping[str, wp.array]) -> list[Pass]:
        loop, dimension = self._loop("Diagonals", fields), self.fluid.dimension
        term = kernels.diagonal_term(self._steep(False, loop), dimension, *loop.types)
        out = {"diagonal": self.diagonal}
        found = [Pass(loop, term, kernels.keep_diagonal, out)]
        if self.walls:
            out = {**out, "normal": self.normal}
            loop = self._loop("DiagonalsBesideWalls", {**fields, "wall": self.walls.distance})
            steep, types = self._steep(False, loop), loop.types
            for seen in self._seen(False):
                term = kernels.walled_diagonal_term(steep, seen, dimension, *types)
                own = images.own_push(steep, None, seen, *types)
                store = functools.partial(kernels.keep_walled_diagonal, own, seen)
                found.append(Pass(loop, term, store, out))
        return found

    def _accelerations(self, fields: Mapping[str, wp.array]) -> list[Pass]:
        loop, dimension = self._loop("Pressures", fields), self.fluid.dimension
        pull = kernels.pressure_pull(self.fluid.slope, *loop.types)
        term = force_term(pull, None, False, dimension, *loop.types)
        out = {"a": self.a, "w": self.fluid.state.inverse_mass}
        found = [Pass(loop, term, kernels.keep_acceleration, out)]
        if self.walls:
            out = {**out, "normal": self.normal, "parting": self.parting_faster}
            loop = self._loop("PressuresBesideWalls", {**fields, "wall": self.walls.distance})
            types = loop.types
            pull = kernels.pressure_pull(self.fluid.slope, *types)
            for seen in self._seen(False):
                term = images.force_term(pull, None, seen, DIRECTIONS[dimension], *types)
                own = images.own_push(pull, None, seen, *types)
                store = functools.partial(kernels.keep_walled_acceleration, own, seen)
                found.append(Pass(loop, term, store, out))
        return found
