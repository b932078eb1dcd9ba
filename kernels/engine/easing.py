"""Overlaps that a start came with: forgiven at first, and called in slowly.

A contact that finds its particles overlapping deeply would throw them apart. So the overlap of a
start is measured once and kept as *slack*, by which the particles count as smaller; it runs out
at a bounded speed.
"""

import functools

import numpy as np
import warp as wp

from ..precision import Precision, function, structure

SMALLEST = 0.01  # parts of the radius: below it slack runs out evenly, above it by e-folds
GONE = 2.0**20  # smallest numbers: slack that counts as none, before e-folds come to denormals


@functools.cache
def easing_type(precision: Precision):
    """How slack runs out: its largest speed, given plainly or in radii a time; e-folds a time."""
    real = precision.scalar
    return structure(
        f"Easing_{precision.name}", {"speed": real, "radii_per_time": real, "rate": real}
    )


@functools.cache
def ease_function(precision: Precision) -> wp.Function:
    """``ease(slack, radius, dt, easing)``: what is left of the slack after dt."""
    real, Easing = precision.scalar, easing_type(precision)
    gone = GONE * float(np.finfo(precision.numpy).tiny)

    def ease(slack: real, radius: real, dt: real, easing: Easing):
        pace = wp.max(slack, real(SMALLEST) * radius) * easing.rate
        limit = easing.speed + radius * easing.radii_per_time
        if limit > real(0.0):  # points without a set speed have no scale of their own
            pace = wp.min(pace, limit)
        left = slack - pace * dt
        return wp.where(left > real(gone), left, real(0.0))

    return function(ease)
