"""Gravity by a tree, against the sum over all pairs."""

import numpy as np
import pytest

import particlesim as ps
from particlesim.engine.model import Model
from particlesim.engine.probe import Probe
from particlesim.interactions.gravity.limits import orbits

THETA = 0.5
# Both precisions of the C++, and what CUDA runs.
WAYS = [("native", "float32"), ("native", "float64"), ("plain", "float64")]


def sphere(count, seed=0):
    """A Plummer sphere."""
    return ps.sample.plummer((0, 0, 0), 1.0, count, seed=seed)


def scene_of(x, s=0.0, group=None, **attributes):
    scene = ps.Scene()
    scene.add_particles(x, **{"mass": 1.0 / max(1, len(x)), **attributes})
    scene.add_interaction(ps.Gravity(group, 1.0, s))
    return scene


def simulated(scene, angle, device, precision="float64", **knobs):
    knobs = {"dt": 0.01, "substeps": 1, **knobs}
    return ps.Simulation(
        scene, ps.Settings(opening_angle=angle, precision=precision, **knobs), device=device
    )


def force(scene, angle, device, precision="float64"):
    sim = simulated(scene, angle, device, precision)
    sim.forces(1.0)
    return sim.get("force").astype(np.float64)


def summed(x, mass, softening=0.0):
    """Force on each body, energy and virial, over all pairs, in NumPy."""
    s2 = np.broadcast_to(np.square(softening), len(x))
    d = x[None] - x[:, None]
    r2 = (d**2).sum(axis=2)
    u2 = r2 + 0.5 * (s2[None] + s2[:, None])
    w = np.where(r2 > 0, np.outer(mass, mass) * np.where(r2 > 0, u2, 1.0) ** -1.5, 0.0)
    return (w[:, :, None] * d).sum(axis=1), -0.5 * (w * u2).sum(), -0.5 * (w * r2).sum()


def off(found, true):
    """Root mean square of the error of a force over that force."""
    error = np.linalg.norm(found - true, axis=1) / np.linalg.norm(true, axis=1)
    return float(np.sqrt((error**2).mean()))


@pytest.fixture(params=WAYS, ids="-".join)
def way(request, device, monkeypatch):
    """How it is run; gives the precision."""
    name, precision = request.param
    if name == "native" and device != "cpu":
        pytest.skip("vectorised loops are for the CPU")
    monkeypatch.setattr(Model, "vectorised", name == "native")
    return precision


def shapes():
    """Places that are hard to halve."""
    rng = np.random.default_rng(3)
    line = np.zeros((300, 3))
    line[:, 1] = rng.normal(size=300)
    outlier = rng.normal(size=(300, 3))
    outlier[7] = (1e9, 2.0, -3.0)
    lattice = ps.sample.lattice("sc", (7, 7, 7), 1.0)
    for x in (line, outlier, lattice, sphere(65), sphere(9), sphere(2)):
        yield x.astype(np.float32).astype(float)  # places that both precisions hold


def test_forces_softened_alike_or_each_by_itself(way, device):
    x = sphere(2000)
    own = np.random.default_rng(1).uniform(0.01, 0.2, len(x))
    mass = np.random.default_rng(2).uniform(0.5, 1.5, len(x)) / len(x)
    cases = [(0.0, 0.0, {}), (0.05, 0.05, {}), (None, own, {"softening": own})]
    for s, softening, given in cases if way == "float64" else cases[:2]:
        scene, (true, _, _) = scene_of(x, s, mass=mass, **given), summed(x, mass, softening)
        found = force(scene, THETA, device, way)
        # The first term left out is at most theta^3 of a cell's force for a body at its edge, an
        # eighth for most, and differs in direction over a hundred cells: 0.125 / 8 / sqrt(100).
        assert off(found, true) < 1.6e-3
        assert np.abs(found.sum(axis=0)).max() < 1.6e-3 * np.linalg.norm(true, axis=1).sum()
        # Sums of 2000 terms: sqrt(2000) roundings of the largest, some ten times the sum.
        assert off(force(scene, 0.0, device, way), true) < 450 * np.finfo(way).eps


