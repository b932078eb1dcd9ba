"""Heat of a fluid: what the work of its forces makes of its internal energy.

The work that a pair does on the motion of both is taken from what they store, at the velocity that
is the mean of those before and after a kick, so that no energy is lost or made:

    du_i/dt = sum_j m_j (P_i/rho_i^2 + Pi_ij/2) u_ij . grad_i W_ij

where u is that mean velocity (Monaghan 1992, eq. 3.8, for the sum; Owen 2014 for the mean).
"""

import functools
from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any

import warp as wp

from ...engine.integrate import compensated_sum
from ...engine.loops import Term, reader
from ...precision import Precision, function, register
from .sph import DIRECTIONS, drag_function


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


def heating_function(
    slope: wp.Function, laws: Mapping[str, wp.Function], switched: bool, precision: Precision,
    data: Any, params: Any,
) -> wp.Function:  # fmt: skip
    """``heating(i, j, approach, r2, d, p)``: what heats i by the motion of a pair.

    Three numbers: m_j P_i/rho_i^2 W'/r and m_j Pi_ij W'/r, for u_ij . x_ij, and -w_ij of what
    drags, for u_ij . v_ij.
    """
    real, vec3, state_of, read = (
        precision.scalar, precision.vec3, reader(precision, 4), reader(precision),
    )  # fmt: skip
    viscosity, drags = laws.get("term"), "drag" in laws
    viscous = viscosity is not None
    dragged = drag_function(slope, laws["drag"], False, precision, data, params) if drags else None

    def heating(i: int, j: int, approach: real, r2: real, d: data, p: params):
        state_i = state_of(d.state, i)
        state_j = state_of(d.state, j)
        gradient = (state_j[0] * p.sigma) * slope(wp.sqrt(r2) * p.inverse_h)
        pressed = (gradient * state_i[2] * p.inverse_h) * p.inverse_h
        rubbed, drawn = real(0.0), real(0.0)
        if wp.static(viscous):
            mean = real(0.5) * (state_i + state_j)
            term = viscosity(approach, r2, mean[1], mean[3], p)
            if wp.static(switched):
                term *= real(0.5) * (read(d.balsara, i) + read(d.balsara, j))
            rubbed = (gradient * term * p.inverse_h) * p.inverse_h
        if wp.static(drags):
            drawn = -dragged(i, j, r2, d, p)
        return vec3(pressed, rubbed, drawn)

    return function(heating)


def warm_function(
    heating: wp.Function, drags: bool, dimension: int, kicks: int, precision: Precision, data: Any,
    params: Any,
) -> wp.Function:  # fmt: skip
    """``warm(i, j, x_ij, r2, d, p)``: the rates of heating by a pair, at the means of kicks.

    A pair shares what its viscosity takes. Coincident particles are taken as h apart, as by the
    force.
    """
    real, vec3, result = precision.scalar, precision.vec3, precision.vector(kicks)
    vector_of, aside, both = reader(precision, 3), vec3(*DIRECTIONS[dimension]), kicks == 2

    def warm(i: int, j: int, x_ij: vec3, r2: real, d: data, p: params):
        apart = r2 > p.closest_squared
        side = wp.where(d.slot[i] < d.slot[j], -p.smoothing_length, p.smoothing_length)
        distance2 = wp.where(apart, r2, p.smoothing_length * p.smoothing_length)
        along = x_ij + wp.where(apart, real(0.0), side) * aside
        v_ij = vector_of(d.v, i) - vector_of(d.v, j)
        w = heating(i, j, wp.dot(v_ij, x_ij), distance2, d, p)
        g = (w[0] + real(0.5) * w[1]) * along
        if wp.static(drags):
            g += (real(0.5) * w[2]) * v_ij
        rate = result()
        rate[0] = wp.dot(vector_of(d.u0, i) - vector_of(d.u0, j), g)
        if wp.static(both):
            rate[1] = wp.dot(vector_of(d.u1, i) - vector_of(d.u1, j), g)
        return rate

    return function(warm)


def heat_term(
    slope: wp.Function, laws: Mapping[str, wp.Function], switched: bool, dimension: int, kicks: int,
    precision: Precision, data: Any, params: Any,
) -> Term:  # fmt: skip
    """Term m_j (P_i/rho_i^2 + Pi_ij/2) u_ij . grad_i W_ij of heat, at the mean velocities of kicks.

    A drag heats by -w_ij v_ij . u_ij / 2.
    """
    types = precision, data, params
    heating = heating_function(slope, laws, switched, *types)
    return Term(warm_function(heating, "drag" in laws, dimension, kicks, *types), kicks)


@functools.cache
def keep_rates(
    kicks: int, own: wp.Function | None, precision: Precision, data: Any, params: Any, out: Any
) -> wp.Function:
    """Store: the rates of heating of each kick.

    ``own(i, d, p)`` is what images of a particle itself add; None: nothing.
    """
    rates, both, imaged = precision.vector(kicks), kicks == 2, own is not None

    def keep(i: int, particle: int, total: rates, d: data, p: params, o: out):
        rate = rates(total)
        if wp.static(imaged):
            rate = rate + own(i, d, p)
        o.rate0[particle] = rate[0]
        if wp.static(both):
            o.rate1[particle] = rate[1]

    return function(keep)
