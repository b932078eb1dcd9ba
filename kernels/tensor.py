"""Virials: numbers r.F, or symmetric tensors of six, xx, yy, zz, yz, xz, xy (Voigt's order)."""

from typing import Any

import numpy as np
import warp as wp

from .precision import FLOAT64, Precision, function

AXES = ((0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1))
Tensor = FLOAT64.vector(len(AXES))  # of one particle, in float64


def virial_type(tensor: bool) -> Any:
    """What a particle's virial is kept as."""
    return Tensor if tensor else wp.float64


def virial_function(precision: Precision, tensor: bool) -> wp.Function:
    """``virial(f, d)``: the product f.d, or the symmetric part of f d^T, in float64."""
    vec3, double = precision.vec3, wp.float64

    def number(f: vec3, d: vec3):
        return double(wp.dot(f, d))

    def six(f: vec3, d: vec3):
        x, y, z = double(d[0]), double(d[1]), double(d[2])
        a, b, c, half = double(f[0]), double(f[1]), double(f[2]), double(0.5)
        return Tensor(
            a * x, b * y, c * z, half * (b * z + c * y), half * (a * z + c * x),
            half * (a * y + b * x),
        )  # fmt: skip

    return function(six if tensor else number)


def matrices(six: np.ndarray) -> np.ndarray:
    """Of rows of six the symmetric matrices, (n, 3, 3)."""
    result = np.zeros((len(six), 3, 3))
    for k, (a, b) in enumerate(AXES):
        result[:, a, b] = result[:, b, a] = six[:, k]
    return result
