"""What follows a projection of clusters: their spin, what pulls at them, and how they give way."""

import functools

import warp as wp

from ...engine.bounces import bounces_type
from ...precision import FLOAT64, function, register
from ...tensor import Tensor, virial_function
from .members import Form, types, views
from .rotation import GOOD, spin_of

double = wp.float64


@wp.struct
class Rates:
    """Sums over members, m their weight, r where they are and u by how much their velocity has
    changed.
    """

    r: wp.vec3d  # of m r
    inertia: wp.mat33d  # of m (r^2 - r r^T)
    u: wp.vec3d  # of m u
    spin: wp.vec3d  # of m r x u


@wp.struct
class RigidMotion:
    """The velocity ``u + spin x (r - middle)``."""

    middle: wp.vec3d
    u: wp.vec3d
    spin: wp.vec3d


def _inertia(r: wp.vec3d):
    return wp.length_sq(r) * wp.identity(n=3, dtype=double) - wp.outer(r, r)


inertia = function(_inertia)


@functools.cache
def spin_kernel(form: Form) -> wp.Kernel:
    """Kernel: a cluster gets the angular momentum that its projections have lacked.

    They have where it turns by more than an angle whose sine would be above 1 in a substep.
    """
    vec3, real = form.precision.vec3, form.precision.scalar
    Clusters, Bodies, Boxes = types(form)
    own = views(form)
    seen, wide = own.seen, own.wide

    @register
    def restore_spin(
        first: int, start: int, inverse_dt: wp.float64, box: Boxes, c: Clusters,
        b: Bodies,
    ):  # fmt: skip
        k = start + first + wp.tid()
        torque = c.torque[k]
        if wp.length(torque) <= double(wp.static(GOOD)) * c.size[k]:
            return
        begin, end = c.begin[c.chunk[k]], c.begin[c.chunk[k + 1]]
        origin = c.origin[k]
        middle = wp.vec3d()
        whole = wp.mat33d()
        for e in range(begin, end):
            r = seen(c.particle[e], k, origin, box, c, b)
            middle += c.weight[e] * r
            whole += c.weight[e] * inertia(r)
        middle = middle / c.total[k]
        spin = spin_of(torque * inverse_dt, whole - c.total[k] * inertia(middle))
        for e in range(begin, end):
            i = c.particle[e]
            if b.w[i] > real(0.0):
                r = seen(i, k, origin, box, c, b)
                b.v[i] = vec3(wide(b.v[i]) + wp.cross(spin, r - middle))

    return restore_spin


@functools.cache
def velocities_kernel(form: Form) -> wp.Kernel:
    """Kernel: the sums of each chunk over velocities."""
    real = form.precision.scalar
    Clusters, Bodies, Boxes = types(form)
    own = views(form)
    seen, wide, centre = own.seen, own.wide, own.middle

    @register
    def add_up_velocities(
        first: int, box: Boxes, c: Clusters, b: Bodies, start: int, rates_out: wp.array(dtype=Rates)
    ):
        n = start + first + wp.tid()
        k = c.cluster[n]
        origin = centre(k, c, b)
        s = Rates()
        for e in range(c.begin[n], c.begin[n + 1]):
            i = c.particle[e]
            m = c.weight[e]
            r = seen(i, k, origin, box, c, b)
            s.r += m * r
            s.inertia += m * inertia(r)
            if b.w[i] > real(0.0):
                u = wide(b.v[i])
                s.u += m * u
                s.spin += m * wp.cross(r, u)
        rates_out[n] = s

    return add_up_velocities


@functools.cache
def fit_kernel(form: Form) -> wp.Kernel:
    """Kernel: of each cluster the rigid motion of the same momentum and angular momentum."""
    Clusters, Bodies, _ = types(form)
    centre = views(form).middle

    @register
    def fit_rigid_motions(
        first: int, c: Clusters, b: Bodies, start: int, rates: wp.array(dtype=Rates),
        motion_out: wp.array(dtype=RigidMotion),
    ):  # fmt: skip
        k = start + first + wp.tid()
        s = Rates()
        for n in range(c.chunk[k], c.chunk[k + 1]):
            one = rates[n]
            s.r += one.r
            s.inertia += one.inertia
            s.u += one.u
            s.spin += one.spin
        c.origin[k] = centre(k, c, b)
        total = c.total[k]
        motion = RigidMotion()
        motion.middle = s.r / total
        motion.u = s.u / total
        own_spin = s.spin - wp.cross(motion.middle, s.u)
        motion.spin = spin_of(own_spin, s.inertia - total * inertia(motion.middle))
        motion_out[k] = motion

    return fit_rigid_motions


