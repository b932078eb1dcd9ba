"""How CPU threads share launches, one after the other: in native code, without Python's lock.

Taking the lock wakes a sleeping thread, which costs more than many a launch. The caller works
through the *stages* of a chain, each a launch: it runs one that is not cut itself, and *posts* the
chunks of the others on a *board* in shared memory for whoever is free. The board's ``state`` holds,
16 bits each, the number of the post, how many chunks it has, and how many were taken from the back
and from the front. One atomic increment takes a chunk and returns all four: whoever comes late is
told by the very same word that nothing is left, or takes a chunk of the post that is current, and
never one twice or of another launch. The next stage begins when all chunks of this one are done.
The caller takes from the front and its first worker from the back, so that a particle mostly stays
with one thread, and in its cache.
"""

import functools

import warp as wp

from ..precision import native, register
from ..warp_internals import RUN_PACKED, elements

# Words of the board: state, chunks done, leave, the stage that the caller is at, how many are left
# and whether this one has been posted, then the chunks of the latest posts in turn. A stage is two
# words, the address of its chunks and their number; a chunk is three, see ``run``.
STATE, DONE, LEAVE, STAGE, LEFT, POSTED, POSTS, RING = 0, 1, 2, 3, 4, 5, 8, 64

_SHARED = f"""
    unsigned long long* b = {elements("board", "unsigned long long")};
    auto run = [](const unsigned long long* packed) {{ {RUN_PACKED}; }};
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
        run((const unsigned long long*)table + 3 * k);
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
    """Kernel of the caller: go through the stages left, and wait a while for others' last chunks.

    It may return with stages left, where a worker is held up; then it is called again.
    """
    snippet = f"""{_SHARED}
    for (; b[{LEFT}]; b[{STAGE}] += 2 * sizeof(unsigned long long), --b[{LEFT}]) {{
        const unsigned long long* stage = (const unsigned long long*)b[{STAGE}];
        const unsigned long long count = stage[1];
        if (count == 1) {{
            run((const unsigned long long*)stage[0]);
            continue;
        }}
        if (!b[{POSTED}]) {{
            const unsigned long long post = (b[{STATE}] >> 48) + 1;
            b[{POSTS} + (post & 0xffffull) % {RING}] = stage[0];
            __atomic_store_n(b + {DONE}, 0ull, __ATOMIC_RELEASE);
            __atomic_store_n(b + {STATE}, post << 48 | count << 32, __ATOMIC_RELEASE);
            b[{POSTED}] = 1;
        }}
        while (take()) {{}}
        int k = 0;
        while (__atomic_load_n(b + {DONE}, __ATOMIC_ACQUIRE) < count)
            if (++k > looks) return;
        b[{POSTED}] = 0;
    }}
"""

    def share_chunks(board: wp.array(dtype=wp.uint64), looks: int, back: int): ...

    act = native(share_chunks, snippet, after_gradients=False)

    @functools.partial(register, cpu_only=True)
    def share(first: int, board: wp.array(dtype=wp.uint64), looks: int, back: int):
        act(board, looks, back)

    return share