def test_places_hard_to_halve(way, device):
    for x in shapes():
        true = summed(x, np.full(len(x), 1 / len(x)))[0]
        found = force(scene_of(x), THETA, device, way)
        # Of a lattice the middle feels nothing: errors in parts of the mean.
        mean = np.linalg.norm(true, axis=1).mean()
        assert np.linalg.norm(found - true, axis=1).max() < 0.02 * mean


def test_coincident_bodies_do_not_pull_each_other(way, device):
    x = np.repeat([(0.0, 0.0, 0.0), (2.0, 0.0, 0.0)], 20, axis=0)
    found = force(scene_of(x, mass=1.0), THETA, device, way)
    np.testing.assert_allclose(np.abs(found), [(5.0, 0.0, 0.0)] * 40, rtol=1e-5)
    assert not force(scene_of(np.zeros((30, 3)), mass=1.0), THETA, device, way).any()


@pytest.mark.parametrize("count", [0, 1])
def test_hardly_any_bodies(count, way, device):
    assert not force(scene_of(np.zeros((count, 3))), THETA, device, way).any()


@pytest.mark.parametrize("vectorised", [True, False])
def test_energy_and_virial(vectorised, device, monkeypatch):
    if vectorised and device != "cpu":
        pytest.skip("vectorised loops are for the CPU")
    monkeypatch.setattr(Model, "vectorised", vectorised)
    x = sphere(1000)
    own = np.random.default_rng(1).uniform(0.01, 0.2, len(x))
    cases = [(0.1, 0.1, {}), (None, own, {"softening": own})]
    for s, softening, given in cases if vectorised else cases[:1]:
        true = summed(x, np.full(len(x), 1 / len(x)), softening)[1:]
        for angle, rel in ((0.0, 1e-12), (THETA, 1e-4)):
            found = simulated(scene_of(x, s, **given), angle, device).diagnostics()
            # Round-off of sums of 1000 terms; and errors of single bodies, 1e-3, of any sign.
            assert found.potential[0] == pytest.approx(true[0], rel=rel)
            assert found.virial[0] == pytest.approx(true[1], rel=rel)


def test_force_is_minus_the_slope_of_the_potential(device):
    """Of the tree's own, where the change opens no other cells."""
    x, h = sphere(400), 1e-5  # its square and rounding over it leave 1e-9
    scene = scene_of(x, 0.1)
    f = force(scene, THETA, device)
    sim = simulated(scene, THETA, device)

    def potential(k, to):
        moved = x.copy()
        moved[k, 0] += to
        sim.set("position", moved)
        return sim.diagnostics().potential[0]

    for k in (0, 150, 399):
        slope = (potential(k, h) - potential(k, -h)) / (2 * h)
        # Others feel the body with an error of their own: of single cells, theta^3 / 8.
        assert -f[k, 0] == pytest.approx(slope, abs=THETA**3 / 8 * np.linalg.norm(f[k]))


def test_only_its_group(device):
    x, some = sphere(600), np.arange(0, 600, 3)
    found = force(scene_of(x, 0.1, some), THETA, device)
    alone = force(scene_of(x[some], 0.1, mass=1 / 600), THETA, device)
    np.testing.assert_array_equal(found[some], alone)
    assert np.count_nonzero(found.any(axis=1)) == len(some)


def test_native_order_is_the_plain_one(device, monkeypatch):
    if device != "cpu":
        pytest.skip("native loops are for the CPU")
    rng = np.random.default_rng(0)
    x = [sphere(700), np.round(rng.normal(size=(300, 3)), 1), sphere(40), np.zeros((0, 3))]
    orders = []
    for vectorised in (True, False):
        monkeypatch.setattr(Model, "vectorised", vectorised)
        sim = simulated([scene_of(each) for each in x], THETA, device, "float32")
        sim.forces(1.0)
        orders.append(sim.interactions[0].sums.data.order.numpy())
    np.testing.assert_array_equal(*orders)


