"""Laws of a fluid's parts as its terms call them."""

from collections.abc import Mapping
from typing import Any

import warp as wp

from ...precision import Precision, function_from_source
from ...warp_internals import arguments as arguments_of


def bound_law(
    name: str, law: wp.Function, variables: tuple[str, ...], sources: Mapping[str, str],
    precision: Precision, params: Any,
) -> wp.Function:  # fmt: skip
    """``name(*variables, p)`` that calls ``law`` with, for each of its arguments, its source."""
    arguments = ", ".join(sources[argument] for argument in arguments_of(law))
    signature = ", ".join(f"{variable}: real" for variable in variables)
    source = f"def {name}({signature}, p: Params):\n    return law({arguments})\n"
    known = {"wp": wp, "law": law, "real": precision.scalar, "Params": params}
    return function_from_source(source, known)
