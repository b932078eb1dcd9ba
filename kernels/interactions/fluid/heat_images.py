"""Heat of a fluid beside walls: the work of the images of its particles (see :mod:`.images`).

A pair and an image have a density, d rho_i / dt = m_j W'/r' d(r'^2 / 2)/dt, and where u are mean
velocities of a kick against the walls, that rate is

    u_ij . x_ij + 2 sum_a (u_ia d_ja + d_ia u_ja)

So what pressures store is to round-off what they and the walls have done: a wall that moves works.
Images along which the fluid slips share what viscosity takes like any pair. An image to which it
sticks moves against its mirror, and its wall does no work: what its viscous force takes from a
particle, F . u_i against the wall, heats that one.
"""

import functools
from typing import Any

import warp as wp

from ...engine.loops import Pairs, Term
from ...precision import Precision, register
from .images import approaching, function_of, pair_lines, square_lines, term_of
from .seen import Seen
from .walls import near_type


def heat_term(
    warm: wp.Function, heating: wp.Function, drags: bool, kicks: int, seen: Seen,
    precision: Precision, data: Any, params: Any,
) -> Term:  # fmt: skip
    """Term of the rates of heating over a pair and its images.

    Args:
        warm: Of the pair itself (see :mod:`.heat`).
        heating: Of any pair.
        drags: There is what drags.
        kicks: Of a substep.
        seen: The walls.
        precision: Of the simulation.
        data: Struct with those of the force, and by kick ``u``, ``closing`` and, where walls that
            move hold it, ``against``, as ``v``, ``rate`` and ``against`` at mean velocities.
        params: Struct of the fluid's parameters.
    """
    lines = [*_images(seen, "j", kicks, drags), "pair = warm(i, j, x_ij, r2, d, p)"]
    sums = ", ".join(f"pair[{k}] + found{k}" for k in range(kicks))
    names = {"warm": warm, "heating": heating}
    return term_of("warm_images", lines, sums, kicks, seen, names, precision, data, params)


@functools.cache
def own_heat(
    heating: wp.Function, drags: bool, kicks: int, seen: Seen, precision: Precision, data: Any,
    params: Any,
) -> wp.Function:  # fmt: skip
    """``own(i, d, p)``: that of the images that a particle has of itself."""
    lines = ["j = i", "x_ij = vec3()", "r2 = real(0.0)", *_images(seen, "i", kicks, drags)]
    header, names = "own(i: int, d: Data, p: Params)", {"heating": heating}
    names["sums"] = precision.vector(kicks)
    result = f"sums({', '.join(f'found{k}' for k in range(kicks))})"
    return function_of(header, lines, result, seen, names, precision, data, params)


def _images(seen: Seen, j: str, kicks: int, drags: bool) -> list[str]:
    """Source that sums the heat of all images, by kick, in ``found``."""
    sticky = seen.sticky or (False,) * seen.total
    names = [f"{'UV'[k]}=closing{k}" for k in range(kicks)]
    lines = [*pair_lines(seen), *square_lines(seen), *seen.read(*names)]
    for k in range(kicks):
        lines += [f"found{k} = real(0.0)", f"u{k} = velocity(d.u{k}, i) - velocity(d.u{k}, {j})"]
        lines += [f"closing{k} = wp.dot(u{k}, x_ij)", f"shear{k} = wp.dot(u{k}, parting)"]
        if any(sticky):
            own = f"u{k}" if seen.against == "v" else f"against{k}"
            lines += [f"own{k} = velocity(d.{own}, i)", f"loss{k} = wp.dot(own{k}, x_ij)"]
    for n, each in enumerate(seen.sets):
        square = "".join(f" + e{a}" for a in each)
        lines.append(f"w{n} = heating(i, {j}, {approaching(each, sticky)}, r2{square}, d, p)")
        for k in range(kicks):
            lines += _heat(n, each, [a for a in each if sticky[a]], k, drags)
    return lines


def _heat(n: int, each: tuple[int, ...], holds: list[int], k: int, drags: bool) -> list[str]:
    """Source that adds the heat of an image at the mean velocities of a kick."""
    U, two = "UV"[k], "real(2.0)"
    closing = "".join(f" + {two} * ({U}_i[{a}] * D_j[{a}] + D_i[{a}] * {U}_j[{a}])" for a in each)
    near = f"(closing{k}{closing})"
    if not holds:
        lines = [f"found{k} += (w{n}[0] + real(0.5) * w{n}[1]) * {near}"]
        if drags:
            mirrored = "".join(
                f" + {two} * (R_j[{a}] * {U}_i[{a}] + {U}_j[{a}] * R_i[{a}])" for a in each
            )
            lines.append(f"found{k} += real(0.5) * w{n}[2] * (shear{k}{mirrored})")
        return lines
    loss = "".join(f" + {two} * D_j[{a}] * {U}_i[{a}]" for a in each)
    lines = [f"found{k} += w{n}[0] * {near} + w{n}[1] * (loss{k}{loss})"]
    if drags:
        odd = len(holds) % 2 == 1
        sign, motion = ("-", "both") if odd else ("+", "parting")
        slips = [a for a in each if a not in holds]
        mirrored = "".join(f" {sign} {two} * R_j[{a}] * {U}_i[{a}]" for a in slips)
        lines.append(f"found{k} += w{n}[2] * (wp.dot(own{k}, {motion}){mirrored})")
    return lines


@functools.cache
def mean_rate_kernel(precision: Precision, total: int) -> wp.Kernel:
    """Kernel: what is known of velocities against walls, at the mean ones of a kick."""
    each, vec3, Near = precision.vector(total), precision.vec3, near_type(precision, total)

    @register
    def mean_rates(
        first: int,
        pairs: Pairs,
        v: wp.array(dtype=vec3),
        mean: wp.array(dtype=vec3),
        near: Near,
        closing_out: wp.array(dtype=each),
        against_out: wp.array(dtype=vec3),
    ):
        i = first + wp.tid()
        change = mean[i] - v[i]
        N = near.normal[i]
        rate = each(near.rate[i])
        for k in range(wp.static(total)):
            rate[k] += wp.dot(vec3(N[k, 0], N[k, 1], N[k, 2]), change)
        closing_out[i] = rate
        if against_out.shape[0] > 0:
            against_out[i] = near.against[i] + change

    return mean_rates
