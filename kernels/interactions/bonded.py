"""Forces of laws of given tuples: every particle gathers over its own, so nothing collides."""

import functools
from dataclasses import dataclass
from typing import Any

import warp as wp

from ..engine.loops import Periodicity, box_type, minimum_image
from ..precision import Precision, function, function_from_source, register, structure
from ..tensor import virial_function, virial_type
from .coordinates import steps_type


@dataclass(frozen=True)
class Bonds:
    """What the kernels of some tuples are made for."""

    law: wp.Function  # u(q, ...)
    arguments: tuple[str, ...]  # source of what comes after q, in terms of ids, d and p
    coordinate: wp.Function  # see ``coordinates``
    size: int  # particles of a tuple
    damped: bool  # with a force -p.damping dq/dt beside du/dq
    precision: Precision
    periodic: Periodicity
    data: Any
    params: Any

    @property
    def types(self) -> tuple[Any, Any, Any]:
        """Rows, steps and box."""
        precision = self.precision
        return rows_type(self.size), steps_type(precision, self.size), box_type(precision)


def indices_type(size: int) -> Any:
    """The particles of a tuple."""
    return wp.types.vector(length=size, dtype=wp.int32)


def rows_type(size: int) -> Any:
    """The tuples of every particle that is in one: row k is particle ``particle[k]``.

    A tuple stands in the row of each of its particles, with its parameters, so that what a thread
    reads of it lies together.
    """
    one = wp.array(dtype=wp.int32)
    fields = {
        "particle": one, "world": one, "begin": one, "ids": wp.array(dtype=indices_type(size)),
    }  # fmt: skip
    return structure(f"Rows{size}", fields)


def _view(bonds: Bonds) -> wp.Function:
    """``view(ids, b, d, p) -> (u, g, T, E)``: of a tuple the energy, the slope of it by the
    coordinate, how that answers to the steps, and these.
    """
    _Rows, Steps, Box = bonds.types
    Indices = indices_type(bonds.size)
    size, damped, real = bonds.size, bonds.damped, bonds.precision.scalar
    data, params, coordinate = bonds.data, bonds.params, bonds.coordinate
    image = minimum_image(bonds.precision, bonds.periodic)
    call = ", ".join(["q", *bonds.arguments])
    slopes = ", ".join(f"g{k}" for k in range(len(bonds.arguments) + 1))
    namespace = {
        "wp": wp, "law": bonds.law, "real": real, "Indices": Indices, "Data": data,
        "Params": params,
    }  # fmt: skip
    derived = function_from_source(
        "def bonded_law(q: real, ids: Indices, d: Data, p: Params):\n"
        f"    {slopes} = wp.grad(law)({call})\n    return law({call}), g0\n",
        namespace, after_gradients=True,
    )  # fmt: skip

    def bonded_view(ids: Indices, b: Box, d: data, p: params):
        E = Steps()
        for e in range(wp.static(size - 1)):
            E[e] = image(d.x[ids[e + 1]] - d.x[ids[e]], b)
        q, T = coordinate(E)
        u, g = derived(q, ids, d, p)
        if wp.static(damped):
            rate = real(0.0)
            for e in range(wp.static(size - 1)):
                rate += wp.dot(T[e], d.v[ids[e + 1]] - d.v[ids[e]])
            g = g + p.damping * rate
        return u, g, T, E

    return function(bonded_view, after_gradients=True)


@functools.cache
def force_kernel(bonds: Bonds) -> wp.Kernel:
    """Kernel: f_a -= g dq/dx_a, where g = du/dq."""
    Rows, _Steps, Box = bonds.types
    vec3, real, size = bonds.precision.vec3, bonds.precision.scalar, bonds.size
    view, data, params = _view(bonds), bonds.data, bonds.params

    @register
    def bonded_force(
        first: int,
        rows: Rows,
        parameters: wp.array(dtype=params),
        box: wp.array(dtype=Box),
        d: data,
        f_io: wp.array(dtype=vec3),
    ):
        k = first + wp.tid()
        i = rows.particle[k]
        b = box[rows.world[k]]
        total = f_io[i]
        for n in range(rows.begin[k], rows.begin[k + 1]):
            ids = rows.ids[n]
            _u, g, T, _E = view(ids, b, d, parameters[n])
            for e in range(wp.static(size - 1)):
                total = total + T[e] * wp.where(
                    ids[e] == i, g, wp.where(ids[e + 1] == i, -g, real(0.0))
                )
        f_io[i] = total

    return bonded_force


@functools.cache
def measure_kernel(bonds: Bonds, tensor: bool) -> wp.Kernel:
    """Kernel: energy and virial -sum_e g T_e . E_e, to each of a tuple's particles its share.

    ``tensor``: the virial -sum_e g T_e E_e^T, which has no antisymmetric part.
    """
    Rows, _Steps, Box = bonds.types
    size, view, kind = bonds.size, _view(bonds), virial_type(tensor)
    data, params, virial = bonds.data, bonds.params, virial_function(bonds.precision, tensor)

    @register
    def bonded_measure(
        first: int,
        rows: Rows,
        parameters: wp.array(dtype=params),
        box: wp.array(dtype=Box),
        d: data,
        energy_io: wp.array(dtype=wp.float64),
        virial_io: wp.array(dtype=kind),
    ):
        k = first + wp.tid()
        i = rows.particle[k]
        b = box[rows.world[k]]
        share = wp.float64(wp.static(1.0 / size))
        for n in range(rows.begin[k], rows.begin[k + 1]):
            u, g, T, E = view(rows.ids[n], b, d, parameters[n])
            energy_io[i] = energy_io[i] + wp.float64(u) * share
            for e in range(wp.static(size - 1)):
                virial_io[i] = virial_io[i] + virial(-g * T[e], E[e]) * share

    return bonded_measure
