"""How CPU threads share the chunks of a launch: in native code, without Python's lock.

Taking the lock wakes a sleeping thread, which costs more than many a launch. A *board* in shared
memory says what is to be done. Its ``state`` holds, 16 bits each, the number of the post, how many
chunks it has, and how many were taken from the back and from the front. One atomic increment takes
a chunk and returns all four: whoever comes late is told by the very same word that nothing is left,
or takes a chunk of the post that is current, and never one twice or of another launch.
The caller takes from the front and its first
worker from the back, so that a particle mostly stays with one thread, and in its cache.
"""

import functools

import warp as wp

from .precision import native, register

# Words of the board: state, chunks done, leave, the post to be made (table and count; none if 0),
# then the tables of the latest posts in turn. A table stays until all of its chunks are done.
STATE, DONE, LEAVE, TABLE, COUNT, POSTS, RING = 0, 1, 2, 3, 4, 8, 64

_SHARED = f"""
    unsigned long long* b = (unsigned long long*)board.data;
    typedef void (*entry)(void*, void*);
    auto left = [](unsigned long long state) -> bool {{
        return (state & 0xffffull) + (state >> 16 & 0xffffull) < (state >> 32 & 0xffffull);
    }};
    auto take = [&]() -> bool {{
        if (!left(__atomic_load_n(b + {STATE}, __ATOMIC_ACQUIRE))) return false;
        const unsigned long long step = back ? 1ull << 16 : 1ull;
        const unsigned long long got = __atomic_fetch_add(b + {STATE}, step, __ATOMIC_ACQ_REL);
        if (!left(got)) return true;
        const unsigned long long last = (got >> 32 & 0xffffull) - 1;
        const unsigned long long k = back ? last - (got >> 16 & 0xffffull) : got & 0xffffull;
        const unsigned long long table = b[{POSTS} + (got >> 48) % {RING}];
        const unsigned long long* chunk = (const unsigned long long*)table + 3 * k;
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
    """Kernel of the caller: make the post, take chunks of it, then wait a while for the others."""
    snippet = f"""{_SHARED}
    if (b[{COUNT}]) {{
        const unsigned long long post = (b[{STATE}] >> 48) + 1;
        b[{POSTS} + post % {RING}] = b[{TABLE}];
        __atomic_store_n(b + {DONE}, 0ull, __ATOMIC_RELEASE);
        __atomic_store_n(b + {STATE}, post << 48 | b[{COUNT}] << 32, __ATOMIC_RELEASE);
        b[{COUNT}] = 0;
    }}
    while (take()) {{}}
    const unsigned long long count = b[{STATE}] >> 32 & 0xffffull;
    for (int k = 0; k < looks && __atomic_load_n(b + {DONE}, __ATOMIC_ACQUIRE) < count; ++k) {{}}
"""

    def share_chunks(board: wp.array(dtype=wp.uint64), looks: int, back: int): ...

    act = native(share_chunks, snippet, after_gradients=False)

    @functools.partial(register, cpu_only=True)
    def share(first: int, board: wp.array(dtype=wp.uint64), looks: int, back: int):
        act(board, looks, back)

    return share
