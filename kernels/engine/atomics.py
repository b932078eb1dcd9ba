"""What threads may do to the same place at once, whatever the order: sums and maxima.

Warp's own are atomic on CUDA only; a launch that threads of the CPU share needs these.
"""

import warp as wp

from ..precision import native
from ..warp_internals import elements


def add_function() -> wp.Function:
    """``add(k, value, sums)``: whole numbers, whose sum is the same in any order."""
    snippet = f"""
    long long* at = {elements("sums_io", "long long")} + k;
#if defined(__CUDA_ARCH__)
    atomicAdd((unsigned long long*)at, (unsigned long long)value);
#else
    __atomic_fetch_add(at, (long long)value, __ATOMIC_RELAXED);
#endif
"""

    def add(k: int, value: wp.int64, sums_io: wp.array(dtype=wp.int64)): ...

    return native(add, snippet, after_gradients=False)


def rise_function() -> wp.Function:
    """``rise(k, value, most)``: entry k becomes value, at least 0, if that is more."""
    snippet = f"""
    // Numbers that are not negative are in the order of their bits.
    int* at = (int*){elements("most_io", "float")} + k;
    int bits;
    memcpy(&bits, &value, sizeof(bits));
#if defined(__CUDA_ARCH__)
    if (bits > *at) atomicMax(at, bits);
#else
    int now = __atomic_load_n(at, __ATOMIC_RELAXED);
    while (bits > now && !__atomic_compare_exchange_n(
        at, &now, bits, true, __ATOMIC_RELAXED, __ATOMIC_RELAXED)) {{}}
#endif
"""

    def rise(k: int, value: wp.float32, most_io: wp.array(dtype=wp.float32)): ...

    return native(rise, snippet, after_gradients=False)
