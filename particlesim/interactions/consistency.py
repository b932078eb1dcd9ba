"""Whether laws fit what they are used for: a potential its force, a force its periodic box."""

from __future__ import annotations

from typing import Any

import numpy as np
import warp as wp

from .trial import of_pairs, quantity, values

TRIES = 32  # particles, or pairs, that a law is asked of
AWAY = 0.1  # of the scene's size: how far from the particles a potential is asked, too
STEP = 1e-6  # of a length, for differences in double precision
OFF = 1e-3  # of the largest force: more than rounding of differences, and a jump that is told


def belongs(part: Any) -> str:
    """What is to be said of the potential of a ``ParticleForce`` that is not its force's; or "".

    f = -dU/dx is tried near the particles there are. Nothing is said of laws of the velocity or of
    the time, whose forces may well do work beside that of a potential.
    """
    if part.law is None or part.potential is None:
        return ""
    force, potential = part.arguments
    named = {name for each in (force, potential) for _, name in each.sources}
    if named & {"velocity", "time"} or "position" not in named or not part.count:
        return ""
    model, rng = part.model, np.random.default_rng(0)
    rows = rng.choice(part.members.numpy(), TRIES)
    start = model.column("position")
    size = float(np.ptp(start, axis=0).max()) or float(np.abs(start).max()) or 1.0
    x = start[rows] + AWAY * size * rng.uniform(-1.0, 1.0, (TRIES, 3))

    def asked(each: Any, x: np.ndarray, returns: Any) -> np.ndarray:
        columns = {
            name: x if source == "position" else quantity(model, rows, source)
            for name, (kind, source) in zip(each.names, each.sources, strict=True)
            if kind != "parameter"
        }
        return values(each, columns, returns, TRIES)

    f = asked(force, x, wp.vec3d)
    slope = np.stack(
        [
            asked(potential, x + side, wp.float64) - asked(potential, x - side, wp.float64)
            for side in STEP * size * np.eye(3)
        ],
        axis=1,
    ) / (2.0 * STEP * size)
    known = np.isfinite(f).all(axis=1) & np.isfinite(slope).all(axis=1)
    if not known.any():
        return ""
    off = np.linalg.norm(f + slope, axis=1)[known]
    scale = max(np.linalg.norm(each[known], axis=1).max() for each in (f, slope))
    if not off.max() > OFF * scale:
        return ""
    return (
        f"{part.name}: potential {part.potential.name} must be that of the force {part.law.name}, "
        f"f = -dU/dx, got a difference of {off.max() / scale:.2g} of the force; leave the law of "
        "the force out, which is then derived, or the potential."
    )


def fades(part: Any) -> str:
    """What is to be said of a pair force without a cutoff that reaches across half a periodic box,
    where it jumps from one image to the next; or "".
    """
    model, members = part.model, np.unique(part.pairs.members_host)
    if part.cutoff is not None or not bool(model.periodic) or len(members) < 2:
        return ""
    rng = np.random.default_rng(0)
    couples = rng.choice(members, (TRIES, 2))
    half = 0.5 * model.box_length[model.box_length > 0].min()
    near = half / len(members) ** (1.0 / 3.0)
    arguments = part.arguments[-1]
    pairs = {name: quantity(model, couples.ravel(), name) for name in arguments.quantities}
    pairs = {name: each.reshape(TRIES, 2, *each.shape[1:]) for name, each in pairs.items()}

    def force(r: float) -> float:
        if part.force is not None:
            f = of_pairs(arguments, np.full(TRIES, r), pairs)
        else:
            ahead, behind = (
                of_pairs(arguments, np.full(TRIES, r * (1.0 + way * STEP)), pairs)
                for way in (1, -1)
            )
            f = (ahead - behind) / (2.0 * STEP * r)
        return float(np.abs(f[np.isfinite(f)]).max(initial=0.0))

    there, here = force(half), force(near)
    if not there > OFF * here:
        return ""
    return (
        f"{part.name}: periodic must be so long that a force without a cutoff has faded at half of "
        f"it, where it jumps to the nearest image, got {there / here if here else 1.0:.2g} of the "
        f"force at {near:.3g} left at {half:.3g}; lengthen the box, leave its axes open, or give a "
        "law with a cutoff."
    )
