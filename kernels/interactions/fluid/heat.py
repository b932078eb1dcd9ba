"""Heat of a fluid: what the work of its forces makes of its internal energy.

The work that a pair does on the motion of both is taken from what they store, at the velocity that
is the mean of those before and after a kick, so that no energy is lost or made:

    du_i/dt = sum_j m_j (P_i/rho_i^2 + Pi_ij/2) u_ij . grad_i W_ij

where u is that mean velocity (Monaghan 1992, eq. 3.8, for the sum; Owen 2014 for the mean).
"""

import functools
from types import SimpleNamespace
from typing import Any

import warp as wp

from ...engine.integrate import compensated_sum
from ...precision import Precision, function, register


@functools.cache
def heat_kernels(precision: Precision, compensated: bool) -> SimpleNamespace:
    """Kernels around the sum: mean velocities of kicks, and internal energies that go on."""
    real, vec3, add = precision.scalar, precision.vec3, compensated_sum(precision.scalar)
    RealArray = wp.array(dtype=real)

    def rise(i: int, du: real, u_io: RealArray, error_io: RealArray):
        if wp.static(compensated):
            u, error = add(u_io[i], du, error_io[i])
            u_io[i] = u
            error_io[i] = error
        else:
            u_io[i] = u_io[i] + du

    rise_by = function(rise)

    @register
    def mean_velocity(
        first: int,
        order: wp.array(dtype=wp.int32),
        v: wp.array(dtype=vec3),
        f: wp.array(dtype=vec3),
        w: wp.array(dtype=real),
        dt: real,
        mean_out: wp.array(dtype=vec3),
    ):
        """u = v + w f dt, in slot order."""
        i = first + wp.tid()
        particle = order[i]
        mean_out[i] = v[particle] + f[particle] * (w[particle] * dt)

    @register
    def heat(
        first: int,
        members: wp.array(dtype=wp.int32),
        dt: real,
        rate: wp.array(dtype=real),
        u_io: wp.array(dtype=real),
        error_io: wp.array(dtype=real),
    ):
        """u += rate dt."""
        i = members[first + wp.tid()]
        rise_by(i, rate[i] * dt, u_io, error_io)

    @register
    def heat_late(
        first: int,
        members: wp.array(dtype=wp.int32),
        half: real,
        late: wp.array(dtype=real),
        following: wp.array(dtype=real),
        early_io: wp.array(dtype=real),
        u_io: wp.array(dtype=real),
        error_io: wp.array(dtype=real),
    ):
        """u += (late - early) dt / 2: what was foreseen of the second half is made good."""
        i = members[first + wp.tid()]
        rise_by(i, (late[i] - early_io[i]) * half, u_io, error_io)
        early_io[i] = following[i]

    return SimpleNamespace(mean_velocity=mean_velocity, heat=heat, heat_late=heat_late)


@functools.cache
def keep_rates(kicks: int, precision: Precision, data: Any, params: Any, out: Any) -> wp.Function:
    """Store: the rates of heating of each kick."""
    rates, both = precision.vector(kicks), kicks == 2

    def keep(i: int, particle: int, total: rates, d: data, p: params, o: out):
        o.rate0[particle] = total[0]
        if wp.static(both):
            o.rate1[particle] = total[1]

    return function(keep)
