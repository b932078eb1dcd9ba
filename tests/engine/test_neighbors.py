"""Neighbour lists against brute force, wherever particles may be."""

import numpy as np
import pytest
import warp as wp

import particlesim as ps


def listed_pairs(sim):
    """Pairs of the simulation's first list, and the list.

    The particles of a cluster share a row: those within reach of one of them, and themselves.
    """
    rows = sim.neighbors.lists[0]
    order, lead, pairs = rows.order.numpy(), rows.pairs.lead.numpy(), rows.pairs
    count, index = pairs.count.numpy(), rows.index.numpy()
    x, world = sim.position.astype(np.float64), sim.model.world_of
    assert not rows.overflow.numpy()[0]
    assert sorted(order) == sorted(rows.members_host)
    found = set()
    for cluster, n in enumerate(count):
        at = pairs.row.numpy()[cluster] + np.arange(n) * pairs.entry_stride
        partners, own = order[index[at]], order[lead[cluster] : lead[cluster + 1]]
        assert len(set(partners)) == n  # nobody twice
        if rows.layout.clusters(sim.model, rows.blocks)[1:2] == [1]:  # each its own
            found |= {(int(own[0]), int(j)) for j in partners}
            continue
        assert set(own) <= set(partners[: len(own)])
        length = sim.model.box_length[world[own[0]]]
        d = x[own][:, None] - x[partners][None]
        d -= np.where(length > 0, length * np.round(d / np.where(length > 0, length, 1)), 0)
        r = np.linalg.norm(d, axis=2)
        reach = rows.reach[world[own[0]]]
        # In float32 a place is known to half a unit in the last digit.
        eps = np.finfo(sim.model.precision.numpy).eps * (np.abs(x).max() + reach) * 4
        assert (r.min(axis=0) < reach + eps).all()  # nobody for nothing
        found |= {
            (int(own[a]), int(partners[b]))
            for a, b in np.argwhere(r < reach)
            if own[a] != partners[b]
        }
    return found, rows


def true_pairs(x, world, reach, length):
    """All ordered pairs within reach, by float64 brute force; also those near the limit."""
    d = x[:, None] - x[None]
    with np.errstate(invalid="ignore", divide="ignore"):
        d -= np.where(length > 0, length * np.round(d / np.where(length > 0, length, 1)), 0)
    r = np.linalg.norm(d, axis=2)
    np.fill_diagonal(r, np.inf)
    r[world[:, None] != world[None]] = np.inf
    return r


def check(scenes, settings, device, cutoff):
    for scene in scenes:
        scene.add_interaction(ps.LennardJones(cutoff=cutoff, epsilon=0.0))
    sim = ps.Simulation(scenes, settings, device=device)
    found, rows = listed_pairs(sim)
    x = sim.position.astype(np.float64)
    world = sim.model.world_of
    r = true_pairs(x, world, cutoff, sim.model.box_length[0])
    eps = np.finfo(sim.model.precision.numpy).eps * (np.abs(x).max() + cutoff) * 4
    must = {(int(i), int(j)) for i, j in np.argwhere(r < rows.reach[0] - eps)}
    may = {(int(i), int(j)) for i, j in np.argwhere(r < rows.reach[0] + eps)}
    assert must <= found <= may
    return sim