def test_bits_of_worlds_threads_and_restarts(device, tmp_path):
    scenes = [scene_of(sphere(count, count), 0.1) for count in (141, 300, 30)]
    knobs = {"precision": "float32", "dt": 0.05, "substeps": 2}  # 141: odd numbers before a world
    sim = simulated(scenes, THETA, device, threads=2, execution="threads", **knobs)
    sim.run(2)
    sim.save(tmp_path / "run.npz")
    sim.run(2)
    loaded = ps.Simulation.load(tmp_path / "run.npz", scenes, device=device)
    loaded.run(2)
    np.testing.assert_array_equal(loaded.position, sim.position)
    for w, scene in enumerate(scenes):
        how = {"threads": 1, "execution": "graph" if w else "threads"}
        alone = simulated(scene, THETA, device, **how, **knobs)
        alone.run(4)
        np.testing.assert_array_equal(alone.position, sim.world(w).position)
        np.testing.assert_array_equal(alone.velocity, sim.world(w).velocity)


def test_a_pinned_sun_and_units_of_any_size(precision, device):
    """A year around the sun in SI, beside which nothing moves."""
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0)], mass=1.98847e30, pinned=True)
    scene.add_particles([(1.495978707e11, 0, 0)], velocity=(0, 29784.69, 0), mass=5.972e24)
    scene.add_interaction(ps.Gravity(G=6.6743e-11))
    year, steps = 3.15581e7, 400
    sim = simulated(
        scene, THETA, device, precision, dt=year, substeps=steps, integrator="velocity_verlet"
    )
    sim.step()
    # Leapfrog's phase is off by (2 pi / steps)^2 / 24 of a turn: 6.5e-5 of the way; the year and
    # the mass are known to 1e-5.
    assert np.linalg.norm(sim.position[1] - (1.495978707e11, 0, 0)) < 1e-3 * 1.496e11
    assert not sim.position[0].any()


def test_limits_know_orbits_in_the_tree(device):
    """omega^2 = G (m_i + m_j) / r^3 of the two closest; of a homogeneous sphere, softened by its
    radius, G M / (2 R^2)^(3/2).
    """
    x = ps.sample.uniform_sphere((0, 0, 0), 1.0, 600)
    near = np.concatenate([x[:-2], [(4, 4, 4), (4, 4, 4.01)]])
    for scene, omega, rel in (
        (scene_of(near), (2 / 600 / 0.01**3) ** 0.5, 1e-6),
        (scene_of(x, 1.0), 2**-0.75, 0.05),  # second moments of 600 points: 1 / sqrt(600)
    ):
        sim = simulated(scene, THETA, device)
        with Probe(sim.loop) as probe:
            (limit,) = orbits(sim.interactions[0], probe)
        assert limit.dt == pytest.approx(2 / omega, rel=rel)


def test_pairs_soften_by_the_mean_of_their_squares(device):
    """A number is the same as that number for each."""
    x = sphere(300)
    same = force(scene_of(x, None, softening=0.3), None, device)
    np.testing.assert_allclose(same, force(scene_of(x, 0.3), None, device), rtol=1e-12)
    pair = scene_of([(0, 0, 0), (1, 0, 0)], None, mass=1.0, softening=[1.0, 3.0])
    assert force(pair, None, device)[0, 0] == pytest.approx(6.0**-1.5, rel=1e-12)
    assert force(pair, 0.3, device)[0, 0] == pytest.approx(6.0**-1.5, rel=1e-12)


@pytest.mark.parametrize("angle", [None, THETA])
def test_refused(angle, device, refused):
    with refused("Gravity: softening must be given"):
        simulated(scene_of(sphere(3), None), angle, device)
    scene = ps.Scene(periodic=((None, None, 0), (None, None, 1)))
    scene.add_particles([(0, 0, 0)])
    scene.add_interaction(ps.Gravity())
    with refused("Gravity: periodic must be None, as every image would attract"):
        simulated(scene, angle, device)
