"""Forces on single particles in the CPU's lanes, against one after the other."""

import numpy as np
import pytest
import warp as wp

import particlesim as ps
from particlesim.engine.model import Model

COUNT = 200  # of which blocks are full, left over, and of two worlds at once


@ps.law
def well(position: wp.vec3, mass: float, charge: float, depth: float, middle: wp.vec3):
    r = wp.length(position - middle)
    return depth * charge * wp.exp(-r * r) + 0.1 * mass * r


@ps.law
def swing(position: wp.vec3, time: float, axis: wp.vec3):
    return axis * wp.sin(time + position[0])


def scene(strength):
    rng = np.random.default_rng(4)
    result = ps.Scene()
    x = rng.normal(size=(COUNT, 3))
    charge = rng.uniform(-1.0, 1.0, COUNT)
    for name, at in {"a": slice(70), "b": slice(70, None)}.items():
        result.add_particles(x[at], mass=1.5, charge=charge[at], group=name)
    result.add_interaction(ps.ParticleForce(potential=well, depth=strength, middle=(0, 1, 0)))
    result.add_interaction(ps.ParticleForce(swing, "a", axis=(0, strength, 0)))
    result.add_interaction(ps.UniformGravity(group="b"))
    return result


@pytest.mark.parametrize("precision", ["float32", "float64"])
def test_lanes_make_the_bits_of_one_after_the_other(precision, monkeypatch):
    """Every particle's force is its own: no sum is taken that could be in another order."""
    found = []
    for vectorised in (True, False):
        monkeypatch.setattr(Model, "vectorised", vectorised)
        settings = ps.Settings(dt=0.1, substeps=3, precision=precision)
        sim = ps.Simulation([scene(1.0), scene(2.0)], settings, device="cpu")
        for _ in range(3):
            sim.step()
        found.append({name: each.numpy().tobytes() for name, each in sim.state.arrays.items()})
    assert found[0] == found[1]
