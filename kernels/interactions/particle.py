"""Forces and energies of single particles, from laws."""

import functools
from typing import Any

import warp as wp

from ..precision import Precision, function_from_source, register

_SOURCE = """def {name}(i: int, w: int, d: Data, p: Params):
    return law({arguments})
"""


def _evaluation(
    name: str, law: wp.Function, arguments: tuple[str, ...], precision: Precision, data: Any,
    params: Any,
) -> wp.Function:  # fmt: skip
    namespace = {"law": law, "real": precision.scalar, "Data": data, "Params": params}
    return function_from_source(
        _SOURCE.format(name=name, arguments=", ".join(arguments)), namespace
    )


@functools.cache
def force_kernel(
    law: wp.Function, arguments: tuple[str, ...], precision: Precision, data: Any, params: Any
) -> wp.Kernel:
    """Kernel: f += law(...) on each member."""
    evaluate = _evaluation("force_on", law, arguments, precision, data, params)

    @register
    def particle_force(
        first: int,
        members: wp.array(dtype=wp.int32),
        world: wp.array(dtype=wp.int32),
        parameters: wp.array(dtype=params),
        d: data,
        f_io: wp.array(dtype=precision.vec3),
    ):
        k = first + wp.tid()
        i = members[k]
        w = world[k]
        f_io[i] = f_io[i] + evaluate(i, w, d, parameters[w])

    return particle_force


@functools.cache
def energy_kernel(
    law: wp.Function, arguments: tuple[str, ...], precision: Precision, data: Any, params: Any
) -> wp.Kernel:
    """Kernel: energy += law(...) of each member."""
    evaluate = _evaluation("energy_of", law, arguments, precision, data, params)

    @register
    def particle_energy(
        first: int,
        members: wp.array(dtype=wp.int32),
        world: wp.array(dtype=wp.int32),
        parameters: wp.array(dtype=params),
        d: data,
        energy_io: wp.array(dtype=wp.float64),
    ):
        k = first + wp.tid()
        i = members[k]
        w = world[k]
        energy_io[i] = energy_io[i] + wp.float64(evaluate(i, w, d, parameters[w]))

    return particle_energy
