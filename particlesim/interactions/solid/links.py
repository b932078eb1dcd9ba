"""A solid as it is at rest: who is linked with whom, how strongly, and what makes strains exact."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ... import validate
from ...engine.model import Model
from ...scene.sample.arrange import links
from ..fluid.smoothing.wendland import WendlandC2

WITHIN = 1.0 - 1e-6  # of the support, where no weight is left: links do not hang on rounding
FLAT = 1e-6  # of the largest eigenvalue of M: a smaller one is rounding, of particles in a plane


@dataclass(frozen=True)
class Rest:
    """The links of one world's solid, by their first particle, in order.

    ``begin`` (n + 1,), ``other`` (m,) rows of the second; ``X`` (m, 3) from the first to the second
    [length]; ``c`` (m,) V_i V_j s with s = -W'(R) / R; ``volume`` (n,); ``inverse`` (n, 3, 3) of
    M_i = sum_j c X X^T, 0 across the plane; ``share`` of the cells of a square
    lattice, of the spacing that there is, which the volumes fill.
    """

    begin: np.ndarray
    other: np.ndarray
    X: np.ndarray
    c: np.ndarray
    volume: np.ndarray
    inverse: np.ndarray
    share: float


def at_rest(solid: Any, model: Model, w: int, members: np.ndarray) -> Rest:
    """The links of world w.

    Args:
        solid: An ``ElasticSolid`` of that world.
        model: With the scenes.
        w: The world.
        members: Rows of its particles, (n,).

    Raises:
        ValueError: Particles that coincide, that see too few others or these in a plane, or that
            reach across a periodic box.
    """
    h, d, owner = solid.parameters["smoothing_length"], solid.dimension, solid.name
    reach = WITHIN * WendlandC2.support * h
    x = model.column("position")[members]
    x, _ = model.wrapped(x, model.world_of[members], model.box_start)
    if d == 2 and len(x) and np.ptp(x[:, 2]) > FLAT * h:
        raise validate.fail(
            owner, "group", "lie in a plane of constant z in two dimensions [length]",
            float(np.ptp(x[:, 2])), "give dimension=3, or the particles one z",
        )  # fmt: skip
    pairs = _pairs(owner, model, w, x, reach)
    i, other = np.concatenate([pairs[:, ::-1], pairs]).T
    order = np.argsort(i, kind="stable")  # pairs are in order, the smaller first
    i, other = i[order], other[order]
    X = _between(model, w, x, i, other)
    R = np.linalg.norm(X, axis=1)
    if len(R) and R.min() == 0.0:
        k = int(R.argmin())
        raise validate.fail(
            owner, "group", "hold particles that are apart",
            f"particles {_named(model, w, members, [i[k], other[k]])} in one place",
            "leave one out",
        )  # fmt: skip
    nearest = np.full(len(members), np.inf)
    np.minimum.at(nearest, i, R)
    volume = _volumes(solid, model.column("mass")[members], nearest**d)
    s = -WendlandC2().derivative(R, h, d) / np.where(R > 0, R, 1.0)
    c = volume[i] * volume[other] * s
    M = np.zeros((len(members), 3, 3))
    for a, b in np.ndindex(3, 3):
        M[:, a, b] = np.bincount(i, c * X[:, a] * X[:, b], len(members))
    begin = np.searchsorted(i, np.arange(len(members) + 1))
    _check(solid, model, w, members, M, np.diff(begin))
    inverse = np.zeros_like(M)
    inverse[:, :d, :d] = np.linalg.inv(M[:, :d, :d])
    share = float(np.median(volume / nearest**d)) if len(members) else 1.0
    return Rest(begin, other, X, c, volume, inverse, share)


def _pairs(owner: str, model: Model, w: int, x: np.ndarray, reach: float) -> np.ndarray:
    """Pairs no further apart than the reach, by the nearest image in a periodic box, (m, 2)."""
    length, lower, place, row = model.box_start[w], model.box_lower[w], x, np.arange(len(x))
    for axis, on in enumerate(model.periodic):
        if on and 2.0 * reach > length[axis]:
            raise validate.fail(
                owner, "smoothing_length", f"be at most a quarter of the box, {length[axis] / 4:g} "
                "[length]", 0.5 * reach, "enlarge the box",
            )  # fmt: skip
        if on:  # what is near the lower side stands beyond the upper, too
            beyond = place[:, axis] - lower[axis] <= reach
            shift = length[axis] * np.eye(3)[axis]
            place = np.concatenate([place, place[beyond] + shift])
            row = np.concatenate([row, row[beyond]])
    found = links(place, reach)
    if len(place) == len(x):
        return found
    found = np.sort(row[found], axis=1)
    return np.unique(found[found[:, 0] < found[:, 1]], axis=0)


def _between(
    model: Model, w: int, x: np.ndarray, i: np.ndarray, other: np.ndarray
) -> np.ndarray:  # fmt: skip
    """X_j - X_i to the nearest image, as the kernels compute it in their precision."""
    real = model.precision.numpy
    place, length = x.astype(real), model.box_start[w].astype(real)
    inverse = np.divide(real(1.0), length, out=np.zeros_like(length), where=length > 0)
    d = place[other] - place[i]
    return (d - length * np.rint(d * inverse)).astype(np.float64)


def _volumes(solid: Any, mass: np.ndarray, cell: np.ndarray) -> np.ndarray:
    """m / rho_0; without a rest density that of a square lattice at the spacing that they have."""
    density = solid.parameters["rest_density"]
    if density is None:
        density = (np.median(mass / cell) if len(mass) else 0.0) or 1.0  # of nobody
    return mass / density


def _check(
    solid: Any, model: Model, w: int, members: np.ndarray, M: np.ndarray, count: np.ndarray
) -> None:  # fmt: skip
    """Every particle sees others in all directions."""
    if not len(members):
        return
    values = np.linalg.eigvalsh(M[:, : solid.dimension, : solid.dimension])
    flat = ~(values[:, 0] > FLAT * values[:, -1])
    if not flat.any():
        return
    k = int(flat.argmax())
    line = "line" if solid.dimension == 2 else "plane"
    raise validate.fail(
        solid.name, "smoothing_length", "reach particles in all directions around each [length]",
        f"{solid.parameters['smoothing_length']:g}, within two of which particle "
        f"{_named(model, w, members, [k])[0]} has {count[k]} others, none or all in a {line}",
        "give about 1.5 spacings, a body of two layers or more, or another dimension",
    )  # fmt: skip


def _named(model: Model, w: int, members: np.ndarray, rows: Any) -> list[int]:
    """Particles as the scene counts them."""
    return (members[rows] - model.offsets[w]).tolist()
