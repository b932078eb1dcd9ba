"""Walls of a fluid by the method of images: terms of pairs with all of their images.

A particle j that is d_j in front of a flat wall has an image as far behind it. Of it a particle i,
d_i in front, is at r'^2 = r^2 + 4 d_i d_j, nearer than the support only where j itself is: the
loop over the neighbours of i meets all of its images. Where walls stand at right angles to each
other, images of images add up: r'^2 = r^2 + 4 sum_a d_ia d_ja for every set of walls. The pairs of
a fluid and of its images have an energy, whose gradient

    grad_i r'^2 / 2 = x_ij + 2 sum_a d_ja n_a

is taken as it is, along the normals n_a where i is, also of a wall that is curved. What approaches
does so at v_ij' . x_ij'. Where the fluid slips, images have mirrored velocities, and that is
d(r'^2 / 2)/dt = v_ij . x_ij + 2 sum_a (d_ia' d_ja + d_ia d_ja'). Where it sticks they have opposite
ones (Morris et al. 1997), against the wall: s = -1 for an odd number of such reflections, else 1,

    (v_i - s v_j) . x_ij
        + 2 sum_slip (d_ia' d_ja + s d_ia d_ja') + 2 sum_stick d_ja (d_ia' - s d_ja')

Clusters of slots that no wall is near to go by the plain terms, those near one by its images.
"""

import functools
from typing import Any

import warp as wp

from ...engine.loops import Pairs, Periodicity, Term, box_type, reader
from ...engine.packed import FLAGS
from ...precision import Precision, function, function_from_source, register
from ..pair import sums_over_partners
from .seen import Seen, nearest_function
from .walls import near_type


def square_lines(seen: Seen) -> list[str]:
    """Source of 4 d_i d_j by place."""
    return [f"e{a} = real(4.0) * D_i[{a}] * D_j[{a}]" for a in range(seen.places)]


def _weights(seen: Seen) -> list[str]:
    """Source that adds w(q') of all images to ``found``."""
    squares = [" + ".join(f"e{a}" for a in each) for each in seen.sets]
    added = [f"found += weight(wp.sqrt(r2 + {square}) * p.inverse_h)" for square in squares]
    return [*square_lines(seen), *added]


def density_term(
    weight: wp.Function, seen: Seen, precision: Precision, data: Any, params: Any
) -> Term:
    """Term m_j (w(q) + sum w(q')), the density without the normalisation of W."""
    lines = [*seen.read("D=wall"), "found = weight(wp.sqrt(r2) * p.inverse_h)", *_weights(seen)]
    names = {"weight": weight, "mass": reader(precision)}
    sums = "mass(d.m, j) * found"
    return term_of("add_images", lines, sums, 1, seen, names, precision, data, params)


@functools.cache
def own_weight(
    weight: wp.Function, seen: Seen, precision: Precision, data: Any, params: Any
) -> wp.Function:
    """``own(i, d, p)``: w(0), and w(q') of the images that a particle has of itself."""
    lines = ["j = i", *seen.read("D=wall"), "r2 = real(0.0)", "found = weight(r2)"]
    lines += _weights(seen)
    header, names = "own(i: int, d: Data, p: Params)", {"weight": weight}
    return function_of(header, lines, "found", seen, names, precision, data, params)


def force_term(
    pull: wp.Function, dragged: wp.Function | None, seen: Seen,
    direction: tuple[float, float, float], precision: Precision, data: Any, params: Any,
) -> Term:  # fmt: skip
    """Term (sum of w x_ij; of 2 d_ja w by place) over a pair and its images.

    Args:
        pull: w(i, j, approach, r2, d, p) of one pair (see :mod:`.sph`).
        dragged: The same of what is along v_ij' instead, without the approach; or None.
        seen: The walls.
        direction: Of coincident particles.
        precision: Of the simulation.
        data: Struct with ``wall`` and, where the approach counts, ``v`` and ``rate``, and where it
            sticks ``against``, velocities against walls.
        params: Struct of the fluid's parameters.
    """
    lines = [
        "apart = r2 > p.closest_squared",
        "side = wp.where(d.slot[i] < d.slot[j], -p.smoothing_length, p.smoothing_length)",
        "distance2 = wp.where(apart, r2, p.smoothing_length * p.smoothing_length)",
        *pair_lines(seen),
        "g = pull(i, j, approach, distance2, d, p)",
        "aside = direction * wp.where(apart, real(0.0), side * g)",
        *pull_lines(seen, "j", "real(2.0) * D_j[{a}]", ["g += g{n}"]),
        "f = x_ij * g + aside",
    ]
    if dragged is not None:
        lines += ["f = f + dragged(i, j, r2, d, p) * parting", *_drags(seen, "j")]
    sums = ", ".join([*(f"f[{c}]" for c in range(3)), *(f"b{a}" for a in range(seen.places))])
    names = {"pull": pull, "dragged": dragged, "direction": precision.vec3(*direction)}
    width = 3 + seen.places
    return term_of("push_images", lines, sums, width, seen, names, precision, data, params)