@functools.cache
def follow_kernel(form: Form) -> wp.Kernel:
    """Kernel: velocities become those of the rigid motion; soft and broken clusters stay."""
    vec3, real, Bounces = form.precision.vec3, form.precision.scalar, bounces_type(form.precision)
    Clusters, Bodies, Boxes = types(form)
    own = views(form)
    seen, gone = own.seen, own.gone

    @register
    def follow_rigid_motions(
        first: int, box: Boxes, c: Clusters, b: Bodies, start: int,
        motion: wp.array(dtype=RigidMotion), bounces: Bounces,
    ):  # fmt: skip
        n = start + first + wp.tid()
        k = c.cluster[n]
        if bounces.running[c.world[k]] == 0:
            return
        if c.softness[k] == double(0.0) and not gone(k, c):
            move = motion[k]
            for e in range(c.begin[n], c.begin[n + 1]):
                i = c.particle[e]
                if b.w[i] > real(0.0):
                    r = seen(i, k, c.origin[k], box, c, b)
                    b.v[i] = vec3(move.u + wp.cross(move.spin, r - move.middle))

    return follow_rigid_motions


@functools.cache
def strain_kernel(form: Form) -> wp.Kernel:
    """Kernel: the largest force on a member, m |d| / dt^2; clusters of more than allowed break."""
    Clusters, _, _ = types(form)
    wide, breakable = views(form).wide, form.breakable

    @register
    def strain_clusters(
        first: int, may_break: int, c: Clusters, scale: wp.float64,
        force_out: wp.array(dtype=wp.float64),
    ):  # fmt: skip
        k = first + wp.tid()
        force = double(0.0)
        for e in range(c.begin[c.chunk[k]], c.begin[c.chunk[k + 1]]):
            force = wp.max(force, c.weight[e] * wp.length(wide(c.shift[e])) * scale)
        force_out[k] = force
        if wp.static(breakable):
            if c.broken[k] != 0:
                force_out[k] = double(0.0)
            if may_break != 0 and force > c.limit[k]:
                c.broken[k] = 1

    return strain_clusters


@functools.cache
def creep_kernel(form: Form) -> wp.Kernel:
    """Kernel: rest shapes flow where the stretch S is beyond the yield (Mueller et al. 2005, 4.4).

    S_p <- (1 + dt creep (S - 1)) S_p while |S - 1| > yield, of unchanged volume and no further
    than |S_p - 1| = largest. S is R^T F S_p^-1, F = A (sum m q_0 q_0^T)^-1 fits all members.
    """
    Clusters, _, _ = types(form)

    @register
    def creep_clusters(
        first: int, start: int, dt: wp.float64, inverse: wp.array(dtype=wp.mat33d),
        flat: wp.array(dtype=wp.mat33d), flow: wp.array(dtype=wp.vec3d), c: Clusters,
    ):  # fmt: skip
        k = start + first + wp.tid()
        A = wp.mat33d()
        for n in range(c.chunk[k], c.chunk[k + 1]):
            A += c.moments[n].A
        one = wp.identity(n=3, dtype=double)
        shape = one + c.strain[k]
        R = wp.quat_to_matrix(c.turn[k])
        # Across a plane or a line nothing is known to be stretched.
        F = A * inverse[k] + R * shape * flat[k]
        excess = wp.transpose(R) * F * wp.inverse(shape) - one
        f = flow[k]
        if wp.sqrt(wp.ddot(excess, excess)) > f[0]:
            new = (one + wp.min(dt * f[1], double(1.0)) * excess) * shape
            det = wp.determinant(new)
            if det > double(0.0):
                new = new / wp.pow(det, double(1.0 / 3.0))
                strain = new - one
                size = wp.sqrt(wp.ddot(strain, strain))
                if size <= f[2]:
                    c.strain[k] = strain

    return creep_clusters


@functools.cache
def virial_kernel(form: Form) -> wp.Kernel:
    """Kernel: the virial of each member's force m d / dt^2, and the energy of a soft cluster."""
    Clusters, Bodies, Boxes = types(form)
    own = views(form)
    seen, wide, virial = own.seen, own.wide, virial_function(FLOAT64, tensor=True)

    @register
    def cluster_virial(
        first: int, start: int, scale: wp.float64, box: Boxes, c: Clusters,
        b: Bodies, energy_io: wp.array(dtype=wp.float64), stress_io: wp.array(dtype=Tensor),
    ):  # fmt: skip
        k = start + first + wp.tid()
        for e in range(c.begin[c.chunk[k]], c.begin[c.chunk[k + 1]]):
            i = c.particle[e]
            pull = wide(c.shift[e]) * scale  # force over mass
            r = seen(i, k, c.origin[k], box, c, b)
            m = c.weight[e]
            energy_io[i] = energy_io[i] + double(0.5) * m * wp.length_sq(pull) * c.softness[k]
            stress_io[i] = stress_io[i] + virial(pull * m, r)

    return cluster_virial
