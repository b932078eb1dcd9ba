"""Audit: has an energy that has grown a cause, or is it an artefact of the step?

What the laws of a scene do does not depend on the substep. So the frame is done again with two and
with four times the substeps, and the largest speeds of each world are compared: they agree where a
spring is let go, a charge falls or a user's force pushes, and differ where the step is past its
stability limit (each substep then multiplies the velocity) or where a force was met for one substep
that no finer path meets (the speed is then in proportion to the substep).
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from ...engine.frames import Frames

REFINEMENTS = (1, 2, 4)
AGREE = np.sqrt(2.0)  # ratio of speeds, that is a factor of two in energy


def causes(frames: Frames, worlds: Iterable[int], substeps: int) -> dict[int, float]:
    """The largest speed of each of these worlds that has a cause; others are left out.

    Starts from the last good frame, and leaves the state of its end after ``substeps``.
    """
    peaks = []
    for refinement in REFINEMENTS:
        frames.snapshot.restore()
        peak = frames.peaks(refinement * substeps)
        peaks.append([_largest(peak, frames.loop.model.rows(w)) for w in worlds])
    frames.snapshot.restore()
    frames.run(substeps)
    return {
        w: float(max(speeds))
        for w, speeds in zip(worlds, np.transpose(peaks), strict=True)
        if np.isfinite(speeds).all() and max(speeds) <= AGREE * min(speeds)
    }


def _largest(peak: np.ndarray, rows: slice) -> float:
    mine = peak[rows]
    return float(mine.max()) if np.isfinite(mine).all() else np.inf
