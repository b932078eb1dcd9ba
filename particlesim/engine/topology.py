"""Tuples of particles that belong together: checks, batching and bookkeeping of bonds."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import Any

import numpy as np

from .. import validate
from .model import Model

# What parts call the particles that they hold: bonds, and constraints.
BONDS, HELD = ("pairs", "triples", "quadruples"), "particles"


def tuples(owner: str, argument: str, value: Any, arity: int | None) -> np.ndarray:
    """``value`` as (m, arity) particle indices, distinct within a row."""
    index = np.asarray(value)
    if index.size == 0:
        return np.zeros((0, arity or 2), dtype=np.int64)
    if index.ndim == 1 and arity == 1:
        index = index[:, None]
    wrong = index.ndim != 2 or not np.issubdtype(index.dtype, np.integer)
    if wrong or (arity is not None and index.shape[1] != arity):
        raise validate.fail(
            owner, argument, f"have shape (m, {arity or 'k'}) of indices", index,
            "give one row of particle indices each",
        )  # fmt: skip
    if index.min() < 0:
        raise validate.fail(
            owner, argument, "hold indices from 0 up", int(index.min()), "count from 0"
        )
    ordered = np.sort(index, axis=1)
    same = (ordered[:, 1:] == ordered[:, :-1]).any(axis=1)
    if same.any():
        at = int(np.argmax(same))
        raise validate.fail(
            owner, f"{argument}[{at}]", "name different particles", index[at].tolist(),
            "leave the row out",
        )  # fmt: skip
    check_once(owner, argument, ordered if index.shape[1] == 2 else index)
    return index.astype(np.int64)


def check_once(owner: str, argument: str, index: np.ndarray) -> None:
    """Refuse rows that are there twice, as the edges of triangles are: they would count twice."""
    once, first, count = np.unique(index, axis=0, return_index=True, return_counts=True)
    if len(once) < len(index):
        twice = int(np.argmax(count > 1))
        raise validate.fail(
            owner, argument, f"hold each of its {len(once)} different rows once",
            f"{once[twice].tolist()} {count[twice]} times, first in row {first[twice]}",
            "take np.unique of the sorted rows, or add a second part for what is there twice",
        )  # fmt: skip


def merged(owner: str, argument: str, model: Model, each: Sequence[np.ndarray]) -> np.ndarray:
    """Tuples of all worlds as rows of the state's arrays."""
    parts = []
    for w, index in enumerate(each):
        count = model.scenes[w].particle_count
        if index.size and index.max() >= count:
            raise validate.fail(
                owner, argument, f"hold indices from 0 to {count - 1}", int(index.max()),
                "index the scene's particles",
            )  # fmt: skip
        parts.append(index + model.offsets[w])
    return np.concatenate(parts)


def per_item(owner: str, argument: str, value: Any, count: int, *, minimum: float) -> np.ndarray:
    """One value an item, of at least ``minimum``."""
    result = validate.rows(owner, argument, value, count, None)
    if result.size and result.min() < minimum:
        at = int(np.argmin(result))
        raise validate.fail(
            owner, f"{argument}[{at}]", f"be at least {minimum:g}", float(result[at]),
            "give a larger one",
        )  # fmt: skip
    return result


def limits(owner: str, argument: str, value: Any, count: int) -> np.ndarray:
    """One force an item beyond which it breaks, above 0."""
    limit = per_item(owner, argument, value, count, minimum=0)
    if limit.size and not limit.min() > 0:
        raise validate.fail(
            owner, f"{argument}[{int(np.argmin(limit))}]", "be above 0 [force]",
            float(limit.min()), "leave out what should not be there",
        )  # fmt: skip
    return limit


def incidence(index: np.ndarray) -> dict[str, np.ndarray]:
    """The tuples of every particle that is in one: row k is that of ``particle[k]``, and holds
    the entries ``begin[k]`` to ``begin[k + 1] - 1`` of ``tuple``, and of ``seat``, its place there.
    """
    size = index.shape[1]
    ends = index.reshape(-1)
    order = np.argsort(ends, kind="stable")
    particle, begin = np.unique(ends[order], return_index=True)
    return {
        "particle": particle,
        "begin": np.append(begin, len(ends)),
        "tuple": order // size,
        "seat": order % size,
    }


def rest_lengths(
    owner: str, model: Model, w: int, pairs: np.ndarray, given: np.ndarray | None,
    argument: str = "rest_length",
) -> np.ndarray:  # fmt: skip
    """Rest lengths of the pairs of world w, (m,): as given, or the distances at the start.

    Distances are those to the nearest image, and along an axis none is further than half a box.

    Raises:
        ValueError: A length of more than half a box: turned along the axis its ends would see each
            other on the wrong side. Lengths whose squares leave the kernels' precision.
    """
    start = steps(model, w, pairs)[:, 0]
    result = start if given is None else given
    model.squares_fit(owner, argument, np.maximum(start, result))
    for axis, on in enumerate(model.periodic):
        half = 0.5 * model.box_length[w, axis]
        if on and len(result) and result.max() > half * (1 + 1e-9):
            at = int(np.argmax(result))
            raise validate.fail(
                owner, f"{argument}[{at}]",
                f"be at most half the periodic length along {'xyz'[axis]}, {half:g} [length]",
                float(result[at]), "enlarge the box, or put particles between",
            )  # fmt: skip
    return result


