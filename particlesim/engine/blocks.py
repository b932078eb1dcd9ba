"""Blocks of rows that one thread sums: of fixed bounds, whatever threads there are."""

from __future__ import annotations

import itertools

import numpy as np


def blocks(offsets: np.ndarray, size: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Begin, end and world of the blocks; they start anew in each world.

    Args:
        offsets: (worlds + 1,), where the rows of each world begin.
        size: Rows of a block, at most.
    """
    begin, end, world = [], [], []
    for w, (start, stop) in enumerate(itertools.pairwise(offsets)):
        edges = np.arange(start, stop, size)
        begin.append(edges)
        end.append(np.minimum(edges + size, stop))
        world.append(np.full(len(edges), w))
    return np.concatenate(begin), np.concatenate(end), np.concatenate(world)
