"""Pair interactions: terms made of laws, and the kernels that sum them over the partners."""

import functools
from collections.abc import Mapping
from typing import Any

import warp as wp

from ..engine.loops import Pairs, Periodicity, Term, box_type, plain_loop, reader
from ..engine.packed import FLAGS, packed_loop
from ..precision import APART, Precision, function, function_from_source, register
from ..tensor import AXES, Tensor
from .calls import Call

# A pair closer than p.closest is taken as that far apart, along a fixed direction: coincident
# particles then push each other apart, equally and opposite.
_SEPARATION = """
    near = p.closest_squared
    side = wp.where(d.slot[i] < d.slot[j], real(-1.0), real(1.0))
    apart = r2 > near
    square = wp.where(apart, r2, near)
    r = wp.sqrt(square)
"""
_ALONG = "    along = x_ij + aside * wp.where(apart, real(0.0), side * r)\n"


def force_term(
    call: Call, precision: Precision, data: Any, params: Any, derivative: bool, rounding: str
) -> Term:
    """Term f_ij = F(r) x_ij / r, with F the law itself or minus the derivative of an energy.

    ``rounding`` is how the compiler may have it.
    """
    evaluate = call.derivative if derivative else call.force
    evaluate += f"    of_pair = {call.selection.counted('w')}"
    result = "pair2(of_pair, wp.where(apart, real(0.0), side * of_pair * r))"
    made = _of_law("pair_force", call, evaluate, result, precision, data, params)
    return Term(made, 3, APART, rounding)


def measure_term(call: Call, precision: Precision, data: Any, params: Any) -> Term:
    """Term (u_ij / 2, w_ij / 2) of the potential energy and of the virial w = -r du/dr."""
    evaluate = f"{call.derivative}{call.potential}    half = real(0.5)"
    u, w = (call.selection.counted(each) for each in ("half * u", "half * w * square"))
    made = _of_law("pair_measure", call, evaluate, f"pair2({u}, {w})", precision, data, params)
    return Term(made, 2)


def virial_term(call: Call, precision: Precision, data: Any, params: Any) -> Term:
    """Term (0, r F / 2) of a force that is given."""
    result = f"pair2(real(0.0), {call.selection.counted('real(0.5) * w * square')})"
    made = _of_law("pair_virial", call, call.force, result, precision, data, params)
    return Term(made, 2)


def energy_term(call: Call, precision: Precision, data: Any, params: Any) -> Term:
    """Term u_ij / 2 of the potential energy alone."""
    result = f"one({call.selection.counted('real(0.5) * u')})"
    made = _of_law("pair_energy", call, call.potential, result, precision, data, params)
    return Term(made, 1)


def stress_term(call: Call, precision: Precision, data: Any, params: Any, derivative: bool) -> Term:
    """Term (u_ij, w_ij x x^T / r^2) / 2 of the energy and the virial as a tensor.

    Of a force that is given it has no energy.
    """
    u, w = (call.selection.counted(f"real(0.5) * {each}") for each in ("u", "w"))
    evaluate = f"{call.derivative}{call.potential}    u_half = {u}\n" if derivative else call.force
    evaluate += f"    w_half = {w}\n{_ALONG}"
    products = ", ".join(f"w_half * along[{a}] * along[{b}]" for a, b in AXES)
    result = f"tensor({'u_half' if derivative else 'real(0.0)'}, {products})"
    made = _of_law("pair_stress", call, evaluate, result, precision, data, params)
    return Term(made, 1 + len(AXES))


def _of_law(
    name: str, call: Call, evaluate: str, result: str, precision: Precision, data: Any, params: Any
) -> wp.Function:
    names = {
        "law": call.law, "one": precision.vector(1), "pair2": precision.vector(2),
        "tensor": precision.vector(1 + len(AXES)), **call.selection.functions(),
    }  # fmt: skip
    lines = call.selection.source() + evaluate
    return _term(name, lines, result, names, precision, data, params)


