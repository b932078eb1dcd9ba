"""Clouds of fluid."""

import numpy as np
import pytest

import particlesim as ps

SIDE = np.array([4.0, 5.0, 6.0])
H = 0.7


@pytest.fixture
def cloud():
    """Random positions in a box, velocities, masses; some three times the rest density."""

    def build(count=300, seed=0):
        random = np.random.default_rng(seed)
        x = random.uniform(0, 1, (count, 3)) * SIDE
        return x, random.normal(size=(count, 3)), random.uniform(0.2, 0.8, count)

    return build


@pytest.fixture
def fluid():
    """A scene of one fluid and nothing else."""

    def build(x, v=0.0, m=1.0, periodic=None, group=None, **options):
        scene = ps.Scene(periodic=periodic)
        scene.add_particles(x, velocity=v, mass=m)
        scene.add_interaction(
            ps.SPH(group, **{
                "smoothing_length": H, "rest_density": 1.0, "equation_of_state": ps.Tait(10.0),
                **options,
            })
        )  # fmt: skip
        return scene

    return build


@pytest.fixture
def prepared():
    """A simulation in which the forces have been taken once."""

    def build(scene, precision="float64", device="cpu"):
        sim = ps.Simulation(scene, ps.Settings(precision=precision), device=device)
        sim.forces(sim.settings.substep)
        return sim

    return build
