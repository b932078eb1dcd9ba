"""Scenes and simulations for tests of interactions."""

import numpy as np
import pytest

import particlesim as ps


@pytest.fixture
def simulate():
    """A simulation of a scene, by the knobs of its settings."""

    def build(scene, device, **knobs):
        return ps.Simulation(scene, ps.Settings(**knobs), device=device)

    return build


@pytest.fixture
def force_of(simulate):
    """The forces at the start of a scene."""

    def force(scene, precision, device):
        sim = simulate(scene, device, precision=precision)
        sim.forces(0.0)
        return sim.get("force")

    return force


@pytest.fixture
def cluster():
    """Particles about a distance of 1 apart, as a scene."""

    def build(count=40, seed=0, **attributes):
        rng = np.random.default_rng(seed)
        side = int(np.ceil(count ** (1 / 3)))
        x = ps.sample.lattice("sc", (side,) * 3, 1.0)[:count]
        scene = ps.Scene()
        scene.add_particles(
            x + rng.uniform(-0.1, 0.1, (count, 3)), velocity=rng.normal(size=(count, 3)),
            **attributes,
        )  # fmt: skip
        return scene

    return build
