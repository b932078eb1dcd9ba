"""Contacts: stacks, and starts that overlap."""

import numpy as np
import pytest

import particlesim as ps

G = 9.81


# Stacks ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("friction", [0.0, 0.5])
def test_resting_pile_gains_no_energy(friction, device, simulate, grains):
    """Grains in a bin come to rest and stay there: no energy, no creep upwards."""
    radius, scenes = 0.05, []
    for seed in range(4):
        x = ps.sample.lattice("sc", (4, 8, 4), 2.05 * radius, origin=(radius,) * 3)
        x += np.random.default_rng(seed).uniform(-0.02, 0.02, x.shape) * radius
        scene = grains(x, radius, gravity=True, contact={"friction": friction})
        side = 4 * 2.05 * radius + 0.02
        scene.add_constraint(ps.BoxBoundary((0, 0, 0), (side, np.inf, side), friction=friction))
        scenes.append(scene)
    sim = simulate(scenes, device, dt=1 / 60, substeps=20, precision="float32")
    sim.run(120)
    rested = sim.diagnostics()
    scale = len(x) * G * radius
    energies = []
    for _ in range(120):
        sim.step()
        now = sim.diagnostics()
        energies.append(now.energy[0])
        # In the mean of several piles: whether one has a late avalanche is a matter of chance. Of
        # 24 smooth ones, one or two have the energy of a grain that falls by a radius or two.
        assert now.kinetic.mean() < 1e-2 * scale
    # Contacts are springs whose energy is not in the sum: what k layers press together by at least
    # 2 k g h^2 holds k m g of it, half each, 16 grains a layer. It may come out as height for a
    # while; but nothing is gained in the mean.
    held = 16 * sum(k * G * (2 * k * G / 1200**2) / 2 for k in range(1, 9))
    assert held < 4e-3 * scale
    assert max(energies) < rested.energy[0] + held
    assert np.mean(energies[60:]) < np.mean(energies[:60]) + 0.1 * held
    # lam = overlap / (2 split w) carries g h^2 for each layer above, 4.5 in the mean, h = 1/1200;
    # with contacts all around split is up to 4. Forces in a pile are distributed exponentially (Liu
    # et al. 1995): among n the largest is ln n + 7 times the mean or less, but for one in e^7.
    x = sim.position[: len(x)]
    r = np.linalg.norm(x[:, None] - x, axis=-1)
    overlap = 2 * radius - r[np.triu_indices(len(r), 1)]
    overlap = overlap[overlap > 0]
    assert overlap.mean() < 2 * 4 * 4.5 * G / 1200**2
    assert overlap.max() < (np.log(len(overlap)) + 7) * overlap.mean()


def test_piles_rest_on_overlaps_of_their_weight(device, simulate, grains, least_gap):
    """In the mean of several piles, since the deepest overlap of one is a matter of chance."""
    radius, scenes = 0.05, []
    side = 4 * 2.05 * radius + 0.02
    for seed in range(4):
        x = ps.sample.lattice("sc", (4, 8, 4), 2.05 * radius, origin=(radius,) * 3)
        x += np.random.default_rng(seed).uniform(-0.02, 0.02, x.shape) * radius
        scenes.append(grains(x, radius, gravity=True))
        scenes[-1].add_constraint(ps.BoxBoundary((0, 0, 0), (side, np.inf, side)))
    sim = simulate(scenes, device, dt=1 / 60, substeps=20, precision="float32")
    sim.run(240)
    deepest = [least_gap(sim.world(w).position, radius) for w in range(4)]
    # lam = overlap / (2 split w) carries eight layers' g h^2, h = 1/1200; with contacts all around
    # split is up to 4, and force chains carry a few times the mean.
    assert np.mean(deepest) > -3 * 2 * 4 * 8 * G / 1200**2


