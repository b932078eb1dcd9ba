"""Extremes of numbers, made so that loops over their derivatives vectorise.

The adjoints of ``wp.max`` and ``wp.min`` look for NaN in branches, which no vector unit takes; that
of ``wp.where`` selects. Values and derivatives are the same: at a tie the second number has the
derivative, and of a NaN and a number the number is taken. Laws have ``wp.max``, ``wp.min`` and
``wp.clamp`` translated to these (see ``precision.translate``); of anything but two numbers of
floating point they are Warp's own.
"""

# ruff: noqa: F811, the functions are overloaded

from typing import Any

import warp as wp


@wp.func
def larger(a: Any, b: Any):
    return wp.max(a, b)


@wp.func
def larger(a: Any):
    return wp.max(a)


@wp.func
def larger(a: wp.float32, b: wp.float32):
    return wp.where(a > b or b != b, a, b)


@wp.func
def larger(a: wp.float64, b: wp.float64):
    return wp.where(a > b or b != b, a, b)


@wp.func
def smaller(a: Any, b: Any):
    return wp.min(a, b)


@wp.func
def smaller(a: Any):
    return wp.min(a)


@wp.func
def smaller(a: wp.float32, b: wp.float32):
    return wp.where(a < b or b != b, a, b)


@wp.func
def smaller(a: wp.float64, b: wp.float64):
    return wp.where(a < b or b != b, a, b)


@wp.func
def within(x: Any, a: Any, b: Any):
    return smaller(larger(a, x), b)
