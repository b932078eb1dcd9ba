"""Bounces: which worlds' velocities are still to be swept over."""

import functools
from typing import Any

import warp as wp

from ..precision import Precision, register, structure

ENOUGH = 1.0e-4  # of the speed at which something bounces off: what is less is met


@functools.cache
def bounces_type(precision: Precision) -> Any:
    """What sweeps over velocities read and say, each of its own world."""
    fields = {
        "before": wp.array(dtype=precision.vec3),  # velocities as the sweeps began
        "running": wp.array(dtype=wp.int32),  # worlds that are swept
        "again": wp.array(dtype=wp.int32),  # worlds where something was not met yet
    }
    return structure(f"Bounces_{precision.name}", fields)


@functools.cache
def decide_kernel() -> wp.Kernel:
    """Kernel: worlds in which something is not met are swept (again), at most so often."""

    @register
    def decide_bounces(
        first: int,
        most: int,
        running_out: wp.array(dtype=wp.int32),
        again_io: wp.array(dtype=wp.int32),
        sweeps_io: wp.array(dtype=wp.int32),
        flag_io: wp.array(dtype=wp.int32),
    ):
        w = first + wp.tid()
        goes_on = again_io[w] != 0 and sweeps_io[w] < most
        running_out[w] = wp.where(goes_on, 1, 0)
        again_io[w] = 0
        if goes_on:
            sweeps_io[w] = sweeps_io[w] + 1
            flag_io[0] = 1

    return decide_bounces
