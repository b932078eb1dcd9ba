"""What tests of constraints share: simulations of one substep a frame, and small scenes."""

import numpy as np
import pytest

import particlesim as ps

G = 9.81


@pytest.fixture
def simulate():
    """A function: one substep of 10 ms a frame in float64, unless told otherwise."""

    def make(scene, device="cpu", **knobs):
        settings = {"dt": 0.01, "substeps": 1, "precision": "float64", **knobs}
        return ps.Simulation(scene, ps.Settings(**settings), device=device)

    return make


def _scene_of(x, *constraints, gravity=False, **particles):
    scene = ps.Scene()
    scene.add_particles(x, **particles)
    if gravity:
        scene.add_interaction(ps.UniformGravity((0, -G, 0)))
    for each in constraints:
        scene.add_constraint(each)
    return scene


@pytest.fixture
def scene_of():
    """A function: particles at x with constraints, and with gravity where it is asked for."""
    return _scene_of