def test_column_stands_and_rests_on_its_overlaps(device, simulate, grains):
    """A straight column: contact k carries k grains, on an overlap of 2 k g h^2 at most twice."""
    count, radius, h = 6, 0.1, 1 / 600
    x = np.zeros((count, 3))
    x[:, 1] = radius * (2 * np.arange(count) + 1)
    scene = grains(x, radius, gravity=True)
    scene.add_constraint(ps.PlaneBoundary((0, 0, 0), (0, 1, 0)))
    sim = simulate(scene, device, dt=10 * h, substeps=10)
    sim.run(300)
    overlap = 2 * radius - np.diff(sim.position[:, 1])
    carried = np.arange(count - 1, 0, -1)
    assert np.abs(sim.velocity).max() < 1e-6
    # lam = overlap / (2 split w) carries g h^2 for each grain above: split is 2 inside, 1 on top.
    assert np.all(overlap <= 4.01 * carried * G * h**2)
    assert np.all(overlap >= 1.9 * carried * G * h**2)


@pytest.mark.parametrize("iterations", [1, 4])
def test_pyramid_stands(iterations, device, simulate, grains):
    """Thirty grains on a rough floor: friction alone holds the lowest layer together."""
    radius, layers = 0.05, 4
    x = []
    for k in range(layers):
        along = radius * (2 * np.arange(layers - k) - (layers - k - 1))
        height = radius * (1 + np.sqrt(2) * k)
        x += [(a, height, b) for a in along for b in along]
    scene = grains(x, radius, gravity=True, contact={"friction": 0.5})
    scene.add_constraint(ps.PlaneBoundary((0, 0, 0), (0, 1, 0), friction=0.5))
    knobs = {"dt": 1 / 60, "substeps": 20, "iterations": iterations, "precision": "float32"}
    sim = simulate(scene, device, **knobs)
    sim.run(180)
    # Overlaps of up to 2 split layers g h^2, split up to 4: 0.004 R.
    assert np.allclose(sim.position, x, rtol=0, atol=5e-3 * radius)
    assert np.abs(sim.velocity).max() < 1e-4


@pytest.mark.parametrize("ratio", [1e4, 1e-4])
def test_mass_ratio_in_a_stack(ratio, precision, device, simulate, grains):
    """Ten thousandfold on top or below: bounded, in order, and at rest on top if light."""
    x = [(0, 0, 0), (0, 1, 0), (0, 2, 0)]
    scene = grains(x, gravity=True, mass=[1, 1, ratio], pinned=[True, False, False])
    sim = simulate(scene, device, dt=1 / 60, substeps=20, precision=precision)
    sim.run(120)
    y = sim.position[:, 1]
    assert y[1] > 0.9
    assert y[2] - y[1] > 0.9
    assert np.abs(sim.velocity).max() < 1.0
    if ratio < 1:
        assert np.allclose(y, [0, 1, 2], atol=1e-4)


# Overlaps of a start ----------------------------------------------------------------------------


@pytest.mark.parametrize("overlap", [0.05, 0.5])
@pytest.mark.parametrize("speed", [None, 2.0])
def test_overlapping_start_does_not_explode(overlap, speed, device, simulate, grains, least_gap):
    """216 unit masses at rest come apart, none of them fast, with next to no energy."""
    radius = 0.5
    x = ps.sample.lattice("sc", (6, 6, 6), 2 * radius * (1 - overlap))
    sim = simulate(grains(x, radius), device, dt=1 / 60, substeps=10, depenetration_speed=speed)
    limit = 60 * radius if speed is None else speed
    for _ in range(120):
        sim.step()
        # Growing spheres push the next ones on: a row of six moves its ends by five growths.
        assert np.linalg.norm(sim.velocity, axis=1).max() <= limit * np.sqrt(3) * 2.5
    assert least_gap(sim.position, radius) > -1e-3
    # Half a second, 30 frames, is what growing takes: in a row of six, five times both radii.
    assert sim.diagnostics().kinetic[0] < 0.5 * 216 * (5 * 2 * overlap * radius / 0.5) ** 2
    assert np.abs(sim.position.mean(axis=0) - x.mean(axis=0)).max() < 1e-12