@functools.cache
def own_push(
    pull: wp.Function, dragged: wp.Function | None, seen: Seen, precision: Precision, data: Any,
    params: Any,
) -> wp.Function:  # fmt: skip
    """``own(i, d, p)``: the term of forces over the images of a particle of itself."""
    lines = ["j = i", "x_ij = vec3()", "r2 = real(0.0)", *pair_lines(seen)]
    lines += [*pull_lines(seen, "i", "real(2.0) * D_i[{a}]", []), "f = vec3()"]
    if dragged is not None:
        lines += _drags(seen, "i")
    numbers = [*(f"f[{c}]" for c in range(3)), *(f"b{a}" for a in range(seen.places))]
    result = f"sums({', '.join(numbers)})"
    names = {"pull": pull, "dragged": dragged, "sums": precision.vector(3 + seen.places)}
    header = "own(i: int, d: Data, p: Params)"
    return function_of(header, lines, result, seen, names, precision, data, params)


def pair_lines(seen: Seen) -> list[str]:
    """Source of how far walls are from both particles, and of how fast these approach."""
    if seen.sticky is None:
        return [*seen.read("D=wall"), "approach = real(0.0)"]
    lines = seen.read("D=wall", "R=rate")
    lines += ["parting = velocity(d.v, i) - velocity(d.v, j)", "approach = wp.dot(parting, x_ij)"]
    if any(seen.sticky):
        lines += [f"both = velocity(d.{seen.against}, i) + velocity(d.{seen.against}, j)"]
        lines += ["meeting = wp.dot(both, x_ij)"]
    return lines


def _drags(seen: Seen, j: str) -> list[str]:
    """Source that adds what drags along v_ij' of every image: to f, and to b where it is mirrored.

    v_ij' is v_i - s v_j, and 2 s d_ja' n_a more for every wall along which the fluid slips.
    """
    sticky, lines = seen.sticky or (), list[str]()
    for n, each in enumerate(seen.sets):
        square = "".join(f" + e{a}" for a in each)
        odd = sum(sticky[a] for a in each) % 2 == 1
        sign = "-real(2.0)" if odd else "real(2.0)"
        lines.append(f"h{n} = dragged(i, {j}, r2{square}, d, p)")
        lines.append(f"f = f + h{n} * {'both' if odd else 'parting'}")
        lines += [f"b{a} += {sign} * R_j[{a}] * h{n}" for a in each if not sticky[a]]
    return lines


def approaching(each: tuple[int, ...], sticky: tuple[bool, ...]) -> str:
    """Source of v_ij' . x_ij' of the image in these places."""
    odd = sum(sticky[a] for a in each) % 2 == 1
    plus, minus = ("-", "+") if odd else ("+", "-")
    terms = ["meeting" if odd else "approach"]
    for a in each:
        slipping = f"(R_i[{a}] * D_j[{a}] {plus} D_i[{a}] * R_j[{a}])"
        sticking = f"D_j[{a}] * (R_i[{a}] {minus} R_j[{a}])"
        terms.append(f"real(2.0) * {sticking if sticky[a] else slipping}")
    return " + ".join(terms)


