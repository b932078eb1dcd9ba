"""Which walls a term over images looks at, and how it reads of them."""

import functools
import itertools
from typing import NamedTuple

import warp as wp

from ...precision import Precision, function


class Seen(NamedTuple):
    """Which walls a term looks at.

    Args:
        total: Places of walls in the arrays.
        sticky: By place, whether the fluid sticks there; None: the approach does not count.
        alone: Only one of them is near; all are alike.
        against: The array of velocities against walls to which the fluid sticks.
    """

    total: int
    sticky: tuple[bool, ...] | None
    alone: bool = False
    against: str = "v"

    @property
    def places(self) -> int:
        """How many it looks at."""
        return 1 if self.alone else self.total

    @property
    def sets(self) -> list[tuple[int, ...]]:
        """Every set of these that makes an image."""
        sizes = range(1, self.places + 1)
        return [each for size in sizes for each in itertools.combinations(range(self.places), size)]

    def read(self, *names: str) -> list[str]:
        """Source that reads such an array of both particles of a pair.

        Of one that is alone by its scalar product with what is 1 in its place and else 0, which the
        vector units take as it is. It is the nearest to a particle that has any within reach.
        """
        if not self.alone:
            return [f"{n[0]}_{i} = read(d.{n[2:]}, {i})" for n in names for i in "ij"]
        lines = [f"{n[0]}_{i} = one(wp.dot(read(d.{n[2:]}, {i}), M))" for n in names for i in "ij"]
        return ["M = nearest(read(d.wall, i))", *lines]


@functools.cache
def nearest_function(precision: Precision, total: int) -> wp.Function:
    """``nearest(D)``: 1 where D is least, else 0."""
    each, real = precision.vector(total), precision.scalar

    def nearest(D: each):
        M = each()
        least = wp.min(D)
        for a in range(wp.static(total)):
            M[a] = wp.where(D[a] <= least, real(1.0), real(0.0))
        return M

    return function(nearest)
