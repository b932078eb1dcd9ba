"""Overlaps that a start came with: forgiven at first, and called in slowly.

A contact that finds its particles overlapping deeply would throw them apart. So the overlap of a
start is measured once and kept as *slack*, by which the particles count as smaller; it runs out
at a bounded speed.
"""

import functools

import warp as wp

from ..precision import Precision, function, structure

SMALLEST = 0.01  # parts of the radius: below it slack runs out evenly, above it by e-folds
GONE = 1.0e-30  # slack that counts as none, so that what decays by e-folds ends before denormals


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

    def ease(slack: real, radius: real, dt: real, easing: Easing):
        pace = wp.max(slack, real(SMALLEST) * radius) * easing.rate
        limit = easing.speed + radius * easing.radii_per_time
        if limit > real(0.0):  # points without a set speed have no scale of their own
            pace = wp.min(pace, limit)
        left = slack - pace * dt
        return wp.where(left > real(GONE), left, real(0.0))

    return function(ease)
