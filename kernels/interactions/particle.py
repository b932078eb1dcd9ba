"""Forces and energies of single particles, from laws."""

import functools
from typing import Any

import warp as wp

from ..engine.loops import box_type
from ..precision import (
    FLOAT32,
    FLOAT64,
    Precision,
    function,
    function_from_source,
    native,
    register,
)
from ..warp_internals import arguments as arguments_of
from ..warp_internals import elements, native_name, vector

BLOCK = 64  # members that a thread of the CPU takes


def _evaluation(
    law: wp.Function, arguments: tuple[str, ...], precision: Precision, data: Any, params: Any,
    derived: int | None, force: bool,
) -> wp.Function:  # fmt: skip
    """The law of particle i at x, or minus its derivative by one of its arguments.

    A law of time is one of double precision in any case; a force is then cut to the scene's.
    """
    call = f"({', '.join(arguments)})"
    lines = [f"f = law{call}"]
    if derived is not None:
        gradients = ", ".join(f"g{k}" for k in range(len(arguments)))
        lines = [f"{gradients} = wp.grad(law){call}", f"f = -g{derived}"]
    lines.append("return Vec3(real(f[0]), real(f[1]), real(f[2]))" if force else "return f")
    source = "\n    ".join(["def law_of(i: int, w: int, x: Vec3, d: Data, p: Params):", *lines, ""])
    namespace = {
        "wp": wp, "law": law, "real": precision.scalar, "Vec3": precision.vec3, "Data": data,
        "Params": params,
    }  # fmt: skip
    # Behind the adjoints that it, or the law, may call.
    return function_from_source(source, namespace, after_gradients=True)


def _slope(
    law: wp.Function, arguments: tuple[str, ...], by: int, precision: Precision, data: Any,
    params: Any,
) -> wp.Function:  # fmt: skip
    """The derivative of a law's vector by its vector ``by``; 0 where it has none."""
    vec3, mat33 = precision.vec3, precision.mat33
    kinds = list(arguments_of(law).values())
    wide = FLOAT64 if kinds[by] is FLOAT64.vec3 else FLOAT32  # as a law of time is in any case
    named = [f"a{k}" for k in range(len(arguments))]
    types = {f"A{k}": kind for k, kind in enumerate(kinds)}
    typed = ", ".join(f"{a}: {A}" for a, A in zip(named, types, strict=True))
    along = function_from_source(
        f"def along({typed}, e: Wide):\n    return wp.dot(law({', '.join(named)}), e)\n",
        {"wp": wp, "law": law, "Wide": wide.vec3, **types}, after_gradients=False,
    )  # fmt: skip
    gradients = ", ".join(f"g{k}" for k in range(len(arguments) + 1))
    row_of = function_from_source(
        "def row_of(i: int, w: int, x: Vec3, d: Data, p: Params, e: Wide):\n"
        f"    {gradients} = wp.grad(along)({', '.join(arguments)}, e)\n    return g{by}\n",
        {"wp": wp, "along": along, "Vec3": vec3, "Wide": wide.vec3, "Data": data, "Params": params},
        after_gradients=True,
    )  # fmt: skip
    real, Wide, one = precision.scalar, wide.vec3, wide.scalar(1.0)

    def slope_of(i: int, w: int, x: vec3, d: data, p: params):
        slope = mat33()
        for r in range(3):
            e = Wide()
            e[r] = one
            row = row_of(i, w, x, d, p, e)
            for c in range(3):
                slope[r, c] = real(row[c])
        if not wp.isfinite(slope):
            slope = mat33()
        return slope

    return function(slope_of, after_gradients=True)


@functools.cache
def follow_kernel(
    law: wp.Function, arguments: tuple[str, ...], by: int, damps: bool, precision: Precision,
    data: Any, params: Any,
) -> wp.Kernel:  # fmt: skip
    """Kernel: f += (df/dv) u on each member, v the law's argument ``by``; see ``follow``."""
    slope = _slope(law, arguments, by, precision, data, params)

    @register
    def particle_follow(
        first: int,
        members: wp.array(dtype=wp.int32),
        world: wp.array(dtype=wp.int32),
        parameters: wp.array(dtype=params),
        d: data,
        lead: wp.array(dtype=precision.vec3),
        f_io: wp.array(dtype=precision.vec3),
    ):
        k = first + wp.tid()
        i = members[k]
        w = world[k]
        J = slope(i, w, d.x[i], d, parameters[w])
        if wp.static(not damps):
            J = (J - wp.transpose(J)) * precision.scalar(0.5)
        f_io[i] = f_io[i] + J * lead[i]

    return particle_follow


@functools.cache
def slope_kernel(
    law: wp.Function, arguments: tuple[str, ...], by: int, own: bool, precision: Precision,
    data: Any, params: Any,
) -> wp.Kernel:  # fmt: skip
    """Kernel: f += law(...) and slope += df/dv of each member, v the law's argument ``by``; with
    ``own`` that force is added to the sum of the implicit ones, too.
    """
    slope = _slope(law, arguments, by, precision, data, params)
    evaluate = _evaluation(law, arguments, precision, data, params, None, force=True)

    @register
    def particle_force_and_slope(
        first: int,
        members: wp.array(dtype=wp.int32),
        world: wp.array(dtype=wp.int32),
        parameters: wp.array(dtype=params),
        d: data,
        f_io: wp.array(dtype=precision.vec3),
        slope_io: wp.array(dtype=precision.mat33),
        own_io: wp.array(dtype=precision.vec3),
    ):
        k = first + wp.tid()
        i = members[k]
        w = world[k]
        f = evaluate(i, w, d.x[i], d, parameters[w])
        f_io[i] = f_io[i] + f
        slope_io[i] = slope_io[i] + slope(i, w, d.x[i], d, parameters[w])
        if wp.static(own):
            own_io[i] = own_io[i] + f

    return particle_force_and_slope


