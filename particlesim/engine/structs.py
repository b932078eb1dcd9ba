"""Structs that kernels take: the same one for the same fields, so that kernels are reused."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import warp as wp

from ..kernels.precision import structure

_STRUCTS: dict[tuple[Any, ...], Any] = {}


def parameter_struct(name: str, fields: tuple[tuple[str, Any], ...]) -> Any:
    """The struct of these numbers and vectors."""
    key = (name, fields)
    if key not in _STRUCTS:
        _STRUCTS[key] = structure(name, dict(fields))
    return _STRUCTS[key]


def structure_of(name: str, arrays: Mapping[str, wp.array]) -> Any:
    """The struct that holds arrays of these types."""
    key = (name, tuple((field, wp.array, array.dtype) for field, array in arrays.items()))
    if key not in _STRUCTS:
        _STRUCTS[key] = structure(
            name, {field: wp.array(dtype=array.dtype) for field, array in arrays.items()}
        )
    return _STRUCTS[key]


def filled(kind: Any, arrays: Mapping[str, wp.array]) -> Any:
    """An instance of a struct with its arrays set."""
    result = kind()
    for name, array in arrays.items():
        setattr(result, name, array)
    return result
