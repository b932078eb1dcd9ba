"""Laws asked at given arguments, by themselves."""

import functools
from typing import Any

import warp as wp

from ..precision import function_from_source, register


@functools.cache
def values_kernel(
    law: wp.Function, names: tuple[str, ...], params: Any, returns: Any, by: int | None
) -> wp.Kernel:
    """Kernel: a law at given arguments, those of these names in ``params``; with ``by`` its
    derivative by the argument of that number.
    """
    call = ", ".join(f"p.{name}" for name in names)
    lines = [f"return law({call})"]
    if by is not None:
        gradients = ", ".join(f"g{k}" for k in range(len(names)))
        lines = [f"{gradients} = wp.grad(law)({call})", f"return g{by}"]
    source = "\n    ".join(["def value(p: Params):", *lines, ""])
    names_of = {"wp": wp, "law": law, "Params": params}
    value = function_from_source(source, names_of, after_gradients=True)

    @functools.partial(register, cpu_only=True)
    def values_of_law(given: wp.array(dtype=params), out: wp.array(dtype=returns)):
        k = wp.tid()
        out[k] = value(given[k])

    return values_of_law
