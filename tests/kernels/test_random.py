"""Random numbers by counting, against the known answers that come with the generator."""

import numpy as np
import warp as wp

from particlesim.kernels.random import philox

# Random123, kat_vectors, philox4x32 of 10 rounds: counter, key, answer.
KNOWN = (
    "00000000 00000000 00000000 00000000  00000000 00000000  6627e8d5 e169c58d bc57ac4c 9b00dbd8",
    "ffffffff ffffffff ffffffff ffffffff  ffffffff ffffffff  408f276d 41c83b0e a20bc7c6 6d5451fd",
    "243f6a88 85a308d3 13198a2e 03707344  a4093822 299f31d0  d16cfe09 94fdcceb 5001e420 24126ea1",
)


@wp.kernel(module="unique")
def draw(
    counter: wp.array(dtype=wp.vec4ui), key: wp.array(dtype=wp.vec2ui),
    out: wp.array(dtype=wp.vec4ui),
):  # fmt: skip
    i = wp.tid()
    out[i] = philox(counter[i], key[i])


def test_known_answers(device):
    words = np.array([[int(word, 16) for word in row.split()] for row in KNOWN], dtype=np.uint32)
    counter = wp.array(words[:, :4], dtype=wp.vec4ui, device=device)
    key = wp.array(words[:, 4:6], dtype=wp.vec2ui, device=device)
    out = wp.zeros(len(words), dtype=wp.vec4ui, device=device)
    wp.launch(draw, len(words), [counter, key, out], device=device)
    np.testing.assert_array_equal(out.numpy(), words[:, 6:])
