"""Values of parameters as kernels take them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import warp as wp

from .precision import Precision


def parameter_types(values: Mapping[str, Any], precision: Precision) -> dict[str, Any]:
    """What kernels take these values of parameters as, by name."""
    return {name: _parameter_type(value, precision) for name, value in values.items()}


def _parameter_type(value: Any, precision: Precision) -> Any:
    if isinstance(value, wp.array):
        return wp.array(dtype=value.dtype, ndim=value.ndim)
    value = np.asarray(value)
    if value.dtype == np.uint64:  # of what Warp looks for in a mesh
        return wp.uint64
    if np.issubdtype(value.dtype, np.integer):
        return wp.int32
    return precision.vec3 if np.ndim(value) == 1 else precision.scalar


def in_memory(column: Any) -> Any:
    """A column of a struct's parameters as it lies in memory: arrays by what they are to Warp."""
    if len(column) and isinstance(column[0], wp.array):
        return [each.__ctype__().numpy_value() for each in column]
    return column
