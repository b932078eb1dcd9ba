"""Shape matching: each cluster is drawn to its rest shape, turned as fits its angular momentum.

A cluster is taken in chunks of members: their sums, then the rotation, then the members' ways.
Sums are in float64 and always of the same chunks, so that who does them does not matter. Places
are seen from about the cluster's centre.
"""

import functools
from types import SimpleNamespace

import warp as wp

from ...precision import function, register
from ..constraints import place_function
from .members import Form, Moments, types, views
from .rotation import axial, best_turn, turn_towards

double = wp.float64


def add_up_function(form: Form) -> wp.Function:
    """``add_up(n, dt, timed, box, c, b)``: the sums of chunk n.

    Where no time passes, ``timed`` 0, members were where they are.
    """
    Clusters, Bodies, Boxes = types(form)
    own = views(form)
    wide, seen, middle = own.wide, own.seen, own.middle

    def add_up(
        n: int, dt: wp.float64, timed: wp.float64, box: Boxes, c: Clusters, b: Bodies
    ):  # fmt: skip
        k = c.cluster[n]
        i_0 = c.particle[c.begin[c.chunk[k]]]
        origin = middle(k, c, b)
        way_0 = wide(b.v[i_0]) * dt + wide(b.correction[i_0])
        s = Moments()
        for e in range(c.begin[n], c.begin[n + 1]):
            i = c.particle[e]
            m = c.weight[e]
            q = c.rest[e]
            r = seen(i, k, origin, box, c, b)
            # x - x_prev is v dt plus the corrections so far, which does not cancel.
            p = r - timed * (wide(b.v[i]) * dt + wide(b.correction[i]) - way_0)
            s.r += m * r
            s.p += m * p
            s.A += m * wp.outer(r, q)
            s.P += m * wp.outer(p, q)
            s.spin += m * wp.cross(p, r)
        c.moments[n] = s

    return function(add_up)


def match_function(form: Form) -> wp.Function:
    """``match(k, fresh, alpha, c, b)``: the goal of cluster k, at the centre of mass, turned so
    that no torque is needed.
    """
    Clusters, Bodies, _ = types(form)
    own = views(form)
    shape_of, middle, rotation = own.shape, own.middle, own.rotation

    def match(k: int, fresh: int, alpha: wp.float64, c: Clusters, b: Bodies):
        s = Moments()
        for n in range(c.chunk[k], c.chunk[k + 1]):
            one = c.moments[n]
            s.r += one.r
            s.p += one.p
            s.A += one.A
            s.P += one.P
            s.spin += one.spin
        c.origin[k] = middle(k, c, b)
        shape = shape_of(k, c)
        q = c.turn[k]
        # Else a rounded rest shape would push the cluster on in every substep.
        centre = (s.r - rotation(k, c) * shape * c.bias[k]) / c.total[k]
        c.centre[k] = centre
        c.goal[k] = shape
        size = c.size[k]
        if size > double(0.0):
            to_shape = wp.transpose(shape) / size
            P = s.P * to_shape
            spin = (s.spin - wp.cross(s.p, centre)) / size
            rest = wp.vec3d()
            found = bool(False)
            if wp.length_sq(q) > double(0.5):
                q, rest, found = turn_towards(q, P, spin)
            if not found:
                best = best_turn(s.A * to_shape)
                q, rest, found = turn_towards(best, P, spin)
                if not found:  # it turns too far in a substep, or is bent too far
                    q = best
                    rest = spin - axial(wp.quat_to_matrix(q) * wp.transpose(P))
            c.turn[k] = q
            c.goal[k] = wp.quat_to_matrix(q) * shape
            lack = rest * size
            if fresh == 0:
                lack = lack + c.torque[k]
            c.torque[k] = lack / (double(1.0) + alpha)

    return function(match)


def draw_function(form: Form) -> wp.Function:
    """``draw(n, fresh, alpha, box, c, b)``: the members of chunk n go to their goals, or part of
    the way.

    d += (g - x - alpha~ d) / (1 + alpha~), d the way so far: the multiplier of XPBD.
    """
    vec3, real = form.precision.vec3, form.precision.scalar
    Clusters, Bodies, Boxes = types(form)
    own, place = views(form), place_function(form.precision, form.compensated)
    wide, seen, kept = own.wide, own.seen, own.kept

    def draw(n: int, fresh: int, alpha: wp.float64, box: Boxes, c: Clusters, b: Bodies):
        k = c.cluster[n]
        origin, centre, goal = c.origin[k], c.centre[k], c.goal[k]
        for e in range(c.begin[n], c.begin[n + 1]):
            i = c.particle[e]
            d = vec3()
            if fresh == 0:
                d = c.shift[e]
            r = seen(i, k, origin, box, c, b)
            away = centre + goal * c.rest[e] - r
            dx = vec3((away - alpha * wide(d)) / (double(1.0) + alpha))
            if b.w[i] > real(0.0):
                place(i, b.x[i], kept(i, b), dx, b)
                d = d + dx
            c.shift[e] = d

    return function(draw)


@functools.cache
def project_kernels(form: Form) -> SimpleNamespace:
    """Kernels of one projection: ``whole`` of clusters of one chunk each, else one after the other
    ``add_up`` of chunks, ``match`` of clusters and ``draw`` of chunks.
    """
    Clusters, Bodies, Boxes = types(form)
    own, add_up_chunk = views(form), add_up_function(form)
    match_cluster, draw_chunk = match_function(form), draw_function(form)

    softness, gone = own.softness, own.gone

    @register
    def project_clusters(
        first: int, start: int, fresh: int, dt: wp.float64, inverse_dt: wp.float64,
        timed: wp.float64, box: Boxes, c: Clusters, b: Bodies,
    ):  # fmt: skip
        k = start + first + wp.tid()
        if not gone(k, c):
            alpha = softness(k, inverse_dt, c)
            n = c.chunk[k]
            add_up_chunk(n, dt, timed, box, c, b)
            match_cluster(k, fresh, alpha, c, b)
            draw_chunk(n, fresh, alpha, box, c, b)

    @register
    def add_up_chunks(
        first: int, start: int, dt: wp.float64, timed: wp.float64, box: Boxes, c: Clusters,
        b: Bodies,
    ):  # fmt: skip
        add_up_chunk(start + first + wp.tid(), dt, timed, box, c, b)

    @register
    def match_clusters(
        first: int, start: int, fresh: int, inverse_dt: wp.float64, c: Clusters, b: Bodies
    ):
        k = start + first + wp.tid()
        match_cluster(k, fresh, softness(k, inverse_dt, c), c, b)

    @register
    def draw_chunks(
        first: int, start: int, fresh: int, inverse_dt: wp.float64, box: Boxes, c: Clusters,
        b: Bodies,
    ):  # fmt: skip
        n = start + first + wp.tid()
        k = c.cluster[n]
        if not gone(k, c):
            draw_chunk(n, fresh, softness(k, inverse_dt, c), box, c, b)

    return SimpleNamespace(
        whole=project_clusters, add_up=add_up_chunks, match=match_clusters, draw=draw_chunks
    )