def pieces(model: Model, w: int, index: np.ndarray) -> np.ndarray:
    """Positions at the start, (m, k, 3) [length], each seen from the first of its tuple.

    In a periodic scene each is the image next to the one before it.
    """
    places = np.cumsum(_ways(model, w, index), axis=1)
    return np.concatenate([np.zeros((len(index), 1, 3)), places], axis=1)


def steps(model: Model, w: int, index: np.ndarray) -> np.ndarray:
    """Distances at the start from each particle of a tuple to the next, (m, k - 1) [length]."""
    return np.linalg.norm(_ways(model, w, index), axis=2)


def _ways(model: Model, w: int, index: np.ndarray) -> np.ndarray:
    """From each particle of a tuple to the next, (m, k - 1, 3) [length], to the nearest image."""
    return nearest(np.diff(model.scenes[w].position[index], axis=1), model.box_length[w])


def nearest(d: np.ndarray, length: np.ndarray) -> np.ndarray:
    """Distances (..., 3) to the nearest image, in a box of these lengths, 0 along open axes."""
    return d - length * np.round(np.divide(d, length, out=np.zeros_like(d), where=length > 0))


def listed(
    rows: np.ndarray, order: np.ndarray, edges: np.ndarray, bound: Any, part: Any
) -> np.ndarray:
    """Values of sorted rows, of the worlds of ``part``, in the order in which these list them.

    Args:
        rows: Row r is of number ``order[r]`` of all worlds'.
        order: Of the rows.
        edges: Where the numbers of each world begin, and end.
        bound: The part of all worlds.
        part: It, or that of some worlds' scenes.
    """
    values = np.empty_like(rows)
    values[order] = rows
    mine = [w for w, peer in enumerate(bound.peers) if part is bound or part is peer]
    return np.concatenate([values[edges[w] : edges[w + 1]] for w in mine])


def colors(index: Sequence[np.ndarray] | np.ndarray) -> np.ndarray:
    """A colour for each tuple, of any length, so that those of one colour share no particle
    (greedy).

    Tuples take the lowest colour that none of their particles has yet, in order; worlds do not
    share particles, so a world's colours are what they are alone.
    """
    used: dict[int, int] = {}
    result = np.zeros(len(index), dtype=np.int32)
    for row, each in enumerate(index):
        particles, taken = each.tolist(), 0
        for particle in particles:
            taken |= used.get(particle, 0)
        free = ~taken & (taken + 1)
        result[row] = free.bit_length() - 1
        for particle in particles:
            used[particle] = used.get(particle, 0) | free
    return result


def excluded(owner: str, exclude: Any) -> np.ndarray:
    """Pairs that do not feel each other, (m, 2): given, or held together by parts.

    Of a bond they are its ends, of a tuple of a constraint all that are in it.
    """
    given = [] if exclude is None else exclude
    several = isinstance(given, Sequence) and all(_holds(each) for each in given)
    found = [np.zeros((0, 2), dtype=np.int64)]
    for each in given if several else [given]:
        name = next((name for name in BONDS if hasattr(each, name)), None)
        if hasattr(each, HELD):
            rows = getattr(each, HELD)
            seats = itertools.combinations(range(rows.shape[1]), 2)
            found += [rows[:, list(two)] for two in seats]
            continue
        # Of more than two those at the ends: who is between is held by bonds.
        pairs = each if name is None else np.asarray(getattr(each, name))[:, [0, -1]]
        found.append(tuples(owner, "exclude", pairs, 2))
    return np.concatenate(found)


def _holds(value: Any) -> bool:
    """It is a part that holds tuples, or pairs by themselves."""
    return any(hasattr(value, name) for name in (*BONDS, HELD)) or np.ndim(value) == 2


def partners(model: Model, pairs: np.ndarray) -> np.ndarray:
    """By particle its partners in these pairs, (n, most); -1 where there are fewer."""
    both = np.unique(np.concatenate([pairs, pairs[:, ::-1]]), axis=0)
    count = np.bincount(both[:, 0], minlength=model.particle_count)
    rows = np.full((model.particle_count, int(count.max(initial=0))), -1)
    begin = np.cumsum(count) - count
    rows[both[:, 0], np.arange(len(both)) - begin[both[:, 0]]] = both[:, 1]
    return rows
