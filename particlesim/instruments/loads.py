"""Loads: what particles exert on a boundary, as a force and as a torque."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from .. import validate
from ..engine.loop import Loop
from ..scene.part import Interaction


def force_on(loop: Loop, bound: Any) -> np.ndarray:
    """The sum of what is exerted on a boundary, (worlds, 3)."""
    return _summed(loop, loads(loop, bound))


def torque_on(loop: Loop, bound: Any) -> np.ndarray:
    """The same of its moments about where the pivot is, (worlds, 3)."""
    model = loop.model
    if any(model.periodic):
        raise validate.fail(
            "Simulation.torque", "scene", "be open along all axes, as moments need one place each",
            list(model.periodic), "sum forces instead",
        )  # fmt: skip
    time = loop.get("time") if "time" in loop.state else np.zeros(model.world_count)
    pivots = np.zeros((model.world_count, 3))
    for w, peer in enumerate(bound.peers):
        shift, turn = peer.pose(float(time[w]))
        pivots[w] = turn @ peer._pivot() + shift
    x = loop.get("position")
    moments = (
        (rows, np.cross(x[rows] - pivots[model.world_of[rows]], f))
        for rows, f in loads(loop, bound)
    )
    return _summed(loop, moments)


def loads(loop: Loop, bound: Any) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """What each particle exerts on a boundary: rows of the arrays, and forces, (k, 3).

    Those that touch it, and those of fluids, which see their images in it.
    """
    yield bound.exerted()
    fluids = [each for each in loop.interactions if type(each).presses is not Interaction.presses]
    if fluids:
        loop.know_forces()
    for fluid in fluids:
        pressed = fluid.presses(bound)
        if pressed is not None:
            yield pressed


def _summed(loop: Loop, parts: Any) -> np.ndarray:
    """Sums of rows by world, (worlds, 3)."""
    found = np.zeros((loop.model.world_count, 3))
    for rows, values in parts:
        world = loop.model.world_of[rows]
        for axis in range(3):
            found[:, axis] += np.bincount(world, values[:, axis], len(found))
    return found
