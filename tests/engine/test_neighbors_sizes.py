"""Lists of particles of very different sizes: every pair within reach, and no crowd beside it."""

import numpy as np
import pytest

import particlesim as ps
from cases.worlds import equal_alone
from particlesim.engine.model import Model
from particlesim.engine.neighbors import blocks

KNOBS = {"dt": 1 / 60, "substeps": 4, "precision": "float64"}


def simulate(scenes, device, **knobs):
    return ps.Simulation(scenes, ps.Settings(**{**KNOBS, **knobs}), device=device)


def mixture(count=900, box=None, points=0, seed=0, alike=False):
    """Few large, some middling and many small spheres, some overlapping, in a cube of 4."""
    rng = np.random.default_rng(seed)
    radius = rng.choice([0.5, 0.1, 0.03], count, p=[0.01, 0.09, 0.9]) * rng.uniform(0.8, 1, count)
    radius[:1] = 0.5
    radius[count - points :] = 0.0
    radius = np.full(count, 0.05) if alike else radius
    scene = ps.Scene(periodic=None if box is None else ((0, 0, 0), (box,) * 3))
    scene.add_particles(
        rng.uniform(0, 4, (count, 3)), velocity=rng.normal(0, 0.5, (count, 3)), radius=radius,
        mass=1.0,
    )  # fmt: skip
    scene.add_constraint(ps.Contact(friction=0.2))
    return scene


def rows_of(sim):
    """The list of the contacts, and for each particle who is in its row."""
    (listed,) = sim.neighbors.lists
    return listed, [listed.neighbors_of(i) for i in range(sim.particle_count)]


@pytest.fixture(params=["vectorised", "plain"])
def loops(request, monkeypatch):
    monkeypatch.setattr(Model, "vectorised", request.param == "vectorised")


@pytest.mark.parametrize("count", [900, 300], ids=["grids", "direct"])
@pytest.mark.parametrize("box", [None, 4.0], ids=["open", "periodic"])
@pytest.mark.parametrize("skin", [None, 0.0, 0.05], ids=["skin", "no skin", "given"])
def test_all_pairs_that_touch_are_found(count, box, skin, loops):
    sim = simulate(mixture(count, box, points=40), "cpu", skin=skin)
    listed, rows = rows_of(sim)
    assert len(listed.blocks) > 2
    assert listed.skin.thickness[0] == skin or (
        skin is None and 0 < listed.skin.thickness[0] < 0.05
    )
    x, radius = sim.position, sim.get("radius")
    d = x[:, None] - x[None]
    if box is not None:
        d -= box * np.round(d / box)
    r = np.linalg.norm(d, axis=2)
    np.fill_diagonal(r, np.inf)
    reach = radius[:, None] + radius
    for i, row in enumerate(rows):
        assert len(set(row)) == len(row)  # nobody twice
        assert set(np.nonzero(r[i] < reach[i])[0]) <= set(row)
        # Nor farther than a pair twice as large, a size's range, would look, and the skin.
        limit = (
            2 * np.maximum(reach[i, row], listed.reach.max() / 2**blocks.MOST)
            + listed.skin.thickness[0]
        )
        assert (r[i, row] <= limit).all()


@pytest.mark.slow
def test_a_large_one_is_nobody_elses_business():
    """Rows are as long as without it, and only its own is long where it lies among the small."""
    x = ps.sample.box((0, 0, 0), (1, 1, 1), 0.05)

    def listed(radius, place):
        scene = ps.Scene()
        scene.add_particles([*x, place], radius=[*np.full(len(x), 0.01), radius])
        scene.add_constraint(ps.Contact())
        return rows_of(simulate(scene, "cpu"))

    for place in [(0, 5, 0), (0.5, 1.2, 0.5)]:
        plain, _ = listed(0.01, place)
        large, rows = listed(0.4, place)
        longest = max(len(row) for row in rows[:-1])
        assert longest <= plain.pairs.count.numpy().max() + 1
        assert large.memory < 1.2 * plain.memory
    assert len(rows[-1]) > 300
    assert "within 0.028 to 0.808 of" in large.describe()


def test_contacts_are_the_same_however_they_are_listed(monkeypatch):
    """Sums run in another order: ten sums of some ten terms in double precision, in a frame."""
    by_size = simulate(mixture(), "cpu")
    monkeypatch.setattr(blocks, "LESS", np.inf)
    plain = simulate(mixture(), "cpu")
    assert len(rows_of(plain)[0].blocks) == 1
    for sim in (by_size, plain):
        sim.run(3)
    assert np.abs(by_size.position - mixture().position).max() > 0.01
    np.testing.assert_allclose(by_size.position, plain.position, rtol=0, atol=1e-12)
    momentum = by_size.velocity.sum(axis=0) - mixture().velocity.sum(axis=0)
    np.testing.assert_allclose(momentum, 0, atol=1e-11)


@pytest.mark.parametrize("count", [900, 300], ids=["grids", "direct"])
def test_a_world_goes_as_it_goes_alone(count, device):
    """Bit for bit, beside a world whose particles are alike, and so for threads and a restart."""
    scenes = [mixture(count, seed=1), mixture(count, alike=True), mixture(count - 100, seed=2)]
    batch = equal_alone(simulate, scenes, device, 3)
    assert {block.world for block in batch.neighbors.lists[0].blocks} == {0, 1, 2}
    assert [block.world for block in batch.neighbors.lists[0].blocks].count(1) == 1


def test_radii_may_change_within_a_size(refused):
    sim = simulate(mixture(), "cpu")
    radius = sim.get("radius")
    small = int(np.argmin(radius))
    with refused(rf"radius\[{small}\] must be at most the largest of its size"):
        sim.set("radius", np.where(np.arange(len(radius)) == small, 0.2, radius))
    sim.set("radius", 0.5 * radius)
    sim.set("radius", radius)


def test_threads_and_restarts(tmp_path):
    scene = mixture()
    runs = [
        simulate(scene, "cpu", execution=way, threads=n)
        for way, n in [("graph", 1), ("threads", 2)]
    ]
    for sim in runs:
        sim.run(4)
    np.testing.assert_array_equal(runs[0].position, runs[1].position)
    half = simulate(scene, "cpu", execution="graph", threads=1)
    half.run(2)
    half.save(tmp_path / "half.npz")
    half = ps.Simulation.load(tmp_path / "half.npz", scene, device="cpu")
    half.run(2)
    np.testing.assert_array_equal(half.position, runs[0].position)


def test_forces_share_with_contacts_only_where_sizes_are_alike():
    scene = mixture()
    scene.add_interaction(ps.LennardJones(epsilon=1e-9, sigma=0.3, cutoff=1.0))
    sim = simulate(scene, "cpu")
    assert [len(each.blocks) > 1 for each in sim.neighbors.lists] == [False, True]
