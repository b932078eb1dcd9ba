"""Ready scenes: alone or in a batch, looked at or not, on any number of threads, the same bits.

That a run in two halves is the whole is in tests/output/checkpoint/test_checkpoint.py.
"""

import numpy as np
import pytest

import particlesim as ps
from cases.ready import small, swept

FRAMES = 3


def described(name):
    module, scene = small(name)
    return scene, module.settings


def run(scenes, settings, each_frame=lambda sim: None):
    sim = ps.Simulation(scenes, settings, device="cpu")
    for _ in range(FRAMES):
        sim.step()
        each_frame(sim)
    return sim


def assert_equal(one, other):
    np.testing.assert_array_equal(one.get("position"), other.get("position"))
    np.testing.assert_array_equal(one.get("velocity"), other.get("velocity"))


@pytest.mark.parametrize("name", swept())
def test_worlds_of_a_batch_and_threads(name):
    scene, settings = described(name)
    alone = run(scene, settings.replace(execution="graph", threads=1))
    batch = run([scene, scene], settings.replace(execution="threads", threads=2))
    for w in range(2):
        assert_equal(batch.world(w), alone)


@pytest.mark.parametrize("name", swept())
def test_looking_changes_nothing(name, tmp_path):
    scene, settings = described(name)

    def look(sim):
        sim.diagnostics()
        sim.stability()
        str(sim.explain())
        for each in ("force", "density", "pressure"):
            if each in sim.state:
                sim.get(each)
        sim.save(tmp_path / "look.npz", overwrite=True)

    assert_equal(run(scene, settings, look), run(scene, settings))


@pytest.mark.parametrize("name", swept())
def test_order_of_forces(name):
    """The same sums in another order: round-off, and what chaos makes of it in three frames."""
    scene, settings = described(name)
    other, _ = described(name)
    if len(scene.interactions) < 2:
        pytest.skip("one force")
    other.interactions.reverse()
    settings = settings.replace(precision="float64")
    one, two = run(scene, settings), run(other, settings)
    moved = np.abs(one.position - scene.position).max()
    assert moved > 0
    assert np.abs(one.position - two.position).max() < 1e-9 * moved
