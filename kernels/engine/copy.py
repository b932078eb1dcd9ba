"""Copies and zeros as kernels, which CPU threads can share."""

import functools
from typing import Any

import warp as wp

from ..precision import register


@functools.cache
def copy_kernel(dtype: Any) -> wp.Kernel:
    """Kernel: target = source, row by row."""

    @register
    def copy_rows(first: int, source: wp.array(dtype=dtype), target_out: wp.array(dtype=dtype)):
        i = first + wp.tid()
        target_out[i] = source[i]

    return copy_rows


@functools.cache
def zero_kernel(dtype: Any) -> wp.Kernel:
    """Kernel: target = 0, row by row."""

    @register
    def zero_rows(first: int, target_out: wp.array(dtype=dtype)):
        target_out[first + wp.tid()] = dtype()

    return zero_rows