def sum_term(
    law: wp.Function, arguments: list[str], width: int, fields: Mapping[str, Any],
    precision: Precision, data: Any, params: Any,
) -> Term:  # fmt: skip
    """Term that is a law of the pair by itself, a number or a vector of ``width`` numbers.

    ``arguments`` read what ``fields`` names, with its type, as ``read_<name>(d.<name>, j)``.
    """
    names = {"law": law, "one": precision.vector(1), **_readers(fields, precision)}
    call = f"law({', '.join(arguments)})"
    result = call if width > 1 else f"one({call})"
    return Term(_term("pair_sum", _ALONG, result, names, precision, data, params), width)


def _readers(fields: Mapping[str, Any], precision: Precision) -> dict[str, wp.Function]:
    """For arrays of these types the functions that read them fast."""
    return {
        f"read_{name}": reader(precision, None if kind is precision.scalar else len(kind()))
        for name, kind in fields.items()
    }


def _term(
    name: str, evaluate: str, result: str, names: Mapping[str, Any], precision: Precision,
    data: Any, params: Any,
) -> wp.Function:  # fmt: skip
    source = (
        f"def {name}(i: int, j: int, x_ij: vec3, r2: real, d: Data, p: Params):"
        f"{_SEPARATION}{evaluate}\n    return {result}\n"
    )
    namespace = {
        "wp": wp, "real": precision.scalar, "vec3": precision.vec3, "Data": data,
        "Params": params, "aside": precision.vec3(*APART), **names,
    }  # fmt: skip
    # Behind the adjoints that the law may call.
    return function_from_source(source, namespace, after_gradients=True)


def fused_term(terms: list[Term], precision: Precision, data: Any, params: Any) -> Term:
    """Sum of central terms of one direction, each with its own cutoff, data and parameters.

    Beyond its own cutoff a term is evaluated inside it and multiplied away, so that the loop has
    no branch and a law is never asked where it need not be defined.
    """
    lines = ["def fused_force(i: int, j: int, x_ij: vec3, r2: real, d: Data, p: Params):"]
    for k in range(len(terms)):
        lines += [
            f"    c{k} = p.part_{k}.cutoff_squared",
            f"    on{k} = r2 < c{k}",
            f"    at{k} = wp.where(on{k}, r2, real(0.5) * c{k})",
            f"    f{k} = term_{k}(i, j, x_ij, at{k}, d.part_{k}, p.part_{k})",
            f"    w{k} = wp.where(on{k}, real(1.0), real(0.0))",
        ]
    lines.append("    return " + " + ".join(f"w{k} * f{k}" for k in range(len(terms))))
    namespace = {
        "wp": wp, "real": precision.scalar, "vec3": precision.vec3, "Data": data, "Params": params,
        **{f"term_{k}": term.function for k, term in enumerate(terms)},
    }  # fmt: skip
    # Emitted behind the terms, which may themselves stand behind the adjoints they call.
    made = function_from_source("\n".join(lines) + "\n", namespace, after_gradients=True)
    roundings = [term.rounding for term in terms]
    rounding = "any" if all(each == "any" for each in roundings) else "fused"
    return Term(made, terms[0].width, terms[0].direction, rounding)


def pair_kernel(
    term: Term, store: wp.Function, data: Any, params: Any, out: Any, precision: Precision,
    periodic: Periodicity, partners: str, vectorised: bool,
) -> wp.Kernel:  # fmt: skip
    """Kernel: for every slot, sum ``term`` over its partners and hand the sum to ``store``.

    ``store(i, particle, total, d, p, o)`` writes row i of the outputs in slot order, or row
    ``particle`` of the state's. Rows of the launch are slots, or clusters where it is vectorised.
    """
    key = (term, store, precision.name, tuple(periodic), partners, vectorised)
    if key not in _KERNELS:
        types = (data, params, out)
        sums = sums_over_partners(term, store, *types, precision, periodic, partners, vectorised)
        flags = FLAGS[term.rounding] if vectorised else ""
        mark = functools.partial(register, cpu_only=vectorised, flags=flags)
        _KERNELS[key] = _pair_kernel(sums, *types, precision, mark)
    return _KERNELS[key]


_KERNELS: dict[tuple, wp.Kernel] = {}


