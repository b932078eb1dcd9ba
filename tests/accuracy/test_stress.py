"""Stress: its arguments, and its table. What it finds is tested in tests/extremes."""

import pytest

import particlesim as ps
from particlesim.accuracy.stress.sweep import Result, Stress


def swing():
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0)], pinned=True)
    scene.add_particles([(1.1, 0, 0)])
    scene.add_interaction(ps.Springs([(0, 1)], 100.0, 1.0))
    return scene


@pytest.mark.slow
def test_settings_that_the_scene_chooses():
    seen = []
    table = ps.stress(
        swing, ps.Settings(dt=0.1, substeps="auto", safety=0.5), frames=1, device="cpu",
        progress=lambda *at: seen.append(at),
    )  # fmt: skip
    # omega = 10, so that the limit is 0.2 s; half of it is a frame.
    assert table.settings.substeps == 1 and table.count("failed") == 0, str(table)
    assert [at[0] for at in seen] == list(range(len(table)))
    assert {at[1] for at in seen} == {len(table)} and seen[0][2] == "dt = 0"


def test_the_text_of_a_table():
    results = (
        Result("dt = 0", "held", None, None, ""),
        Result("substeps = 1", "failed", 0.25, 1e-3, "not finite, " * 20),
    )
    lines = str(Stress(results, ps.Settings(), 5, 0.2)).splitlines()
    assert lines[0].split() == ["case", "outcome", "energy", "place", "what", "was", "said"]
    assert lines[-1] == "2 cases: 1 held, 0 refused, 0 recovered, 1 failed"
    (failed,) = [line for line in lines if line.startswith("substeps = 1")]
    assert failed.split()[3:6] == ["failed", "2.5e-01", "1.0e-03"] and failed.endswith("...")


def test_bad_arguments(refused):
    with refused("build must be a function", TypeError):
        ps.stress(swing(), ps.Settings())
    with refused("settings must be a Settings", TypeError):
        ps.stress(swing, {"dt": 1})
    with refused("frames must be a whole number of at least 1"):
        ps.stress(swing, ps.Settings(), frames=0)
    with refused("tolerance must be above 0"):
        ps.stress(swing, ps.Settings(), tolerance=0.0)
    with pytest.raises(ValueError, match="worlds must be left out"):
        ps.stress(lambda: [swing(), swing()], ps.Settings(dt="auto"), worlds=2)
