"""What tests of the extremes share."""

import pytest

import particlesim as ps


@pytest.fixture
def simulate():
    """A function that runs a scene for some frames, and returns its simulation."""

    def run(scene, frames, device="cpu", **knobs):
        sim = ps.Simulation(scene, ps.Settings(**{"dt": 1 / 60, **knobs}), device=device)
        sim.run(frames)
        return sim

    return run
