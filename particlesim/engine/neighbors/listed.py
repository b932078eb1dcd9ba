"""Who is listed for a particle, as its list stands."""

from __future__ import annotations

from typing import Any

import numpy as np


def neighbors_of(pairs_list: Any, particle: int) -> np.ndarray:
    """Particles listed for one: all within the cutoff, and some in the skin.

    Args:
        pairs_list: A ``VerletList``.
        particle: Its row.
    """
    order, pairs = pairs_list.order.numpy(), pairs_list.pairs
    slot = int(np.nonzero(order == particle)[0][0])
    cluster = pairs.cluster.numpy()[slot]
    entries = np.arange(pairs.count.numpy()[cluster])
    rows = pairs.row.numpy()[cluster] + entries * pairs.entry_stride
    listed = pairs_list.index.numpy()[rows]
    return order[listed[_within(pairs_list, slot, listed)]]


def _within(found: Any, slot: int, others: np.ndarray) -> np.ndarray:
    """Which of these slots are within the reach of one; a cluster's row has some beyond it."""
    members, of = found.members.numpy(), found.struct.of.numpy()
    x = np.zeros((found.model.particle_count, 3))
    x[members] = found.x_listed.numpy()
    world, order = int(found.world.numpy()[slot]), found.order.numpy()
    d = x[order[others]] - x[order[slot]]
    length = found.box.numpy()["length"][world].astype(np.float64)
    d -= np.where(length > 0, length * np.round(d / np.where(length > 0, length, 1.0)), 0.0)
    first = found.struct.first.numpy()[world]
    if found.own is None:
        reach = found.blocks[of[slot]].cutoff[of[others] - first]
    else:
        each = found.own.reach.numpy().astype(np.float64)
        reach = np.maximum(each[order[slot]], each[order[others]])
    reach = reach + found.skin.thickness[world]
    return (others != slot) & ((d**2).sum(axis=1) < reach**2)
