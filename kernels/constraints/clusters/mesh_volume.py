"""The volume that closed meshes enclose: its gradient and sums, and what follows."""

import functools

import warp as wp

from ...precision import register
from ..constraints import place_function
from .members import Form, types, views

double = wp.float64


@wp.struct
class Volumes:
    """Closed meshes, whose vertices are the members of clusters."""

    # of members: their triangles, seen from them
    face: wp.array(dtype=wp.int32)  # first one; one more entry at the end
    slope: wp.array(dtype=wp.vec3d)  # gradient of the volume where members were
    # of triangles of members: the two other corners, in turn
    left: wp.array(dtype=wp.int32)
    right: wp.array(dtype=wp.int32)
    # of chunks: 3 V, and sum w grad V(x) . grad V(x_prev)
    sums: wp.array(dtype=wp.vec2d)
    # of meshes
    target: wp.array(dtype=wp.float64)
    compliance: wp.array(dtype=wp.float64)
    limit: wp.array(dtype=wp.float64)  # burst_pressure
    broken: wp.array(dtype=wp.int32)
    lam: wp.array(dtype=wp.float64)
    step: wp.array(dtype=wp.float64)  # by how much lam has just grown


@functools.cache
def add_up_kernel(form: Form) -> wp.Kernel:
    """Kernel: gradients at the members of each chunk, and the sums over them."""
    Clusters, Bodies, Boxes = types(form)
    own = views(form)
    wide, seen, middle = own.wide, own.seen, own.middle

    @register
    def add_up_volumes(
        first: int, start: int, dt: wp.float64, timed: wp.float64, box: Boxes, t: Volumes,
        c: Clusters, b: Bodies,
    ):  # fmt: skip
        n = start + first + wp.tid()
        k = c.cluster[n]
        origin = middle(k, c, b)
        sums = wp.vec2d()
        for e in range(c.begin[n], c.begin[n + 1]):
            now, was = wp.vec3d(), wp.vec3d()
            for f in range(t.face[e], t.face[e + 1]):
                j, l = t.left[f], t.right[f]
                x_j, x_l = seen(j, k, origin, box, c, b), seen(l, k, origin, box, c, b)
                p_j = x_j - timed * (wide(b.v[j]) * dt + wide(b.correction[j]))
                p_l = x_l - timed * (wide(b.v[l]) * dt + wide(b.correction[l]))
                now += wp.cross(x_j, x_l) / double(6.0)
                was += wp.cross(p_j, p_l) / double(6.0)
            i = c.particle[e]
            r = seen(i, k, origin, box, c, b)
            t.slope[e] = was
            sums += wp.vec2d(wp.dot(r, now), double(b.w[i]) * wp.dot(now, was))
        t.sums[n] = sums

    return add_up_volumes


@functools.cache
def solve_kernel(form: Form) -> wp.Kernel:
    """Kernel: the multiplier of each mesh,

    d_lam = (-C - alpha~ lam) / (sum w grad C(x) . grad C(x_prev) + alpha~).
    """
    Clusters, _, _ = types(form)

    @register
    def solve_volumes(
        first: int, start: int, fresh: int, inverse_dt: wp.float64, t: Volumes, c: Clusters
    ):
        k = start + first + wp.tid()
        sums = wp.vec2d()
        for n in range(c.chunk[k], c.chunk[k + 1]):
            sums += t.sums[n]
        lam = double(0.0)
        if fresh == 0:
            lam = t.lam[k]
        off = sums[0] / double(3.0) - t.target[k]
        alpha = t.compliance[k] * inverse_dt * inverse_dt
        step = double(0.0)
        # All pinned, flat or turned inside out in one substep: nothing sensible to do.
        if t.broken[k] == 0 and sums[1] > double(0.0):
            step = -(off + alpha * lam) / (sums[1] + alpha)
        t.step[k] = step
        t.lam[k] = lam + step

    return solve_volumes


@functools.cache
def inflate_kernel(form: Form) -> wp.Kernel:
    """Kernel: the members of each chunk go by dx = w grad C(x_prev) d_lam.

    Along gradients at the places where the substep began: a push along them has no torque there.
    """
    real, vec3 = form.precision.scalar, form.precision.vec3
    Clusters, Bodies, _ = types(form)
    kept, place = views(form).kept, place_function(form.precision, form.compensated)

    @register
    def inflate_meshes(
        first: int, start: int, t: Volumes, c: Clusters, b: Bodies
    ):  # fmt: skip
        n = start + first + wp.tid()
        step = t.step[c.cluster[n]]
        if step != double(0.0):
            for e in range(c.begin[n], c.begin[n + 1]):
                i = c.particle[e]
                if b.w[i] > real(0.0):
                    dx = vec3(t.slope[e] * (double(b.w[i]) * step))
                    place(i, b.x[i], kept(i, b), dx, b)

    return inflate_meshes


@functools.cache
def pressure_kernel() -> wp.Kernel:
    """Kernel: the pressure in each mesh, lam / dt^2; those of more than allowed burst."""

    @register
    def measure_pressure(
        first: int, may_break: int, t: Volumes, scale: wp.float64,
        pressure_out: wp.array(dtype=wp.float64),
    ):  # fmt: skip
        k = first + wp.tid()
        pressure = t.lam[k] * scale
        pressure_out[k] = pressure
        if may_break != 0 and wp.abs(pressure) > t.limit[k]:
            t.broken[k] = 1

    return measure_pressure
