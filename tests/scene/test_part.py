"""Parts of one's own that leave out what they must have."""

import numpy as np
import pytest

import particlesim as ps


class Unprepared(ps.Interaction):
    pass


class Idle(ps.Interaction):
    def prepare(self, model, neighbors):
        pass


class Still(ps.Integrator):
    pass


def falling(part=None):
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0)])
    if part is not None:
        scene.add_interaction(part)
    return scene


@pytest.mark.parametrize(
    ("part", "settings", "method"),
    [
        (Unprepared(), ps.Settings(), r"prepare\(self, model, neighbors\)"),
        (Idle(), ps.Settings(), r"apply\(self, state, neighbors, dt\)"),
        (None, ps.Settings(integrator=Still), r"advance\(self, dt\)"),
    ],
)
def test_a_missing_method_is_named(part, settings, method, refused):
    with refused(rf"write def {method}", NotImplementedError):
        ps.Simulation(falling(part), settings, device="cpu").step()


def test_one_name_of_a_field_may_be_a_string(tmp_path):
    sim = ps.Simulation(falling(), device="cpu")
    sim.run(1, record=tmp_path / "out.npz", fields="speed")
    with np.load(tmp_path / "out.npz") as index:
        assert index["fields"].tolist() == ["speed"]
