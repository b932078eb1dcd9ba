"""Skins: as thick as pays by how fast a world's particles move, and as they are asked for."""

import numpy as np
import pytest
import warp as wp

import particlesim as ps
from cases.worlds import equal_alone, goes_on_after_reset_and_save
from particlesim.engine.neighbors.skin import DEAR, FIRST
from particlesim.kernels.engine.neighbors.skin import IDLE, SPARE, THINNEST, WORTH

CUTOFF, SUBSTEPS = 1.0, 10


@ps.law
def soft(r: float, reach: float, stiffness: float):
    overlap = wp.max(reach - r, 0.0)
    return 0.5 * stiffness * overlap * overlap


def simulate(scenes, device="cpu", **knobs):
    knobs = {"dt": 0.01 * SUBSTEPS, "substeps": SUBSTEPS, "precision": "float64", **knobs}
    return ps.Simulation(scenes, ps.Settings(**knobs), device=device)


def gas(*speeds, count=2000, seed=0, stiffness=0.0):
    """Soft particles, if they feel each other at all, of which the first move along x."""
    rng = np.random.default_rng(seed)
    scene = ps.Scene()
    v = np.zeros((count, 3))
    v[: len(speeds), 0] = speeds
    x = ps.sample.lattice("sc", (13, 13, 13), 0.5)[:count]
    scene.add_particles(x + rng.uniform(-0.01, 0.01, x.shape), velocity=v)
    scene.add_interaction(ps.PairPotential(soft, cutoff=CUTOFF, reach=CUTOFF, stiffness=stiffness))
    return scene


def skins(sim):
    (listed,) = sim.neighbors.lists
    return listed.skin.thickness


@pytest.mark.parametrize("way", [0.0005, 0.004, 0.02, 0.06])
def test_a_skin_is_as_thick_as_pays(way):
    """Of n substeps, in which what is fastest goes ``way`` cutoffs each, the last needs a skin of
    2 way (n - 1): (1 + 2 way (n - 1))^3 + DEAR / n is within 1% of the least that it can be.
    """
    sim = simulate(gas(way / 0.01))
    sim.run(60)
    thick = skins(sim)[0] / CUTOFF / SPARE
    n = np.arange(1, 1000)
    costs = (1 + 2 * way * (n - 1)) ** 3 + DEAR / n
    cost = (1 + thick) ** 3 + DEAR / (1 + thick / (2 * way))
    assert cost == pytest.approx(costs.min(), rel=0.01)


def test_what_rests_has_short_rows():
    """A few builds thin the skin, and no more follow."""
    sim = simulate(gas())
    (listed,) = sim.neighbors.lists
    before = listed.work
    assert skins(sim)[0] == pytest.approx(FIRST * CUTOFF)
    for _ in range(int(6 * IDLE / SUBSTEPS)):
        sim.step()
    assert THINNEST <= skins(sim)[0] / CUTOFF < THINNEST / WORTH
    assert listed.work < before
    since = listed.skin.struct.since.numpy().copy()
    sim.run(20)
    assert np.array_equal(listed.skin.struct.since.numpy(), since)


def test_a_given_skin_stays():
    sim = simulate(gas(5.0), skin=0.2)
    sim.run(10)
    assert skins(sim)[0] == 0.2


def test_worlds_choose_for_themselves(tmp_path):
    """Bit for bit as each alone; and so after a reset, and from a checkpoint."""
    scenes = [
        gas(2.0, -1.0, 0.5, seed=1, stiffness=1.0), gas(seed=2), gas(0.1, seed=3, stiffness=0.1),
    ]  # fmt: skip
    together = equal_alone(simulate, scenes, "cpu", 30)
    fast, rest, slow = skins(together)
    assert rest < slow < fast
    goes_on_after_reset_and_save(simulate, scenes, "cpu", tmp_path / "run.npz")


def test_asking_changes_no_skin():
    """Diagnostics look at rows of the present, and leave those of the run as they were."""
    plain, asked = (simulate(gas(2.0, -1.0, stiffness=1.0)) for _ in range(2))
    for _ in range(20):
        plain.step()
        asked.step()
        asked.diagnostics()
        asked.get("force")
    assert np.array_equal(plain.position, asked.position)
    assert np.array_equal(skins(plain), skins(asked))