def pull_lines(seen: Seen, j: str, arm: str, also: list[str]) -> list[str]:
    """Source of w of every image, which b of each of its places takes up along an ``arm``."""
    lines = [*square_lines(seen), *(f"b{a} = real(0.0)" for a in range(seen.places))]
    for n, each in enumerate(seen.sets):
        closing = "approach" if seen.sticky is None else approaching(each, seen.sticky)
        square = "".join(f" + e{a}" for a in each)
        lines.append(f"g{n} = pull(i, {j}, {closing}, r2{square}, d, p)")
        lines += [line.format(n=n) for line in also]
        lines += [f"b{a} += {arm.format(a=a)} * g{n}" for a in each]
    return lines


def term_of(
    name: str, lines: list[str], sums: str, width: int, seen: Seen, names: dict[str, Any],
    precision: Precision, data: Any, params: Any,
) -> Term:  # fmt: skip
    header = f"{name}(i: int, j: int, x_ij: vec3, r2: real, d: Data, p: Params)"
    names = {**names, "sums": precision.vector(width)}
    made = function_of(header, lines, f"sums({sums})", seen, names, precision, data, params)
    return Term(made, width, rounding="fused")


def function_of(
    header: str, lines: list[str], result: str, seen: Seen, names: dict[str, Any],
    precision: Precision, data: Any, params: Any,
) -> wp.Function:  # fmt: skip
    source = "\n    ".join([f"def {header}:", *lines, f"return {result}"]) + "\n"
    known = {
        "wp": wp, "real": precision.scalar, "vec3": precision.vec3, "Data": data, "Params": params,
        "read": reader(precision, seen.total), "velocity": reader(precision, 3),
        "one": precision.vector(1), "nearest": nearest_function(precision, seen.total),
    }  # fmt: skip
    return function_from_source(source, {**known, **names})


@functools.cache
def add_force(
    own: wp.Function, seen: Seen, precision: Precision, data: Any, params: Any, out: Any
) -> wp.Function:
    """Store: f += m_i (sum + normals of the walls times theirs); ``own`` is of :func:`own_push`."""
    total, alone = seen.total, seen.alone
    vec3, sums = precision.vec3, precision.vector(3 + seen.places)
    nearest = nearest_function(precision, total)

    def add_walled_force(i: int, particle: int, found: sums, d: data, p: params, o: out):
        a = vec3(found[0], found[1], found[2])
        b = own(i, d, p)
        a = a + vec3(b[0], b[1], b[2])
        N = o.normal[i]
        M = nearest(d.wall[i])
        for k in range(wp.static(total)):
            n = vec3(N[k, 0], N[k, 1], N[k, 2])
            if wp.static(alone):
                a = a + n * (M[k] * (found[3] + b[3]))
            else:
                a = a + n * (found[3 + k] + b[3 + k])
        o.f[particle] = o.f[particle] + d.m[i] * a

    return function(add_walled_force)


# A term, its store, and the structs of data and outputs.
Way = tuple[Term, wp.Function, Any, Any]


@functools.cache
def walled_kernel(
    plain: Way, alone: Way, several: Way, params: Any, precision: Precision, periodic: Periodicity,
    partners: str, vectorised: bool, total: int,
) -> wp.Kernel:  # fmt: skip
    """Kernel: sums over partners, each cluster by a way for none, one or several walls near it."""
    Box, Near = box_type(precision), near_type(precision, total)
    where = precision, periodic, partners, vectorised
    ways = [
        sums_over_partners(term, store, data, params, out, *where)
        for term, store, data, out in (plain, alone, several)
    ]
    sums, sums_of_one, sums_of_several = ways
    Data, Out, NearData, NearOut = plain[2], plain[3], several[2], several[3]
    flags = FLAGS["fused"] if vectorised else ""

    @functools.partial(register, cpu_only=vectorised, flags=flags)
    def sum_beside_walls(
        first: int,
        pairs: Pairs,
        box: wp.array(dtype=Box),
        parameters: wp.array(dtype=params),
        d: Data,
        o: Out,
        near: Near,
        near_d: NearData,
        near_o: NearOut,
    ):
        c = first + wp.tid()
        w = pairs.world[pairs.lead[c]]
        many = near.near[c]
        if many == 0:
            sums(c, pairs, box[w], d, parameters[w], o)
        elif many == 1:
            sums_of_one(c, pairs, box[w], near_d, parameters[w], near_o)
        else:
            sums_of_several(c, pairs, box[w], near_d, parameters[w], near_o)

    return sum_beside_walls
