"""Random numbers by counting: each is a function of a key and a counter, and of nothing else.

Philox4x32-10 (Salmon, Moraes, Dror and Shaw 2011). Whoever draws counts by what is his
own, as the number of a particle and that of a substep, so that the numbers do not depend on
threads, on worlds beside or on where a run was begun.
"""

import functools

import warp as wp

from .precision import Precision, function


@function
def philox(counter: wp.vec4ui, key: wp.vec2ui) -> wp.vec4ui:
    """Four random 32-bit numbers."""
    c0, c1, c2, c3 = counter[0], counter[1], counter[2], counter[3]
    k0, k1 = key[0], key[1]
    rounds = int(10)  # a loop, which compiles faster than ten times its body
    for _ in range(rounds):
        p = wp.uint64(c0) * wp.uint64(0xD2511F53)
        q = wp.uint64(c2) * wp.uint64(0xCD9E8D57)
        high_p, high_q = wp.uint32(p >> wp.uint64(32)), wp.uint32(q >> wp.uint64(32))
        c0, c2 = high_q ^ c1 ^ k0, high_p ^ c3 ^ k1
        c1, c3 = wp.uint32(q & wp.uint64(0xFFFFFFFF)), wp.uint32(p & wp.uint64(0xFFFFFFFF))
        # Literals of 32 bits would be signed.
        k0 += wp.uint32(wp.uint64(0x9E3779B9))
        k1 += wp.uint32(wp.uint64(0xBB67AE85))
    return wp.vec4ui(c0, c1, c2, c3)


@functools.cache
def uniform_function(precision: Precision) -> wp.Function:
    """``uniform(bits) -> u``: a number above 0, at most 1, of 32 random bits."""
    real = precision.scalar

    def uniform(bits: wp.uint32):
        return (real(bits) + real(0.5)) * real(2.3283064365386963e-10)  # 2^-32

    return function(uniform)


@functools.cache
def normal_function(precision: Precision) -> wp.Function:
    """``normal(a, b) -> vec2``: two independent normal numbers of 2 x 32 random bits.

    (Box and Muller 1958.) At most 6.8: what is beyond has a probability of 1e-11.
    """
    real, Pair = precision.scalar, precision.vector(2)
    uniform = uniform_function(precision)

    def normal(a: wp.uint32, b: wp.uint32):
        radius = wp.sqrt(real(-2.0) * wp.log(uniform(a)))
        angle = real(6.283185307179586) * uniform(b)
        return Pair(radius * wp.cos(angle), radius * wp.sin(angle))

    return function(normal)


@functools.cache
def gamma_function(precision: Precision) -> wp.Function:
    """``gamma(shape, counter, key) -> g``: of the gamma distribution of that shape, at least 1.

    (Marsaglia and Tsang 2000.) Of some twenty draws that are refused, each with a
    probability under 5 %, the last one stands. The counter's last number is counted on.
    """
    real = precision.scalar
    normal, uniform = normal_function(precision), uniform_function(precision)

    def gamma(shape: real, counter: wp.vec4ui, key: wp.vec2ui):
        d = shape - real(1.0) / real(3.0)
        c = real(1.0) / wp.sqrt(real(9.0) * d)
        g = d
        found = bool(False)
        for k in range(20):
            if not found:
                at = wp.vec4ui(counter[0], counter[1], counter[2], counter[3] + wp.uint32(k))
                bits = philox(at, key)
                x = normal(bits[0], bits[1])[0]
                v = (real(1.0) + c * x) * (real(1.0) + c * x) * (real(1.0) + c * x)
                if v > real(0.0):
                    g = d * v
                    found = wp.log(uniform(bits[2])) < real(0.5) * x * x + d - d * v + d * wp.log(v)
        return g

    return function(gamma)
