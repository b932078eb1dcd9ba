"""Waiting in native code, where no Python lock is held."""

import functools

import warp as wp

from .precision import native, register


@functools.cache
def wait_kernel() -> wp.Kernel:
    """Kernel: come back when the flag differs from a value, or after so many looks."""
    snippet = """
    const volatile int* p = flag.data;
    for (int k = 0; k < looks && *p == value; ++k) {}
"""

    def look_at(flag: wp.array(dtype=wp.int32), value: int, looks: int): ...

    look = native(look_at, snippet, after_gradients=False)

    @register
    def wait_for_change(first: int, flag: wp.array(dtype=wp.int32), value: int, looks: int):
        look(flag, value, looks)

    return wait_for_change
