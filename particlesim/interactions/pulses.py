"""Pulses: what a law of time does between the times at which substeps ask for it."""

from __future__ import annotations

from typing import Any

import numpy as np
import warp as wp

from ..engine.execution.launch import launch
from ..engine.model import filled

TIMES = 2**18  # at which a law is asked
FRAMES = 100  # ahead
SEEN = 0.5  # of the largest force: what substeps must see of it
RATIO = 0.5 * (np.sqrt(5.0) - 1.0)  # times are spread by it, in step with nothing


def unseen(part: Any) -> str:
    """What is to be said of a force by a law of time that is large between substeps only.

    The first member is asked, where it is, at ``TIMES`` times of the next ``FRAMES`` frames, and at
    those of the substeps. What is shorter than a part in ``TIMES`` of that goes unseen here, too.
    """
    settings = part.model.settings
    span, count = FRAMES * settings.dt, FRAMES * settings.substeps
    if not part.count or not span > 0 or count > TIMES:
        return ""
    start = float(part.data.time.numpy()[part.world.numpy()[0]])
    spread = start + span * (np.arange(TIMES) * RATIO % 1.0)
    asked = start + span * np.arange(count) / count
    with np.errstate(invalid="ignore", over="ignore"):
        sizes = np.linalg.norm(_forces(part, np.concatenate([spread, asked])), axis=1)
    largest, met = sizes[:TIMES].max(), sizes[TIMES:].max()
    if not np.isfinite(largest) or not met < SEEN * largest:
        return ""
    k = int(np.argmax(sizes[:TIMES]))
    return (
        f"{part.name}: law {part.arguments[0].law.name} must change slowly against a substep of "
        f"{settings.substep:.3g} s, got a force of {largest:.3g} at t = {spread[k]:.6g} and none "
        f"above {met:.3g} where substeps ask for it; use more substeps, or spread it over some."
    )


def _forces(part: Any, times: np.ndarray) -> np.ndarray:
    """The force of a part on its first member at each of the times, (n, 3), by its own kernel."""
    model, n = part.model, len(times)
    member, world = int(part.members.numpy()[0]), int(part.world.numpy()[0])

    def repeated(array: wp.array, row: int) -> wp.array:
        host = array.numpy()[row]
        return wp.array(np.repeat(host[None], n, axis=0), dtype=array.dtype, device=model.device)

    names = [name for name in part.Data.vars if name != "time"]
    fields = {name: repeated(getattr(part.data, name), member) for name in names}
    fields["time"] = model.array(times, wp.float64)
    rows = model.array(np.arange(n), wp.int32)
    force = wp.zeros(n, dtype=model.precision.vec3, device=model.device)
    inputs = [rows, rows, repeated(part.params, world), filled(part.Data, fields), force]
    launch(part.kernel, n, inputs, model.device, part.block)
    return force.numpy().astype(np.float64)
