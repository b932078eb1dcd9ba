"""Whether a law of pairs stays the same when i and j are exchanged, as Newton's third law asks."""

from __future__ import annotations

import numpy as np

from ...engine.model import Model
from .arguments import QUANTITIES, Arguments
from .trial import of_pairs, quantity

PAIRS = 16  # that are tried, beside those of the extremes
ROUNDING = 1e-6  # relative difference that a sum in another order may leave, by far


def named(arguments: Arguments) -> list[str]:
    """What a law names of the two particles, such as ``mass_i``."""
    return [
        name for name, (kind, _) in zip(arguments.names, arguments.sources, strict=True)
        if kind.startswith("quantity")
    ]  # fmt: skip


def is_symmetric(
    arguments: Arguments, model: Model, members: np.ndarray, cutoff: float | None
) -> bool:
    """Whether a law gives the same for (i, j) and for (j, i), in double precision.

    It is tried on pairs of the particles there are, and on such whose masses and other measures
    are some way off: whole numbers, such as kinds, stay as they are.

    Args:
        arguments: Of the law, the distance left out.
        model: With the scenes.
        members: Rows of the particles that it acts on.
        cutoff: Distance up to which it is asked [length]; None: at the distances there are.
    """
    if len(members) < 2 or not named(arguments):
        return True
    rng = np.random.default_rng(0)
    columns = {name: quantity(model, members, name) for name in sorted(arguments.quantities)}
    at = rng.integers(0, len(members), (PAIRS, 2))
    ends = [(each.argmin(), each.argmax()) for each in columns.values() if each.ndim == 1]
    at = np.concatenate([at, *(np.reshape(each, (1, 2)) for each in ends)])
    x = model.column("position")[members]
    r = np.linalg.norm(x[at[:, 0]] - x[at[:, 1]], axis=1)
    r = np.where(r > 0, r, 1.0) if cutoff is None else cutoff * rng.uniform(0.3, 1.0, len(at))
    there = {name: each[at] for name, each in columns.items()}
    off = {name: _off(name, each, rng) for name, each in there.items()}
    pairs = {name: np.concatenate([there[name], off[name]]) for name in columns}
    r = np.tile(r, 2)
    ours, theirs = (of_pairs(arguments, r, pairs, order=order) for order in ("ij", "ji"))
    known = np.isfinite(ours) & np.isfinite(theirs)
    ours, theirs = ours[known], theirs[known]
    return bool((np.abs(ours - theirs) <= ROUNDING * (np.abs(ours) + np.abs(theirs))).all())


def _off(name: str, pairs: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Values that differ within each pair, where they may be any number."""
    if name not in QUANTITIES and (pairs == np.round(pairs)).all():
        return pairs
    factor = rng.uniform(0.5, 2.0, pairs.shape)
    return np.where(pairs == 0.0, factor, pairs * factor)
