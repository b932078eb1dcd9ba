"""Forces and energies of single particles, from laws."""

import functools
from typing import Any

import warp as wp

from ..precision import Precision, function_from_source, register


def _evaluation(
    law: wp.Function, arguments: tuple[str, ...], precision: Precision, data: Any, params: Any,
    derived: int | None = None,
) -> wp.Function:  # fmt: skip
    """The law of particle i, or minus its derivative by one of its arguments."""
    call = f"({', '.join(arguments)})"
    lines = [f"return law{call}"]
    if derived is not None:
        gradients = ", ".join(f"g{k}" for k in range(len(arguments)))
        lines = [f"{gradients} = wp.grad(law){call}", f"return -g{derived}"]
    source = "\n    ".join(["def law_of(i: int, w: int, d: Data, p: Params):", *lines, ""])
    namespace = {
        "wp": wp, "law": law, "real": precision.scalar, "Data": data, "Params": params
    }  # fmt: skip
    # Behind the adjoints that it, or the law, may call.
    return function_from_source(source, namespace, after_gradients=True)


@functools.cache
def force_kernel(
    law: wp.Function, arguments: tuple[str, ...], derived: int | None, precision: Precision,
    data: Any, params: Any,
) -> wp.Kernel:  # fmt: skip
    """Kernel: f += law(...) on each member, or minus its derivative by argument ``derived``."""
    evaluate = _evaluation(law, arguments, precision, data, params, derived)

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
    evaluate = _evaluation(law, arguments, precision, data, params)

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