def sums_over_partners(
    term: Term, store: wp.Function, data: Any, params: Any, out: Any, precision: Precision,
    periodic: Periodicity, partners: str, vectorised: bool,
) -> wp.Function:  # fmt: skip
    """``sums(c, pairs, box, d, p, o)``: the sums of cluster c, handed to ``store``."""
    make = packed_loop if vectorised else _plain_sums
    return make(term, store, data, params, out, precision, periodic, partners)


def _plain_sums(term, store, data, params, out, precision, periodic, partners) -> wp.Function:
    """What ``packed_loop`` makes, of slots that are clusters of their own."""
    Box = box_type(precision)
    loop = plain_loop(term, data, params, precision, periodic, partners)

    def plain(c: int, pairs: Pairs, box: Box, d: data, p: params, o: out):
        store(c, pairs.order[c], loop(c, pairs, box, d, p), d, p, o)

    return function(plain, after_gradients=True)


def _pair_kernel(sums, data, params, out, precision, mark) -> wp.Kernel:
    Box = box_type(precision)

    @mark
    def sum_over_partners(
        first: int,
        pairs: Pairs,
        box: wp.array(dtype=Box),
        parameters: wp.array(dtype=params),
        d: data,
        o: out,
    ):
        c = first + wp.tid()
        w = pairs.world[pairs.lead[c]]
        sums(c, pairs, box[w], d, parameters[w], o)

    return sum_over_partners


@functools.cache
def add_force(precision: Precision, data: Any, params: Any, out: Any) -> wp.Function:
    """Store: f += sum."""
    vec3 = precision.vec3

    def add_to_force(i: int, particle: int, total: vec3, d: data, p: params, o: out):
        o.f[particle] = o.f[particle] + total

    return function(add_to_force)


@functools.cache
def store_measure(precision: Precision, data: Any, params: Any, out: Any) -> wp.Function:
    """Store: the particle's share of energy and virial."""
    pair2 = precision.vector(2)

    def keep_measure(i: int, particle: int, total: pair2, d: data, p: params, o: out):
        o.energy[particle] = o.energy[particle] + wp.float64(total[0])
        o.virial[particle] = o.virial[particle] + wp.float64(total[1])

    return function(keep_measure)


@functools.cache
def store_energy(precision: Precision, data: Any, params: Any, out: Any) -> wp.Function:
    """Store: the particle's share of energy."""
    one = precision.vector(1)

    def keep_energy(i: int, particle: int, total: one, d: data, p: params, o: out):
        o.energy[particle] = o.energy[particle] + wp.float64(total[0])

    return function(keep_energy)


@functools.cache
def store_stress(precision: Precision, data: Any, params: Any, out: Any) -> wp.Function:
    """Store: the particle's share of energy and of the virial as a tensor."""
    seven = precision.vector(1 + len(AXES))

    def keep_stress(i: int, particle: int, total: seven, d: data, p: params, o: out):
        o.energy[particle] = o.energy[particle] + wp.float64(total[0])
        own = Tensor()
        for k in range(wp.static(len(AXES))):
            own[k] = wp.float64(total[1 + k])
        o.stress[particle] = o.stress[particle] + own

    return function(keep_stress)


# Where the result of a sum goes: the row of the slot, or on top of what the particle's row holds.
KEEP, ADD = "o.sum[i] = {}", "o.sum[particle] = o.sum[particle] + {}"


def sum_store(
    then: wp.Function | None, arguments: list[str], width: int, place: str, kind: Any,
    fields: Mapping[str, Any], precision: Precision, data: Any, params: Any, out: Any,
) -> wp.Function:  # fmt: skip
    """Store: the sum, or what the law ``then`` makes of it, into its place in ``o.sum``.

    ``kind`` is the type of that array's entries, ``fields`` are as for :func:`sum_term`.
    """
    value = "total[0]" if width == 1 else "total"
    if then is not None:
        value = f"then({', '.join(arguments)})"
    if kind in (wp.float32, wp.float64):
        value = f"kind({value})"
    source = (
        "def sum_store(i: int, particle: int, total: Total, d: Data, p: Params, o: Out):\n"
        f"    {place.format(value)}\n"
    )
    namespace = {
        "then": then, "kind": kind, "Total": precision.vector(width), "Data": data,
        "Params": params, "Out": out, **_readers(fields, precision),
    }  # fmt: skip
    return function_from_source(source, namespace, after_gradients=True)