def scatter(kind, count=900, seed=0):
    rng = np.random.default_rng(seed)
    if kind == "random":
        return rng.uniform(0, 10, (count, 3))
    if kind == "clustered":
        centers = rng.uniform(0, 30, (9, 3))
        return centers[rng.integers(0, 9, count)] + rng.normal(0, 0.5, (count, 3))
    if kind == "negative":
        return rng.uniform(-12, 3, (count, 3))
    if kind == "far":
        return rng.uniform(0, 10, (count, 3)) + np.array([1e4, -3e4, 7e3])
    if kind == "flat":
        return rng.uniform(0, 30, (count, 3)) * [1, 1, 0]
    if kind == "coincident":
        return np.repeat(rng.uniform(0, 10, (count // 3, 3)), 3, axis=0)
    raise AssertionError(kind)


KINDS = ["random", "clustered", "negative", "far", "flat", "coincident"]


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("count", [300, 900])  # looked through directly, and by grid
def test_open_space(kind, count, precision, device):
    scene = ps.Scene()
    scene.add_particles(scatter(kind, count))
    check([scene], ps.Settings(precision=precision), device, cutoff=1.3)


@pytest.mark.parametrize(
    "side",
    [(10.0, 10.0, 10.0), (7.3, 11.1, 2.9), (2.7, 2.7, 2.7)],
    ids=["cube", "oblong", "narrow"],
)
@pytest.mark.parametrize("count", [300, 900])
@pytest.mark.parametrize("axes", [(1, 1, 1), (1, 0, 0)])
def test_periodic_boxes_of_any_shape(side, count, axes, precision, device):
    lower = np.array([-1.0, 4.0, 0.5])
    upper = lower + side
    periodic = (
        [a if on else None for a, on in zip(lower, axes, strict=True)],
        [a if on else None for a, on in zip(upper, axes, strict=True)],
    )
    scene = ps.Scene(periodic=periodic)
    # Twice the box: particles outside it are brought in.
    x = np.random.default_rng(1).uniform(lower - 0.5, upper + 0.5, (count, 3))
    scene.add_particles(x)
    sim = check([scene], ps.Settings(precision=precision), device, cutoff=1.3)
    inside = (sim.position >= lower - 1e-5) & (sim.position <= upper + 1e-5)
    assert inside[:, np.array(axes, bool)].all()


@pytest.mark.parametrize("counts", [(40, 100, 1, 60), (700, 30, 900)])
def test_worlds_that_overlap_are_kept_apart(counts, precision, device):
    scenes = []
    for w, count in enumerate(counts):
        scene = ps.Scene()
        scene.add_particles(scatter("random", count, seed=w))
        scenes.append(scene)
    check(scenes, ps.Settings(precision=precision), device, cutoff=1.5)


@pytest.mark.parametrize("far", [1e7, 1e9, 1e15])
def test_one_far_away_hides_nobody(far):
    """In float32, of which the distance to it has no digit left for the others."""
    x = np.concatenate([[(far, -2 * far, 3 * far)], scatter("random")])
    scene = ps.Scene()
    scene.add_particles(x)
    scene.add_interaction(ps.LennardJones(cutoff=1.3, epsilon=0.0))
    (rows,) = ps.Simulation(scene, ps.Settings(precision="float32"), device="cpu").neighbors.lists
    r = true_pairs(x[1:], np.zeros(len(x) - 1), 1.3, np.zeros(3))
    for k, own in enumerate(r):
        assert set(np.nonzero(own < 1.3)[0] + 1) <= set(rows.neighbors_of(k + 1).tolist())


def test_a_group_sees_only_itself(device):
    scene = ps.Scene()
    x = scatter("random", 1400)
    scene.add_particles(x[:700], group="other")
    mine = scene.add_particles(x[700:], group="mine")
    scene.add_interaction(ps.LennardJones(mine, cutoff=1.3, epsilon=0.0))
    sim = ps.Simulation(scene, device=device)
    found, rows = listed_pairs(sim)
    r = true_pairs(x[700:], np.zeros(700), 1.3, np.zeros(3))
    expected = {(int(i) + 700, int(j) + 700) for i, j in np.argwhere(r < rows.reach[0] - 1e-5)}
    assert expected <= found
    assert all(i >= 700 and j >= 700 for i, j in found)


def test_rows_stay_right_while_particles_move(device):
    # The list must hold every pair within the cutoff at each substep, rebuilt or not: compare
    # the potential energy with brute force as particles cross the box several times.
    scene = ps.Scene(periodic=((0, 0, 0), (6, 7, 8)))
    rng = np.random.default_rng(3)
    scene.add_particles(rng.uniform(0, 6, (600, 3)), velocity=rng.normal(0, 3, (600, 3)))

    @ps.law
    def overlap(r: float, reach: float):
        return (r - reach) * (r - reach)

    scene.add_interaction(ps.PairPotential(overlap, cutoff=1.0, reach=1.0))
    sim = ps.Simulation(scene, ps.Settings(dt=0.02, substeps=2, precision="float64"), device=device)
    for _ in range(40):
        sim.step()
        r = true_pairs(sim.position, np.zeros(600), 1.0, sim.model.box_length[0])
        expected = 0.5 * ((r[r < 1.0] - 1.0) ** 2).sum()
        assert sim.diagnostics().potential[0] == pytest.approx(expected, rel=1e-12)


def test_full_rows_grow_and_the_step_is_redone(device):
    # A sparse gas contracts to a point: its rows must grow from a few entries to everybody.
    rng = np.random.default_rng(5)
    x = rng.uniform(-20, 20, (800, 3))

    def run(skin):
        scene = ps.Scene()
        scene.add_particles(x, velocity=-x)

        @ps.law
        def soft(r: float, reach: float):
            return 0.01 * (r - reach) * (r - reach)

        scene.add_interaction(ps.PairPotential(soft, cutoff=2.0, reach=2.0))
        settings = ps.Settings(dt=0.05, substeps=2, precision="float64", skin=skin)
        sim = ps.Simulation(scene, settings, device=device)
        before = sim.neighbors.lists[0].capacity
        for _ in range(20):
            sim.step()
        assert sim.neighbors.lists[0].capacity > before
        return sim

    a, b = run(0.2), run(1.0)
    # Different lists, same physics: the order of the sums differs, hence round-off only.
    assert np.abs(a.position - b.position).max() < 1e-9
    r = true_pairs(a.position, np.zeros(800), 2.0, np.zeros(3))
    expected = 0.5 * (0.01 * (r[r < 2.0] - 2.0) ** 2).sum()
    assert a.diagnostics().potential[0] == pytest.approx(expected, rel=1e-10)


def test_lists_are_shared_by_those_who_can():
    scene = ps.Scene()
    scene.add_particles(scatter("random"))
    scene.add_interaction(ps.LennardJones(sigma=0.4, cutoff=1.0))
    scene.add_interaction(ps.LennardJones(sigma=0.4, cutoff=1.1))
    scene.add_interaction(ps.LennardJones(sigma=0.4, cutoff=3.0))
    sim = ps.Simulation(scene, device="cpu")
    assert [each.users for each in sim.neighbors.lists] == [
        ["LennardJones", "LennardJones"],
        ["LennardJones"],
    ]


def test_a_box_narrower_than_two_cutoffs_is_refused():
    scene = ps.Scene(periodic=((0, 0, 0), (10, 10, 4)))
    scene.add_particles(scatter("random"))
    scene.add_interaction(ps.LennardJones(cutoff=2.5))
    with pytest.raises(ValueError, match="Scene: periodic length along z must be at least two"):
        ps.Simulation(scene, device="cpu")


@ps.law
def fading(r: float):
    return wp.exp(-r) / r


@pytest.mark.parametrize("count", [0, 1])
def test_hardly_any_particles(count, device):
    scene = ps.Scene(periodic=((0, 0, 0), (10, 10, 10)))
    scene.add_particles(np.ones((count, 3)), velocity=(1, 0, 0))
    scene.add_interaction(ps.LennardJones())
    scene.add_interaction(ps.PairForce(fading, cutoff=None))
    sim = ps.Simulation(scene, ps.Settings(dt=0.1), device=device)
    sim.step()
    assert sim.position.shape == (count, 3)
    assert sim.diagnostics().energy.shape == (1,)


@pytest.mark.parametrize("axes", [(0, 1, 2), (2, 0, 1), (1, 2, 0)])
@pytest.mark.parametrize("direction", [1, -1])
@pytest.mark.parametrize("wrapped", [False, True])
def test_slots_follow_the_order_of_the_particles(axes, direction, wrapped):
    # Layers of 8 x 8. A row of columns, each as wide as sixteen particles in a cube, 16^(1/3) = 2.5
    # or up to 20/7 = 2.9 where whole columns fill the box, meets at most four of them: both
    # numberings part by less than four layers, while another order of the axes mixes all twenty.
    x = (np.indices((20, 8, 8)).reshape(3, -1).T + 0.5)[:, axes][::direction]
    side = np.array((20, 8, 8))[list(axes)]
    scene = ps.Scene(periodic=((0, 0, 0), side) if wrapped else None)
    scene.add_particles(x)
    sim = check([scene], ps.Settings(skin=0.05), "cpu", 0.94)
    order = sim.neighbors.lists[0].order.numpy()
    assert np.abs(order - np.arange(len(x))).max() < 4 * 64