@functools.cache
def force_kernel(
    law: wp.Function, arguments: tuple[str, ...], derived: int | None, precision: Precision,
    data: Any, params: Any, vectorised: bool,
) -> wp.Kernel:  # fmt: skip
    """Kernel: f += law(...) on each member, or minus its derivative by argument ``derived``.

    A thread takes ``BLOCK`` members where it is vectorised, else one.
    """
    evaluate = _evaluation(law, arguments, precision, data, params, derived, force=True)
    lanes = _lane_forces(evaluate, precision, data, params)
    block = BLOCK if vectorised else 1

    @functools.partial(register, cpu_only=vectorised)
    def particle_force(
        first: int,
        members: wp.array(dtype=wp.int32),
        world: wp.array(dtype=wp.int32),
        parameters: wp.array(dtype=params),
        d: data,
        f_io: wp.array(dtype=precision.vec3),
    ):
        begin = (first + wp.tid()) * wp.static(block)
        end = wp.min(begin + wp.static(block), members.shape[0])
        if wp.static(vectorised):
            begin = lanes(begin, end, members, world, parameters, d, f_io)
        for k in range(begin, end):
            i = members[k]
            w = world[k]
            f_io[i] = f_io[i] + evaluate(i, w, d.x[i], d, parameters[w])

    return particle_force


def _lane_forces(
    evaluate: wp.Function, precision: Precision, data: Any, params: Any
) -> wp.Function:
    """``lanes(begin, end, ...) -> k``: forces of members in the CPU's lanes, and where to go on.

    Of particles that follow one another, in one world; of others none.
    """
    vec3, c = precision.vec3, precision.c
    snippet = f"""
    const int* member = {elements("members", "int")} + begin;
    const int w = {elements("world", "int")}[begin], count = end - begin, i_0 = member[0];
    int apart = {elements("world", "int")}[end - 1] ^ w;
    for (int l = 0; l < count; ++l) apart |= member[l] ^ (i_0 + l);
    if (apart) return begin;
    const {c}* x = {elements("d.x", c)} + 3 * (long long)i_0;
    {c}* f_io = {elements("f", c)} + 3 * (long long)i_0;
    const auto p = parameters.data[w];
    alignas(64) {c} f_of[3][{BLOCK}];
    for (int l = 0; l < count; ++l) {{
        const {vector(3, c)} here(x[3 * l], x[3 * l + 1], x[3 * l + 2]);
        const {vector(3, c)} force = {native_name(evaluate)}(i_0 + l, w, here, d, p);
        f_of[0][l] = force[0]; f_of[1][l] = force[1]; f_of[2][l] = force[2];
    }}
    for (int l = 0; l < count; ++l)
        for (int k = 0; k < 3; ++k) f_io[3 * l + k] += f_of[k][l];
    return end;
"""

    def lane_forces(
        begin: int, end: int, members: wp.array(dtype=wp.int32), world: wp.array(dtype=wp.int32),
        parameters: wp.array(dtype=params), d: data, f: wp.array(dtype=vec3),
    ) -> int:  # fmt: skip
        evaluate(begin, begin, vec3(), d, parameters[begin])

    return native(lane_forces, snippet)


@functools.cache
def energy_kernel(
    law: wp.Function, arguments: tuple[str, ...], precision: Precision, data: Any, params: Any,
    repeated: bool,
) -> wp.Kernel:  # fmt: skip
    """Kernel: energy += law(...) of each member.

    repeated: of the field that goes on in every image of the periodic box as in the box. Whoever
    has crossed it n times along an axis has climbed what the law rises by from its lower to its
    upper side as often; ``d`` holds the n as ``image``. For one linear in x that is the law at the
    unwrapped position, for one that is the same on both sides nothing.
    """
    vec3, Box = precision.vec3, box_type(precision)
    evaluate = _evaluation(law, arguments, precision, data, params, None, force=False)

    @register
    def particle_energy(
        first: int,
        members: wp.array(dtype=wp.int32),
        world: wp.array(dtype=wp.int32),
        parameters: wp.array(dtype=params),
        box: wp.array(dtype=Box),
        d: data,
        energy_io: wp.array(dtype=wp.float64),
    ):
        k = first + wp.tid()
        i = members[k]
        w = world[k]
        p = parameters[w]
        energy = wp.float64(evaluate(i, w, d.x[i], d, p))
        if wp.static(repeated):
            for a in range(3):
                n = d.image[i][a]
                if n != 0:
                    side = vec3(d.x[i])
                    side[a] = box[w].lower[a]
                    low = wp.float64(evaluate(i, w, side, d, p))
                    side[a] = box[w].lower[a] + box[w].length[a]
                    high = wp.float64(evaluate(i, w, side, d, p))
                    energy += wp.float64(n) * (high - low)
        energy_io[i] = energy_io[i] + energy

    return particle_energy
