"""Blocks: the slots of a list by world and, where its particles differ much in size, by size.

A pair is looked for within what its two blocks reach together. With one block for all, a single
large particle has every small one look as far as two large ones would.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import warp as wp

from ...kernels.engine.neighbors.rows import blocks_type
from ..model import Model

LESS = 4.0  # times fewer candidates, from which blocks by size pay
MOST = 8  # sizes of a world; those from a 128th of the largest down are one
FEW = 64  # particles that may well look at each other all


@dataclass(frozen=True)
class Block:
    """Slots of one world from ``begin`` to ``end - 1``, and how far they look.

    ``cutoff`` is, for each block of the world in turn, that of a pair with one of it; ``own`` that
    of two of this block, or enough of the largest for cells of that width. ``largest`` is half the
    cutoff of its largest.
    """

    world: int
    begin: int
    end: int
    cutoff: np.ndarray
    own: float
    largest: float

    @property
    def count(self) -> int:
        """Its slots."""
        return self.end - self.begin


def _octaves(half: np.ndarray) -> np.ndarray:
    """By how many halvings each is smaller than the largest."""
    with np.errstate(divide="ignore"):
        return np.clip(np.floor(np.log2(half.max() / half)), 0, MOST - 1).astype(int)


def _largest(half: np.ndarray, octave: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The octaves that there are, how many are in each, and the largest of each."""
    kinds, kind, count = np.unique(octave, return_inverse=True, return_counts=True)
    largest = np.zeros(len(kinds))
    np.maximum.at(largest, kind, half)
    return kinds, count, largest


def by_size(half: np.ndarray) -> bool:
    """Whether blocks by size pay for the particles of one world.

    Args:
        half: Half the distance within which each looks for its like, (n,).
    """
    if len(half) <= FEW or not half.max() > 0:
        return False
    _, count, largest = _largest(half, _octaves(half))
    candidates = count @ (largest[:, None] + largest) ** 3 @ count
    return bool(len(half) ** 2 * (2 * half.max()) ** 3 > LESS * candidates)


def blocks(
    begin: np.ndarray, end: np.ndarray, cutoff: np.ndarray, half: list[np.ndarray | None]
) -> Iterator[tuple[np.ndarray, list[Block], float]]:
    """World by world: its members in the order of their slots, its blocks, and most's own cutoff.

    Args:
        begin: First slot of each world, (worlds,). end: Its last slot + 1.
        cutoff: Of each world, 0 where nothing is looked for.
        half: Of each world in blocks by size half the cutoff of its members, else None.
    """
    for w, (a, b) in enumerate(zip(begin, end, strict=True)):
        sizes = half[w]
        if sizes is None:
            looked = float(cutoff[w]) if cutoff[w] > 0 else np.inf
            whole = Block(w, int(a), int(b), np.array([looked]), looked, float(cutoff[w] / 2))
            yield np.arange(a, b), [whole], float(cutoff[w])
            continue
        octave = _octaves(sizes)
        _, count, largest = _largest(sizes, octave)
        edges = a + np.concatenate([[0], np.cumsum(count)])
        pairs = largest[:, None] + largest
        own = np.maximum(pairs.diagonal(), pairs.max() / 2**MOST)
        cut = [
            Block(w, int(edges[k]), int(edges[k + 1]), pairs[k], float(own[k]), float(largest[k]))
            for k in range(len(count))
        ]
        # Those that are most are renewed most.
        most = float(cutoff[w] * largest[count.argmax()] / largest.max())
        yield a + np.argsort(octave, kind="stable"), cut, most


def blocks_struct(model: Model, of_worlds: Sequence[Sequence[Block]]) -> Any:
    """The blocks of all worlds as kernels take them; the room in their rows is still to be set."""
    every = [block for each in of_worlds for block in each]
    counts = [block.count for block in every]
    cutoff = np.zeros((len(every), max(map(len, of_worlds))))
    for k, block in enumerate(every):
        cutoff[k, : len(block.cutoff)] = block.cutoff
    struct = blocks_type(model.precision)()
    struct.of = model.array(np.repeat(np.arange(len(every)), counts), wp.int32)
    struct.begin = model.array([block.begin for block in every], wp.int32)
    struct.end = model.array([block.end for block in every], wp.int32)
    struct.first = model.array(np.cumsum([0, *map(len, of_worlds)]), wp.int32)
    struct.cutoff = model.array(cutoff, wp.float64)
    struct.reach_squared = model.array(cutoff**2, model.precision.scalar)
    return struct
