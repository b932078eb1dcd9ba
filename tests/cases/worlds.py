"""What tests of batches share."""

import numpy as np
import warp as wp

import particlesim as ps


@ps.law
def screened(r: float, charge_i: float, charge_j: float, screening: float):
    return charge_i * charge_j * wp.exp(-r / screening) / r


def same(world, alone):
    np.testing.assert_array_equal(world.position, alone.position)
    np.testing.assert_array_equal(world.velocity, alone.velocity)
