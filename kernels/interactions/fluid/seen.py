"""Which walls a term over images looks at, and how it reads of them."""

import functools
import itertools
from typing import NamedTuple

import warp as wp

from ...engine.loops import reader
from ...precision import Precision, native
from ...warp_internals import elements, vector


class Seen(NamedTuple):
    """Which walls a term looks at.

    Args:
        total: Places of walls in the arrays.
        sticky: By place, whether the fluid sticks there; None: the approach does not count.
        alone: Only one of them is near, that in ``alone`` of the slot; all are alike.
    """

    total: int
    sticky: tuple[bool, ...] | None
    alone: bool = False

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
        """Source that reads such an array of both particles of a pair."""
        k = ", k" if self.alone else ""
        lines = [f"{n[0]}_{i} = read(d.{n[2:]}, {i}{k})" for n in names for i in "ij"]
        return ["k = d.alone[i]", *lines] if self.alone else lines

    def reader(self, precision: Precision) -> wp.Function:
        """What that reads by."""
        return one_reader(precision, self.total) if self.alone else reader(precision, self.total)


@functools.cache
def one_reader(precision: Precision, width: int) -> wp.Function:
    """``read(array, j, k)``: of vectors from an array without gaps the component k, as a vector."""
    kind, real = precision.vector(width), precision.c
    snippet = f"""
    const {real}* data = {elements("array", real)};
    return {vector(1, real)}(data[{width} * (long long)j + k]);
"""
    one = precision.vector(1)

    def read(array: wp.array(dtype=kind), j: int, k: int) -> one: ...

    return native(read, snippet, after_gradients=False)
