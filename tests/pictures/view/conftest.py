"""Fixtures of the tests of the live view."""

import pytest

from particlesim.output.usd.recorder import UsdRecorder
from particlesim.pictures.view.footage import Footage
from particlesim.pictures.view.live import Live
from particlesim.pictures.view.server import Server

from .drops import FRAMES, WORLDS, simulation


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """A recording of four worlds in one place, and position and velocity of every frame."""
    path = tmp_path_factory.mktemp("recorded") / "drops.usda"
    sim, states = simulation(WORLDS), []
    for world in range(WORLDS):  # or all would be the same
        sim.world(world).velocity = sim.world(world).velocity * (1 + world)
    with UsdRecorder(sim, path, frames=FRAMES, fields=["mass"]) as recorder:
        for frame in range(FRAMES + 1):
            if frame:
                sim.step()
            recorder.write()
            states.append((sim.position.copy(), sim.velocity.copy()))
    return path, states


@pytest.fixture(scope="module")
def shared(recorded):
    with Server(Footage(recorded[0])) as server:
        yield server


@pytest.fixture
def live():
    running = Live(simulation(), FRAMES, title="drops")
    with Server(running) as server:
        yield server
    running.close()
