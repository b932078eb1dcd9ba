"""Laws asked at chosen arguments, in double precision, apart from any simulation."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import warp as wp

from ..engine.model import Model
from ..kernels.interactions.pair import values_kernel
from ..kernels.precision import FLOAT64, annotation, structure
from .arguments import QUANTITIES, Arguments


def values(
    arguments: Arguments, given: Mapping[str, np.ndarray], returns: Any, count: int
) -> np.ndarray:
    """A law's values, (k,) or of one that ``returns`` a ``wp.vec3d`` (k, 3).

    Args:
        arguments: Of the law.
        given: The law's parameters by name, (k,) or (k, 3); those left out have their own values.
        returns: What the law is to return.
        count: k.
    """
    law = arguments.law
    kinds = {name: annotation(kind, FLOAT64) for name, kind in law.parameters.items()}
    kinds = {name: wp.int32 if kind is int else kind for name, kind in kinds.items()}
    Params = structure("TrialValues", kinds)
    host = np.zeros(count, dtype=Params.numpy_dtype())
    for name in kinds:
        host[name] = given[name] if name in given else arguments.values[name]
    kernel = values_kernel(law.function(FLOAT64), tuple(kinds), Params, returns)
    found = wp.empty(len(host), dtype=returns, device="cpu")
    wp.launch(
        kernel, len(host), [wp.array(host, dtype=Params, device="cpu")], [found], device="cpu"
    )
    return found.numpy()


def quantity(model: Model, rows: np.ndarray, name: str) -> np.ndarray:
    """A quantity of these particles at the start; what is not known before a step is 1."""
    if name in model.attributes or name in QUANTITIES - {"density"}:
        return model.column(name)[rows]
    return np.ones(len(rows))


def of_pairs(
    arguments: Arguments, r: np.ndarray, pairs: Mapping[str, np.ndarray], order: str = "ij"
) -> np.ndarray:
    """A pair's law at distances r.

    Args:
        arguments: Of the law, the distance left out.
        r: (k,) [length].
        pairs: Quantities of both by name, (k, 2) or (k, 2, 3).
        order: What the first and the second particle are called.
    """
    given = {next(iter(arguments.law.parameters)): r}
    for name, (kind, source) in zip(arguments.names, arguments.sources, strict=True):
        if kind != "parameter":
            given[name] = pairs[source][:, order.index(kind[-1])]
    return values(arguments, given, wp.float64, len(r))
