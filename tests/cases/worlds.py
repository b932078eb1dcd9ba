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


def equal_alone(simulate, scenes, device, frames, **knobs):
    """Worlds of one simulation, given back, go bit for bit as each in a simulation of its own."""
    together = simulate(scenes, device=device, **knobs)
    together.run(frames)
    for k, scene in enumerate(scenes):
        alone = simulate(scene, device=device, **knobs)
        alone.run(frames)
        same(together.world(k), alone)
    return together


def goes_on_after_reset_and_save(simulate, scenes, device, path):
    """A world that is reset goes as at first; a run that was saved goes on, bit for bit."""
    straight = simulate(scenes, device)
    straight.run(20)
    first = straight.world(0).position
    sim = simulate(scenes, device)
    sim.run(7)
    sim.reset([0])
    sim.save(path)
    sim.run(20)
    assert np.array_equal(sim.world(0).position, first)
    loaded = ps.Simulation.load(path, scenes, device=device)
    loaded.run(20)
    assert np.array_equal(loaded.position, sim.position)
