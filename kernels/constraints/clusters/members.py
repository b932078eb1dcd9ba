"""Clusters of particles as kernels take them: in chunks of members, sorted by colour."""

import functools
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import warp as wp

from ...engine.integrate import widened
from ...engine.loops import Periodicity, box_type
from ...precision import Precision, function, structure
from ..constraints import bodies_type, rounding_function

double = wp.float64


@wp.struct
class Moments:
    """Sums over members, m their weight, r where they are and p where they were."""

    r: wp.vec3d  # of m r
    p: wp.vec3d  # of m p
    A: wp.mat33d  # of m r q^T
    P: wp.mat33d  # of m p q^T
    spin: wp.vec3d  # of m p x r


@dataclass(frozen=True)
class Form:
    """What kernels of clusters are made for."""

    precision: Precision
    periodic: Periodicity
    compensated: bool
    plastic: bool
    breakable: bool


@functools.cache
def clusters_type(precision: Precision) -> Any:
    """Clusters in chunks of members, sorted by colour."""
    arrays = {
        # of members
        "particle": wp.int32,
        "rest": wp.vec3d,  # q, from the centre of mass
        "weight": wp.float64,
        "shift": precision.vec3,  # what this substep's projection has moved it by
        # of chunks
        "begin": wp.int32,  # first member; one more entry at the end
        "cluster": wp.int32,
        "moments": Moments,
        # of clusters
        "chunk": wp.int32,  # first chunk; one more entry at the end
        "world": wp.int32,
        "total": wp.float64,  # weight
        "size": wp.float64,  # sum m q^2 of those not pinned
        "bias": wp.vec3d,  # sum m q, which is 0 but for rounding
        "softness": wp.float64,  # compliance times mean mass [time^2]
        "limit": wp.float64,  # break_force
        "broken": wp.int32,
        "turn": wp.quatd,  # all 0: not known yet
        "strain": wp.mat33d,  # of the rest shape, plastic: q = (1 + strain) q_0
        "origin": wp.vec3d,  # about the centre, at the sums
        "centre": wp.vec3d,  # of the goals, from there
        "goal": wp.mat33d,  # from q_0 to the goal, from the centre
        "torque": wp.vec3d,  # sum m p x dx that this substep lacks
    }
    fields = {name: wp.array(dtype=kind) for name, kind in arrays.items()}
    return structure(f"Clusters_{precision.name}", fields)


def types(form: Form) -> tuple[Any, Any, Any]:
    """Of clusters, bodies and the boxes of all worlds."""
    precision = form.precision
    box = wp.array(dtype=box_type(precision))
    return clusters_type(precision), bodies_type(precision), box


@functools.cache
def views(form: Form) -> SimpleNamespace:
    """How members are seen.

    - ``seen(i, k, origin, box, c, b)``: particle i from the origin of cluster k, its nearest image;
    - ``rotation(k, c)``: as it was found last, at first none;
    - ``middle(k, c, b)``: about the centre of cluster k, where sums are small, and rounding too;
    - ``shape(k, c)``: from q_0 to q;
    - ``softness(k, inverse_dt, c)``: alpha~ = alpha / dt^2, and ``gone(k, c)``: it is broken.
    """
    Clusters, Bodies, Boxes = types(form)
    wide, kept = widened(form.precision), rounding_function(form.precision, form.compensated)
    wraps, plastic, breakable = bool(form.periodic), form.plastic, form.breakable

    def exact(i: int, b: Bodies):
        return wide(b.x[i]) + wide(kept(i, b))

    exact = function(exact)

    def seen(i: int, k: int, origin: wp.vec3d, box: Boxes, c: Clusters, b: Bodies):
        r = exact(i, b) - origin
        if wp.static(wraps):
            B = box[c.world[k]]
            for a in range(3):
                r[a] = r[a] - double(B.length[a]) * wp.rint(r[a] * double(B.inverse[a]))
        return r

    def shape(k: int, c: Clusters):
        if wp.static(plastic):
            return wp.identity(n=3, dtype=double) + c.strain[k]
        else:
            return wp.identity(n=3, dtype=double)

    shape = function(shape)

    def rotation(k: int, c: Clusters):
        R = wp.identity(n=3, dtype=double)
        if wp.length_sq(c.turn[k]) > double(0.5):
            R = wp.quat_to_matrix(c.turn[k])
        return R

    rotation = function(rotation)

    def middle(k: int, c: Clusters, b: Bodies):
        e = c.begin[c.chunk[k]]
        return exact(c.particle[e], b) - rotation(k, c) * shape(k, c) * c.rest[e]

    def softness(k: int, inverse_dt: wp.float64, c: Clusters):
        return c.softness[k] * inverse_dt * inverse_dt

    def gone(k: int, c: Clusters):
        if wp.static(breakable):
            return c.broken[k] != 0
        else:
            return False

    return SimpleNamespace(
        wide=wide, kept=kept, seen=function(seen), shape=shape, middle=function(middle),
        softness=function(softness), gone=function(gone), rotation=rotation,
    )  # fmt: skip
