"""Copies and zeros as kernels, which CPU threads can share."""

import functools
from typing import Any

import warp as wp

from ..precision import native, register
from ..warp_internals import elements

BLOCK = 256  # rows that a thread of the CPU takes at once


@functools.cache
def copy_kernel(dtype: Any, block: int = 1) -> wp.Kernel:
    """Kernel: target = source, row by row, or ``block`` rows by a thread."""

    def copy_natively(
        first: int, last: int, source: wp.array(dtype=dtype), target: wp.array(dtype=dtype)
    ): ...

    there, here = _bytes("target", dtype), _bytes("source", dtype)
    copy = native(copy_natively, f"__builtin_memcpy({there}, {here}, {_size(dtype)});", False)

    @functools.partial(register, cpu_only=block > 1)
    def copy_rows(first: int, source: wp.array(dtype=dtype), target_out: wp.array(dtype=dtype)):
        i = (first + wp.tid()) * wp.static(block)
        if wp.static(block > 1):
            copy(i, wp.min(i + wp.static(block), source.shape[0]), source, target_out)
        else:
            target_out[i] = source[i]

    return copy_rows


@functools.cache
def zero_kernel(dtype: Any, block: int = 1) -> wp.Kernel:
    """Kernel: target = 0, row by row, or ``block`` rows by a thread."""

    def zero_natively(first: int, last: int, target: wp.array(dtype=dtype)): ...

    number = dtype in (wp.float32, wp.float64, wp.int32, wp.int64)  # else a vector, a struct
    snippet = f"__builtin_memset({_bytes('target', dtype)}, 0, {_size(dtype)});"
    zero = native(zero_natively, snippet, False)

    @functools.partial(register, cpu_only=block > 1)
    def zero_rows(first: int, target_out: wp.array(dtype=dtype)):
        i = (first + wp.tid()) * wp.static(block)
        if wp.static(block > 1):
            zero(i, wp.min(i + wp.static(block), target_out.shape[0]), target_out)
        else:
            if wp.static(number):
                target_out[i] = dtype(0)
            else:
                target_out[i] = dtype()

    return zero_rows


def _bytes(array: str, dtype: Any) -> str:
    """C++: where row ``first`` begins."""
    return f"{elements(array, 'char')} + {wp.types.type_size_in_bytes(dtype)} * (long long)first"


def _size(dtype: Any) -> str:
    return f"{wp.types.type_size_in_bytes(dtype)} * (long long)(last - first)"
