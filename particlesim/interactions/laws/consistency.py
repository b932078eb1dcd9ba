"""Whether laws fit what they are used for: their potential, their periodic box, their precision."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from ...engine.model import Model
from ...kernels.precision import FLOAT64
from .arguments import Arguments
from .trial import of_pairs, of_particles, quantity

TRIES = 32  # particles, or pairs, that a law is asked of
AWAY = 0.1  # of the scene's size: how far from the particles a law is asked, too
OFF = 1e-3  # of the largest force: more than rounding of two laws, and a jump that is told
# Of the largest value: more than rounding, less than a product that leaves the precision.
LOST = 1e-2
ORDINARY = 1e9  # products of four such numbers, or their inverses, are within single precision


# Of particles ------------------------------------------------------------------------------------


def of_particle_force(part: Any) -> str:
    """What is to be said of the laws of a ``ParticleForce``; empty where they fit."""
    if not part.count or any(("extra", "time") in each.sources for each in part.arguments):
        return ""
    model, rng = part.model, np.random.default_rng(0)
    rows = rng.choice(part.members.numpy(), TRIES)
    start = model.column("position")
    size = float(np.ptp(start, axis=0).max()) or float(np.abs(start).max()) or 1.0
    x = start[rows] + AWAY * size * rng.uniform(-1.0, 1.0, (TRIES, 3))
    return _of_potential(part, rows, x) or _of_particle_range(part, rows, x)


def _of_potential(part: Any, rows: np.ndarray, x: np.ndarray) -> str:
    """f = -dU/dx is tried near the particles there are.

    Nothing is said of laws of the velocity, whose force may well do work beside the potential's.
    """
    if part.law is None or part.potential is None:
        return ""
    force, potential = part.arguments
    if "velocity" in part.quantities or "position" not in potential.quantities:
        return ""
    try:
        part.potential.check_derivable(part.name)
    except ValueError:  # a law of the force is given for that
        return ""
    f = of_particles(force, part.model, rows, x)
    other = of_particles(potential, part.model, rows, x, derived=True)
    known = np.isfinite(f).all(axis=1) & np.isfinite(other).all(axis=1)
    if not known.any():
        return ""
    off = float(np.linalg.norm(f - other, axis=1)[known].max())
    scale = max(float(np.linalg.norm(each[known], axis=1).max()) for each in (f, other))
    if not off > OFF * scale:
        return ""
    return (
        f"{part.name}: potential {part.potential.name} must be that of the force {part.law.name}, "
        f"f = -dU/dx, got a difference of {off / scale:.2g} of the force; leave the law of the "
        "force out, which is then derived, or the potential."
    )


def _of_particle_range(part: Any, rows: np.ndarray, x: np.ndarray) -> str:
    arguments = part.arguments[0]
    columns = [quantity(part.model, rows, name) for name in part.quantities - {"position"}]
    if not _extraordinary(part.model, [x, *columns, *arguments.values.values()]):
        return ""
    kept, true = (
        of_particles(arguments, part.model, rows, x, derived=part.law is None, precision=each)
        for each in (part.model.precision, FLOAT64)
    )
    return _lost(part, arguments, kept, true)


# Of pairs ----------------------------------------------------------------------------------------


def of_pair_force(part: Any) -> str:
    """What is to be said of the law of a ``Pair``; empty where it fits."""
    members = np.unique(part.pairs.members_host)
    if len(members) < 2 or not part.acts:
        return ""
    model, rng = part.model, np.random.default_rng(0)
    couples = rng.choice(members, (TRIES, 2))
    names = part.arguments[-1].quantities
    pairs = {name: quantity(model, couples.ravel(), name) for name in names}
    pairs = {name: each.reshape(TRIES, 2, *each.shape[1:]) for name, each in pairs.items()}
    return _of_box(part, pairs, len(members)) or _of_pair_range(part, pairs, couples, rng)


def _of_box(part: Any, pairs: dict[str, np.ndarray], count: int) -> str:
    """A force without a cutoff jumps from one image to the next at half a periodic box."""
    lengths = part.model.box_length[part.model.box_length > 0]
    if part.cutoff is not None or not len(lengths):
        return ""
    half = 0.5 * float(lengths.min())
    near = half / count ** (1.0 / 3.0)
    arguments = part.arguments[-1]

    def force(r: float) -> float:
        f = of_pairs(arguments, np.full(TRIES, r), pairs, force=True, derived=part.force is None)
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


def is_ordinary(part: Any) -> bool:
    """Whether products of what the law of a ``Pair`` takes stay in range in any order."""
    model, arguments = part.model, part.arguments[-1]
    members = np.unique(part.pairs.members_host)
    taken = [quantity(model, members, name) for name in arguments.quantities - {"position"}]
    lengths = [each[each > 0] for each in model.apart()]
    if part.cutoff is not None:
        lengths.append(np.array([peer.cutoff for peer in part.peers]))
    return not _extraordinary(model, [*lengths, *taken, *arguments.values.values()])


def _of_pair_range(
    part: Any, pairs: dict[str, np.ndarray], couples: np.ndarray, rng: np.random.Generator
) -> str:
    model, arguments = part.model, part.arguments[-1]
    x = model.column("position")
    r = np.linalg.norm(x[couples[:, 0]] - x[couples[:, 1]], axis=1)
    r = np.where(r > 0, r, float(model.apart()[1].max())) * rng.uniform(0.7, 1.4, TRIES)
    if part.cutoff is not None:
        r = np.where(r < part.cutoff, r, part.cutoff * rng.uniform(0.5, 1.0, TRIES))
    if not r.all() or not _extraordinary(model, [r, *pairs.values(), *arguments.values.values()]):
        return ""
    kept, true = (
        of_pairs(arguments, r, pairs, force=True, derived=part.force is None, precision=each)
        for each in (model.precision, FLOAT64)
    )
    return _lost(part, arguments, kept, true)


# The precision -----------------------------------------------------------------------------------


def _extraordinary(model: Model, columns: Iterable[Any]) -> bool:
    """Whether products of some of these numbers may leave the kernels' precision."""
    if model.precision is FLOAT64:
        return False
    for column in columns:
        given = np.asarray(column, dtype=np.float64)
        # Of a vector its length, as one of its components may well be almost nothing.
        sizes = np.abs(given) if given.ndim < 2 else np.linalg.norm(given, axis=-1)
        most = sizes.max(initial=0.0)
        if most > 0 and not 1.0 / ORDINARY < most < ORDINARY:
            return True
    return False


def _lost(part: Any, arguments: Arguments, kept: np.ndarray, true: np.ndarray) -> str:
    """A law whose products leave the precision is infinite there, or nothing is left of it."""
    known = np.isfinite(true).reshape(len(true), -1).all(axis=1)
    kept, true = kept[known].ravel(), true[known].ravel()
    scale = np.abs(true).max(initial=0.0)
    with np.errstate(invalid="ignore"):
        off = np.abs(kept - true)
    wrong = ~(off <= LOST * scale)
    if not scale or not wrong.any():
        return ""
    k = int(np.argmax(np.where(wrong, np.abs(true), -1.0)))
    return (
        f"{part.name}: law {arguments.law.name} must stay within {part.model.precision.name}, "
        f"products of it too, got {kept[k]:.3g} for {true[k]:.3g}; multiply in another order, "
        "choose other units, or Settings(precision='float64')."
    )
