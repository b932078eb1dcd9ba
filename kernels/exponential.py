"""The exponential, made so that loops over it vectorise.

The C library's takes one number at a time: a law of Yukawa's or Morse's ran at a fifth of the rate
of one without. Here x = n ln 2 + r, exp(x) = 2^n exp(r), with Taylor's polynomial of r, |r| <= ln
2 / 2, whose next term is below half a unit in the last place, and 2^n by the bits of an exponent.
Below twice the smallest normal number it is 0. Laws have ``wp.exp`` translated to it (see
``precision.translate``).
"""

# ruff: noqa: F811, the function is overloaded

import math
from typing import Any

import warp as wp


def _value(
    c: str, whole: str, mantissa: int, bias: int, degree: int, ends: tuple[float, float], low: int
) -> str:
    """C++ that finds ``value`` of x.

    Args:
        c: Its numbers. whole: Whole numbers of its size, without sign.
        mantissa: Its bits. bias: Of its exponent.
        degree: Of the polynomial.
        ends: Where the result is below twice the smallest normal number, and above the largest.
        low: Bits that the higher part of ln 2 leaves free, so that n times it is exact.
    """
    scale = 2.0 ** (mantissa - low)
    high = math.floor(math.log(2.0) * scale) / scale
    # ln 2 to 30 digits, less the higher part.
    rest = (math.log(2.0) - high) + 2.3190468138462996e-17
    terms = [1.0 / math.factorial(k) for k in range(degree, -1, -1)]
    steps = " ".join(f"p = p * r + ({c}){each!r};" for each in terms[1:])
    return f"""
    {c} value;
#if defined(__CUDA_ARCH__)
    value = ::exp(x);
#else
    {{
#pragma clang fp reassociate(off) contract(on)
        // The sum has n in its lowest bits.
        const {c} magic = ({c}){1.5 * 2.0**mantissa!r};
        const {c} sum = x * ({c}){1.0 / math.log(2.0)!r} + magic;
        const {c} n = sum - magic;
        const {c} r = (x - n * ({c}){high!r}) - n * ({c}){rest!r};
        {c} p = ({c}){terms[0]!r};
        {steps}
        // Half of 2^n, which is below the largest number where the whole is not.
        const {whole} bits = __builtin_bit_cast({whole}, sum) + ({whole}){bias - 1};
        const {c} result = p * __builtin_bit_cast({c}, bits << {mantissa}) * ({c})2;
        const {c} some = x < ({c}){ends[0]!r} ? ({c})0 : result;
        value = x > ({c}){ends[1]!r} ? ({c})__builtin_inf() : some;
    }}
#endif
"""


SINGLE = _value("float", "unsigned", 23, 127, 7, (-86.6, 88.72283), 9)
DOUBLE = _value("double", "unsigned long long", 52, 1023, 13, (-707.7, 709.782712893384), 12)
_RETURN, _DERIVE = "    return value;\n", "    adj_x += adj_ret * value;\n"


@wp.func_native(SINGLE + _RETURN, SINGLE + _DERIVE)
def single(x: wp.float32) -> wp.float32: ...


@wp.func_native(DOUBLE + _RETURN, DOUBLE + _DERIVE)
def double(x: wp.float64) -> wp.float64: ...


@wp.func
def exponential(x: Any):
    return wp.exp(x)


@wp.func
def exponential(x: wp.float32):
    return single(x)


@wp.func
def exponential(x: wp.float64):
    return double(x)
