"""How CPU threads share the chunks of a launch: in native code, without Python's lock.

Taking the lock wakes a sleeping thread, which costs more than many a launch. A *board* in shared
memory says what is to be done. ``state`` counts posts in its upper half and, in its lower half, the
chunks of the latest post that have been taken from the front (16 bits) and from the back (16 bits):
one atomic increment takes a chunk and tells of which post it is, so that a thread that comes late
never runs a chunk twice or of the wrong launch. The caller takes from the front and its first
worker from the back, so that a particle mostly stays with one thread, and in its cache.
"""

import functools

import warp as wp

from .precision import native, register

# Words of the board: state, chunks done, leave, then post after post, in turn: table and count.
STATE, DONE, LEAVE, POSTS, RING = 0, 1, 2, 8, 64

_SHARED = f"""
    unsigned long long* b = (unsigned long long*)board.data;
    typedef void (*entry)(void*, void*);
    auto left = [](unsigned long long state, unsigned long long count) -> bool {{
        return (state & 0xffffull) + (state >> 16 & 0xffffull) < count;
    }};
    auto take = [&]() -> bool {{
        const unsigned long long now = __atomic_load_n(b + {STATE}, __ATOMIC_ACQUIRE);
        const unsigned long long* seen = b + {POSTS} + 2 * ((now >> 32) % {RING});
        if (!left(now, __atomic_load_n(seen + 1, __ATOMIC_ACQUIRE))) return false;
        const unsigned long long step = back ? 1ull << 16 : 1ull;
        const unsigned long long got = __atomic_fetch_add(b + {STATE}, step, __ATOMIC_ACQ_REL);
        const unsigned long long* post = b + {POSTS} + 2 * ((got >> 32) % {RING});
        if (!left(got, post[1])) return true;
        const unsigned long long k = back ? post[1] - 1 - (got >> 16 & 0xffffull) : got & 0xffffull;
        const unsigned long long* chunk = (const unsigned long long*)post[0] + 3 * k;
        ((entry)chunk[0])((void*)chunk[1], (void*)chunk[2]);
        __atomic_fetch_add(b + {DONE}, 1ull, __ATOMIC_ACQ_REL);
        return true;
    }};
"""


@functools.cache
def serve_kernel() -> wp.Kernel:
    """Kernel of a worker: take chunks as they are posted, until none came for so many looks."""
    snippet = f"""{_SHARED}
    for (int k = 0; k < looks && !__atomic_load_n(b + {LEAVE}, __ATOMIC_RELAXED); ++k)
        if (take()) k = 0;
"""

    def serve_chunks(board: wp.array(dtype=wp.uint64), looks: int, back: int): ...

    act = native(serve_chunks, snippet, after_gradients=False)

    @functools.partial(register, cpu_only=True)
    def serve(first: int, board: wp.array(dtype=wp.uint64), looks: int, back: int):
        act(board, looks, back)

    return serve


@functools.cache
def share_kernel() -> wp.Kernel:
    """Kernel of the caller: take chunks of the latest post, then wait a while for the others."""
    snippet = f"""{_SHARED}
    while (take()) {{}}
    const unsigned long long now = __atomic_load_n(b + {STATE}, __ATOMIC_ACQUIRE);
    const unsigned long long count = b[{POSTS} + 2 * ((now >> 32) % {RING}) + 1];
    for (int k = 0; k < looks && __atomic_load_n(b + {DONE}, __ATOMIC_ACQUIRE) < count; ++k) {{}}
"""

    def share_chunks(board: wp.array(dtype=wp.uint64), looks: int, back: int): ...

    act = native(share_chunks, snippet, after_gradients=False)

    @functools.partial(register, cpu_only=True)
    def share(first: int, board: wp.array(dtype=wp.uint64), looks: int, back: int):
        act(board, looks, back)

    return share
