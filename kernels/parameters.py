"""Values of parameters as kernels take them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import warp as wp

from .precision import Precision, structure


def parameter_types(values: Mapping[str, Any], precision: Precision) -> dict[str, Any]:
    """What kernels take these values of parameters as, by name.

    Whole numbers, numbers, (3,) vectors, arrays of a device, or a dict of such: a struct within.
    """
    return {name: _parameter_type(name, value, precision) for name, value in values.items()}


def _parameter_type(name: str, value: Any, precision: Precision) -> Any:
    if isinstance(value, Mapping):
        return structure(f"Inner_{name}", parameter_types(value, precision))
    if isinstance(value, wp.array):
        return wp.array(dtype=value.dtype, ndim=value.ndim)
    value = np.asarray(value)
    if value.dtype == np.uint64:  # of what Warp looks for in a mesh
        return wp.uint64
    if np.issubdtype(value.dtype, np.integer):
        return wp.int32
    return precision.vec3 if np.ndim(value) == 1 else precision.scalar


def structures(kind: Any, columns: Mapping[str, Any], device: Any) -> wp.array:
    """An array of structs from a column of values for each field; arrays stay the giver's."""
    host = np.zeros(len(next(iter(columns.values()))), dtype=kind.numpy_dtype())
    _fill(host, columns)
    return wp.array(host, dtype=kind, device=device)


def _fill(host: np.ndarray, columns: Mapping[str, Any]) -> None:
    for name, column in columns.items():
        if not len(column):
            continue
        if isinstance(column[0], Mapping):
            _fill(host[name], by_name(column))
        elif isinstance(column[0], wp.array):
            host[name] = [each.__ctype__().numpy_value() for each in column]
        else:
            host[name] = column


def by_name(rows: Sequence[Mapping[str, Any]]) -> dict[str, list[Any]]:
    """Columns of rows that have the same names."""
    return {name: [row[name] for row in rows] for name in rows[0]}


def numbers(columns: Mapping[str, Any]) -> dict[str, np.ndarray]:
    """The columns of numbers and vectors, those of structs within them too, by their names."""
    found: dict[str, np.ndarray] = {}
    for name, column in columns.items():
        if isinstance(column[0], Mapping):
            inner = numbers(by_name(column))
            found |= {f"{name}.{key}": value for key, value in inner.items()}
        elif not isinstance(column[0], wp.array | np.uint64):
            found[name] = np.array(column)
    return found