def test_overlapping_pair_leaves_at_the_depenetration_speed(device, simulate, grains, least_gap):
    """Never above it, however deep the overlap."""
    for depth in (0.01, 0.5, 1.0):
        scene = grains([(0, 0, 0), (1 - depth, 0, 0)])
        sim = simulate(scene, device, dt=1 / 60, substeps=10, depenetration_speed=0.25)
        fastest = 0.0
        for _ in range(300):
            sim.step()
            v = sim.velocity
            fastest = max(fastest, float(np.linalg.norm(v[1] - v[0])))
        assert 0 < fastest <= 0.25 * (1 + 1e-5)
        assert least_gap(sim.position, 0.5) >= -1e-12


@pytest.mark.parametrize("gap", [0.0, 5e-9])
def test_coincident_grains_part(gap, precision, device, simulate, grains, least_gap):
    """Exactly on each other, or 5e-9 apart at a radius of 0.5: opposite and equal."""
    sim = simulate(grains([(0, 0, 0), (gap, 0, 0)]), device, dt=1 / 60, precision=precision)
    sim.run(120)
    assert least_gap(sim.position, 0.5) > -1e-6
    assert np.abs(sim.velocity.sum(axis=0)).max() == 0


def test_many_coincident_grains_part(precision, device, simulate, grains, least_gap):
    """Twenty in one point leave in all directions."""
    sim = simulate(grains(np.zeros((20, 3))), device, dt=1 / 60, substeps=4, precision=precision)
    sim.run(240)
    assert least_gap(sim.position, 0.5) > -0.01
    assert (np.ptp(sim.position, axis=0) > 1).all()
    assert np.abs(sim.position.mean(axis=0)).max() < 1e-4


def test_positions_written_into_an_overlap(device, simulate, grains, least_gap):
    """What a user puts on top of each other is treated like a start."""
    sim = simulate(grains([(0, 0, 0), (3, 0, 0)]), device, dt=1 / 60, substeps=10)
    sim.run(5)
    sim.position = [(0, 0, 0), (0.5, 0, 0)]
    sim.run(120)
    assert np.abs(sim.velocity).max() < 1.0
    assert least_gap(sim.position, 0.5) > -1e-6


def test_pinned_grains_may_overlap(device, simulate, grains):
    """A wall of pinned grains that overlap keeps its thickness."""
    x = [(0, 0, 0), (0.4, 0, 0), (0.8, 0, 0), (0.4, 1.2, 0)]
    scene = grains(x, gravity=True, pinned=[True, True, True, False])
    sim = simulate(scene, device, dt=1 / 60, substeps=20)
    sim.run(60)
    assert sim.position[3, 1] == pytest.approx(1.0, abs=1e-3)


@pytest.mark.parametrize("speed", [10.0, 300.0, 700.0])
def test_fast_impact_is_stopped(speed, device, precision, simulate, grains):
    """Up to a way of the sum of radii and more in a substep, also past the middle."""
    scene = grains([(0, 0, 0), (1.003, 0, 0)], velocity=[(0, 0, 0), (-speed, 0, 0)],
                   pinned=[True, False])  # fmt: skip
    sim = simulate(scene, device, dt=1 / 60, substeps=10, precision=precision)
    sim.run(3)
    assert sim.position[1, 0] == pytest.approx(1.0, abs=1e-5)
    assert np.abs(sim.velocity).max() < 1e-2


def test_far_from_the_origin(device, simulate, grains):
    """A stack 10 km away stands in float32: overlaps do not lose digits."""
    x = np.array([(0, 0.5, 0), (0, 1.5, 0), (0, 2.5, 0)]) + 1e4
    scene = grains(x, gravity=True)
    scene.add_constraint(ps.PlaneBoundary((1e4, 1e4, 1e4), (0, 1, 0)))
    sim = simulate(scene, device, dt=1 / 60, substeps=20, precision="float32")
    sim.run(120)
    assert np.abs(sim.velocity).max() < 1e-3
    assert np.allclose(sim.position - 1e4, x - 1e4, atol=2e-3)  # the last bit of 1e4 is 1e-3
