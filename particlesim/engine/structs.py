"""Structs of arrays that kernels take."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import warp as wp

from ..kernels.precision import structure


def structure_of(name: str, arrays: Mapping[str, wp.array]) -> Any:
    """The struct that holds arrays of these types."""
    return structure(name, {field: wp.array(dtype=each.dtype) for field, each in arrays.items()})


def filled(kind: Any, arrays: Mapping[str, wp.array]) -> Any:
    """An instance of a struct with its arrays set."""
    result = kind()
    for name, array in arrays.items():
        setattr(result, name, array)
    return result
