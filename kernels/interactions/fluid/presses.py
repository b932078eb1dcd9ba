"""What a fluid exerts on one of its walls: what the images in it exert on the fluid, reversed.

Of a pair and an image in a set of walls the force has a part along the normal of each, (d_i + d_j)
w of what pulls, which is that wall's. Along the walls the images of a fluid that slips exert
nothing in all. Of one that sticks they do, and what is along no normal is taken by the first wall
of the set to which it sticks: the shear stress. So all walls together bear what the fluid loses.
"""

import functools
from typing import Any

import warp as wp

from ...engine.loops import Term
from ...precision import Precision, function
from .images import function_of, pair_lines, pull_lines, term_of
from .seen import Seen


def press_term(
    pull: wp.Function, dragged: wp.Function | None, seen: Seen, own: tuple[int, ...],
    precision: Precision, data: Any, params: Any,
) -> Term:  # fmt: skip
    """Term (along the normal, by place; what is taken by the walls in the places ``own``).

    Args:
        pull: As of :func:`~particlesim.kernels.interactions.fluid.images.force_term`.
        dragged: Likewise.
        seen: All walls.
        own: The places whose shear is asked for.
        precision: Of the simulation.
        data: Likewise.
        params: Likewise.
    """
    lines, sums = [*pair_lines(seen), *_presses(seen, "j", own, dragged)], _sums(seen)
    names, width = {"pull": pull, "dragged": dragged}, 3 + 2 * seen.total
    return term_of("press", lines, sums, width, seen, names, precision, data, params)


@functools.cache
def own_press(
    pull: wp.Function, dragged: wp.Function | None, seen: Seen, own: tuple[int, ...],
    precision: Precision, data: Any, params: Any,
) -> wp.Function:  # fmt: skip
    """``own(i, d, p)``: the same of the images of a particle of itself."""
    lines = ["j = i", "x_ij = vec3()", "r2 = real(0.0)", *pair_lines(seen)]
    lines += _presses(seen, "i", own, dragged)
    names = {"pull": pull, "dragged": dragged, "sums": precision.vector(3 + 2 * seen.total)}
    header, result = "own(i: int, d: Data, p: Params)", f"sums({_sums(seen)})"
    return function_of(header, lines, result, seen, names, precision, data, params)


def _presses(seen: Seen, j: str, own: tuple[int, ...], dragged: wp.Function | None) -> list[str]:
    """Source of b by place, the normal part; of t, what is taken; of c by place, more of that."""
    sticky = seen.sticky or (False,) * seen.total
    lines = pull_lines(seen, j, "(D_i[{a}] + D_j[{a}])", [])
    lines += ["t = vec3()", *(f"c{a} = real(0.0)" for a in range(seen.total))]
    for n, each in enumerate(seen.sets):
        holds = [a for a in each if sticky[a]]
        square = "".join(f" + e{a}" for a in each)
        if dragged is not None and (not holds or holds[0] in own):
            lines.append(f"h{n} = dragged(i, {j}, r2{square}, d, p)")
        if not holds:
            if dragged is not None:
                lines += [f"b{a} += h{n} * (R_i[{a}] + R_j[{a}])" for a in each]
            continue
        if holds[0] not in own:
            continue
        lines.append(f"t = t + g{n} * x_ij")
        lines += [f"c{a} -= g{n} * (D_i[{a}] - D_j[{a}])" for a in each]
        if dragged is not None:
            odd = len(holds) % 2 == 1
            lines.append(f"t = t + h{n} * {'both' if odd else 'parting'}")
            sign = "-real(2.0)" if odd else "real(2.0)"
            lines += [f"c{a} += {sign} * R_j[{a}] * h{n}" for a in each if not sticky[a]]
    return lines


def _sums(seen: Seen) -> str:
    names = [*(f"b{a}" for a in range(seen.total)), *(f"t[{k}]" for k in range(3))]
    return ", ".join([*names, *(f"c{a}" for a in range(seen.total))])


@functools.cache
def keep_press(
    own: wp.Function, places: tuple[int, ...], total: int, precision: Precision, data: Any,
    params: Any, out: Any,
) -> wp.Function:  # fmt: skip
    """Store: the force on each particle by the walls in these places."""
    vec3, each = precision.vec3, precision.vector(3 + 2 * total)
    real, first = precision.scalar, min(places)
    last = max(places) + 1

    def keep_wall_force(i: int, particle: int, found: each, d: data, p: params, o: out):
        b = own(i, d, p)
        N = o.normal[i]
        f = vec3(found[total] + b[total], found[total + 1] + b[total + 1],
                 found[total + 2] + b[total + 2])  # fmt: skip
        for k in range(wp.static(total)):
            w = found[total + 3 + k] + b[total + 3 + k]
            w += wp.where(k >= first and k < last, found[k] + b[k], real(0.0))
            f = f + vec3(N[k, 0], N[k, 1], N[k, 2]) * w
        o.pressed[i] = f * d.m[i]

    return function(keep_wall_force)
