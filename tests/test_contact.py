"""Contacts: the sweep against NumPy, conservation, friction, bounces, stacks, overlaps, worlds."""

import numpy as np
import pytest

import particlesim as ps

G = 9.81


def simulate(scene, device="cpu", **knobs):
    """One substep a frame in float64, unless told otherwise."""
    settings = {"dt": 0.01, "substeps": 1, "precision": "float64", **knobs}
    return ps.Simulation(scene, ps.Settings(**settings), device=device)


def grains(x, radius=0.5, *, gravity=False, contact=None, **particles):
    """A scene of grains in contact."""
    scene = ps.Scene()
    scene.add_particles(x, radius=radius, **particles)
    if gravity:
        scene.add_interaction(ps.UniformGravity((0, -G, 0)))
    scene.add_constraint(ps.Contact(**(contact or {})))
    return scene


def cloud(count, seed=0, speed=8.0, spread=1.0):
    """Grains of many sizes and masses that do not overlap yet, and fly at each other."""
    rng = np.random.default_rng(seed)
    side = 1.05 * count ** (1 / 3) * spread
    x = ps.sample.random((0, 0, 0), (side,) * 3, count, seed=seed, minimum_distance=0.8)
    return {
        "x": x,
        "radius": rng.uniform(0.2, 0.4, count),
        "mass": rng.uniform(0.5, 2.0, count),
        "velocity": speed * (side / 2 - x) / side + rng.normal(0, 2.0, (count, 3)),
    }


def least_gap(x, radius):
    """The smallest r - R_i - R_j of all pairs."""
    radius = np.broadcast_to(radius, len(x))
    r = np.linalg.norm(x[:, None] - x[None], axis=-1) - radius[:, None] - radius
    return r[~np.eye(len(x), dtype=bool)].min()


def sweep(x, way, w, radius, friction, relaxation, length=0.0):
    """Corrections of one sweep over all contacts, pair by pair."""
    count = len(x)
    d = x[:, None] - x[None]
    if length:
        d -= length * np.round(d / length)
    r = np.linalg.norm(d, axis=-1)
    np.fill_diagonal(r, np.inf)
    touching = np.argwhere(r < radius[:, None] + radius)
    tensor, contacts = np.zeros((count, 3, 3)), np.zeros(count)
    for i, j in touching:
        n = d[i, j] / r[i, j]
        tensor[i] += np.outer(n, n)
        contacts[i] += 1
    crowding = (np.linalg.eigvalsh(tensor).clip(0) ** 8).sum(axis=1) ** (1 / 8)
    split, grip = crowding, contacts
    w_in = w / relaxation
    if friction:
        a = 1 - crowding / np.maximum(contacts, 1)
        split, grip = crowding / (1 - a + 0.75 * a**2), contacts / (1 - 0.75 * a)
    total = np.zeros((count, 3))
    for i, j in touching:
        n, at = d[i, j] / r[i, j], r[i, j]
        u = way[i] - way[j]
        came = d[i, j] - u
        if came @ d[i, j] < 0:  # through the middle: back
            n = came / np.linalg.norm(came)
            at = n @ d[i, j]
        share = w_in[i] * split[i] + w_in[j] * split[j]
        lam = (radius[i] + radius[j] - at) / share if share else 0.0
        total[i] += lam * n
        t = u - (u @ n) * n
        slip = np.linalg.norm(t)
        if friction and slip > 0 and share:
            total[i] -= t * min(1 / (w_in[i] * grip[i] + w_in[j] * grip[j]), friction * lam / slip)
    return w[:, None] * total


@pytest.mark.parametrize("friction", [0.0, 0.4])
@pytest.mark.parametrize(("count", "length"), [(60, 0.0), (60, 5.0), (700, 0.0)])
def test_sweeps_equal_numpy(count, length, friction, precision, device):
    """Two sweeps over a cloud that collides: small (direct lists), periodic, and large (a grid)."""
    given = cloud(count)
    x, radius = given.pop("x"), given["radius"]
    scene = ps.Scene(periodic=((0, 0, 0), (length,) * 3) if length else None)
    scene.add_particles(x, **given, pinned=np.arange(count) < 5)
    scene.add_constraint(ps.Contact(friction=friction))
    # Relaxation, so that no contact is left to touch by rounding alone.
    h, relaxation = 0.05, 0.8
    knobs = {"iterations": 2, "relaxation": relaxation, "precision": precision}
    sim = simulate(scene, device, dt=h, **knobs)
    x = sim.position.astype(float)
    sim.step()
    w = np.where(np.arange(count) < 5, 0.0, 1 / given["mass"])
    way = h * given["velocity"]
    for _ in range(2):
        way += sweep(x + way, way, w, radius, friction, relaxation, length)
    assert np.abs(way - h * given["velocity"]).max() > 0.01  # there are contacts
    moved = sim.position - x
    if length:
        moved -= length * np.round(moved / length)
    # Some hundred roundings of coordinates up to 10; slip / friction amplifies none of them.
    tolerance = 300 * np.finfo(precision).eps
    assert np.allclose(moved, way, rtol=0, atol=tolerance)
    assert np.allclose(sim.velocity, way / h, rtol=0, atol=tolerance / h)


@pytest.mark.parametrize("contact", [{}, {"friction": 0.5}, {"friction": 0.5, "restitution": 0.5}])
def test_momentum_is_conserved_to_rounding(contact, precision, device):
    """Corrections and impulses of a pair are opposite and equal."""
    scene = grains(**cloud(200), contact=contact)
    sim = simulate(scene, device, iterations=2, precision=precision)
    before = sim.diagnostics()
    sim.run(30)
    after = sim.diagnostics()
    assert after.kinetic < 0.7 * before.kinetic  # much has happened
    # Kinetic 200 * 20; 30 steps of 200 particles of momentum near 10, a handful of roundings each.
    tolerance = np.finfo(precision).eps * 10 * np.sqrt(30 * 200 * 10)
    assert np.abs(after.momentum - before.momentum).max() < tolerance


@pytest.mark.parametrize("friction", [0.0, 0.3, 2.0])
@pytest.mark.parametrize("iterations", [1, 4])
def test_contacts_never_add_energy(friction, iterations, device):
    """A cloud that implodes: kinetic energy falls, at any valence and mass ratio."""
    given = cloud(150, speed=30.0)
    given["mass"] = 10.0 ** np.random.default_rng(1).uniform(-2, 2, 150)
    scene = grains(**given, contact={"friction": friction})
    sim = simulate(scene, device, iterations=iterations)
    last = start = sim.diagnostics().kinetic[0]
    largest = start
    for _ in range(60):
        sim.step()
        last = sim.diagnostics().kinetic[0]
        largest = max(largest, last)
    assert largest <= start
    assert last < 0.8 * start


# Stacks ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("friction", [0.0, 0.5])
def test_resting_pile_gains_no_energy(friction, device):
    """Grains in a bin come to rest and stay there: no energy, no creep upwards."""
    radius = 0.05
    x = ps.sample.lattice("sc", (4, 8, 4), 2.05 * radius, origin=(radius,) * 3)
    x += np.random.default_rng(0).uniform(-0.02, 0.02, x.shape) * radius
    scene = grains(x, radius, gravity=True, contact={"friction": friction})
    side = 4 * 2.05 * radius + 0.02
    scene.add_constraint(ps.BoxBoundary((0, 0, 0), (side, np.inf, side), friction=friction))
    sim = simulate(scene, device, dt=1 / 60, substeps=20, precision="float32")
    sim.run(120)
    rested = sim.diagnostics()
    scale = len(x) * G * radius
    energies = []
    for _ in range(120):
        sim.step()
        now = sim.diagnostics()
        energies.append(now.energy[0])
        assert now.kinetic[0] < 1e-2 * scale
    # Contacts are springs whose energy is not in the sum: what k layers press together by at least
    # 2 k g h^2 holds k m g of it, half each, 16 grains a layer. It may come out as height for a
    # while; but nothing is gained in the mean.
    held = 16 * sum(k * G * (2 * k * G / 1200**2) / 2 for k in range(1, 9))
    assert held < 4e-3 * scale
    assert max(energies) < rested.energy[0] + held
    assert np.mean(energies[60:]) < np.mean(energies[:60]) + 0.1 * held
    # lam = overlap / (2 split w) carries eight layers' g h^2, h = 1/1200; with contacts all around
    # split is up to 4, and force chains carry a few times the mean.
    assert least_gap(sim.position, radius) > -3 * 2 * 4 * 8 * G / 1200**2


def test_column_stands_and_rests_on_its_overlaps(device):
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
def test_pyramid_stands(iterations, device):
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
def test_mass_ratio_in_a_stack(ratio, precision, device):
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


# Friction, restitution, compliance --------------------------------------------------------------


def test_friction_stops_a_sliding_grain(device, precision):
    """After v^2 / (2 mu g), within 1 %, on the top of a sphere as flat as a plane."""
    friction, speed, flat = 0.4, 1.0, 100.0
    scene = grains(
        [(0, -flat, 0), (0, 0.1, 0)], [flat, 0.1], gravity=True,
        velocity=[(0, 0, 0), (speed, 0, 0)], pinned=[True, False], contact={"friction": friction},
    )  # fmt: skip
    sim = simulate(scene, device, dt=1 / 60, substeps=20, precision=precision)
    sim.run(60)
    # Rounding of lengths of R over h.
    assert np.abs(sim.velocity[1]).max() < 1e-6 + 4 * np.finfo(precision).eps * flat * 1200
    # Symplectic Euler stops mu g h / v sooner, 0.3 %; the sphere falls off: s / (2 mu R), 0.2 %.
    assert sim.position[1, 0] == pytest.approx(speed**2 / (2 * friction * G), rel=0.01)


def test_friction_takes_no_more_than_mu(device):
    """A glancing hit: the tangential change is mu times the normal one."""
    friction = 0.1
    scene = grains([(0, 0, 0), (0, 1, 0)], velocity=[(0, 0, 0), (3, -1, 0)],
                   contact={"friction": friction})  # fmt: skip
    sim = simulate(scene, device, dt=1e-4)
    sim.step()
    change = sim.velocity - [(0, 0, 0), (3, -1, 0)]
    # The way of the substep, v h = 3e-4, tilts the normal by as much.
    assert change[1, 1] == pytest.approx(0.5, abs=3e-4)
    assert change[1, 0] == pytest.approx(-friction * 0.5, abs=3e-4)


@pytest.mark.parametrize("e", [0.0, 0.3, 1.0])
@pytest.mark.parametrize("mass", [(1.0, 1.0), (1.0, 50.0)])
def test_restitution_of_a_pair(e, mass, precision, device):
    """v' = -e v of the relative velocity, and momentum kept."""
    v = np.array([(2.0, 0, 0), (-1.0, 0, 0)])
    scene = grains([(0, 0, 0), (1.05, 0, 0)], mass=mass, velocity=v, contact={"restitution": e})
    sim = simulate(scene, device, precision=precision, dt=0.1, substeps=10)
    sim.step()
    after = sim.velocity[:, 0]
    rounding = float(20 * np.finfo(precision).eps / 0.01)  # of lengths, over h
    assert after[1] - after[0] == pytest.approx(3 * e, abs=rounding)
    assert mass @ after == pytest.approx(mass @ v[:, 0], abs=rounding * mass[1])


def test_elastic_gas_keeps_its_energy(device):
    """e = 1 in collisions of two at a time."""
    given = cloud(64, spread=3.0, speed=5.0)
    scene = grains(**given, contact={"restitution": 1.0})
    sim = simulate(scene, device, dt=0.01, substeps=20)
    start = sim.diagnostics().kinetic[0]
    sim.run(50)
    # A pair keeps its energy to rounding; of three at a time each keeps a share of it back.
    assert sim.diagnostics().kinetic[0] == pytest.approx(start, rel=0.02)


@pytest.mark.parametrize("iterations", [1, 2, 20])
def test_compliance_does_not_depend_on_the_iterations(iterations, device):
    """A grain rests on an overlap of alpha m g."""
    alpha = 1e-3
    scene = grains([(0, 0, 0), (0, 1, 0)], gravity=True, mass=2.0, pinned=[True, False],
                   contact={"compliance": alpha})  # fmt: skip
    sim = simulate(scene, device, dt=1 / 60, substeps=2, iterations=iterations)
    sim.run(600)
    assert 1 - sim.position[1, 1] == pytest.approx(2 * alpha * G, rel=1e-9)


# Overlaps of a start ----------------------------------------------------------------------------


@pytest.mark.parametrize("overlap", [0.05, 0.5])
@pytest.mark.parametrize("speed", [None, 2.0])
def test_overlapping_start_does_not_explode(overlap, speed, device):
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


def test_overlapping_pair_leaves_at_the_depenetration_speed(device):
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
def test_coincident_grains_part(gap, precision, device):
    """Exactly on each other, or 5e-9 apart at a radius of 0.5: opposite and equal."""
    sim = simulate(grains([(0, 0, 0), (gap, 0, 0)]), device, dt=1 / 60, precision=precision)
    sim.run(120)
    assert least_gap(sim.position, 0.5) > -1e-6
    assert np.abs(sim.velocity.sum(axis=0)).max() == 0


def test_many_coincident_grains_part(precision, device):
    """Twenty in one point leave in all directions."""
    sim = simulate(grains(np.zeros((20, 3))), device, dt=1 / 60, substeps=4, precision=precision)
    sim.run(240)
    assert least_gap(sim.position, 0.5) > -0.01
    assert (np.ptp(sim.position, axis=0) > 1).all()
    assert np.abs(sim.position.mean(axis=0)).max() < 1e-4


def test_positions_written_into_an_overlap(device):
    """What a user puts on top of each other is treated like a start."""
    sim = simulate(grains([(0, 0, 0), (3, 0, 0)]), device, dt=1 / 60, substeps=10)
    sim.run(5)
    sim.position = [(0, 0, 0), (0.5, 0, 0)]
    sim.run(120)
    assert np.abs(sim.velocity).max() < 1.0
    assert least_gap(sim.position, 0.5) > -1e-6


def test_pinned_grains_may_overlap(device):
    """A wall of pinned grains that overlap keeps its thickness."""
    x = [(0, 0, 0), (0.4, 0, 0), (0.8, 0, 0), (0.4, 1.2, 0)]
    scene = grains(x, gravity=True, pinned=[True, True, True, False])
    sim = simulate(scene, device, dt=1 / 60, substeps=20)
    sim.run(60)
    assert sim.position[3, 1] == pytest.approx(1.0, abs=1e-3)


@pytest.mark.parametrize("speed", [10.0, 300.0, 700.0])
def test_fast_impact_is_stopped(speed, device, precision):
    """Up to a way of the sum of radii and more in a substep, also past the middle."""
    scene = grains([(0, 0, 0), (1.003, 0, 0)], velocity=[(0, 0, 0), (-speed, 0, 0)],
                   pinned=[True, False])  # fmt: skip
    sim = simulate(scene, device, dt=1 / 60, substeps=10, precision=precision)
    sim.run(3)
    assert sim.position[1, 0] == pytest.approx(1.0, abs=1e-5)
    assert np.abs(sim.velocity).max() < 1e-2


def test_far_from_the_origin(device):
    """A stack 10 km away stands in float32: overlaps do not lose digits."""
    x = np.array([(0, 0.5, 0), (0, 1.5, 0), (0, 2.5, 0)]) + 1e4
    scene = grains(x, gravity=True)
    scene.add_constraint(ps.PlaneBoundary((1e4, 1e4, 1e4), (0, 1, 0)))
    sim = simulate(scene, device, dt=1 / 60, substeps=20, precision="float32")
    sim.run(120)
    assert np.abs(sim.velocity).max() < 1e-3
    assert np.allclose(sim.position - 1e4, x - 1e4, atol=2e-3)  # the last bit of 1e4 is 1e-3


# Worlds, execution, requirements ----------------------------------------------------------------


def heap(k, device="cpu", worlds=None, **knobs):
    """Grains over a floor, with every parameter of contacts of its own."""
    rng = np.random.default_rng(k)
    x = ps.sample.lattice("sc", (3, 4 + k, 3), 1.1) + rng.uniform(-0.04, 0.04, (9 * (4 + k), 3))
    scene = grains(x, radius=rng.uniform(0.4, 0.5, len(x)), gravity=True,
                   contact=[{}, {"friction": 0.4}, {"restitution": 0.5},
                            {"compliance": 1e-4, "friction": 0.2}][k])  # fmt: skip
    scene.add_constraint(ps.PlaneBoundary((0, -0.5, 0), (0, 1, 0), friction=0.1 * k))
    return scene


def test_a_world_in_a_batch_equals_it_alone(precision, device):
    """Bit for bit, with and without friction, restitution and compliance; all overlap in space."""
    knobs = {"dt": 1 / 60, "substeps": 5, "iterations": 2, "precision": precision}
    scenes = [heap(k) for k in range(4)]
    together = simulate(scenes, device, **knobs)
    together.run(40)
    for k, scene in enumerate(scenes):
        alone = simulate(scene, device, **knobs)
        alone.run(40)
        assert np.array_equal(together.world(k).position, alone.position)
        assert np.array_equal(together.world(k).velocity, alone.velocity)


def test_reset_and_placement_leave_other_worlds(device):
    """World 0 goes as at first after its reset; world 1 never notices."""
    scenes = [heap(1), heap(1)]
    knobs = {"dt": 1 / 60, "substeps": 5}
    sim, untouched = (simulate(scenes, device, **knobs) for _ in range(2))
    untouched.run(20)
    sim.run(10)
    first = sim.world(0).position
    sim.world(0).position = sim.world(0).position * 0.9
    sim.run(5)
    sim.reset([0])
    sim.run(5)
    assert np.array_equal(sim.world(1).position, untouched.world(1).position)
    sim.run(5)
    assert np.array_equal(sim.world(0).position, first)


def test_graph_equals_threads():
    """Bit for bit, with friction and restitution, through rebuilds of the lists."""
    found = []
    for knobs in ({"execution": "graph"}, {"execution": "threads", "threads": 3}):
        given = cloud(2500)
        scene = grains(**given, gravity=True, contact={"friction": 0.3, "restitution": 0.5})
        scene.add_constraint(ps.BoxBoundary((-5, -5, -5), (20, 20, 20), friction=0.3))
        sim = simulate(scene, dt=1 / 60, substeps=4, precision="float32", **knobs)
        sim.run(5)
        found.append((sim.position, sim.velocity))
        sim.close()
    assert np.array_equal(found[0], found[1])


def test_plain_loop_equals_native(monkeypatch):
    """The loop in Warp's own language, as on CUDA, against the vectorised one."""
    found = []
    for vectorised in (True, False):
        scene = grains(**cloud(60), contact={"friction": 0.4, "restitution": 0.5})
        monkeypatch.setattr("particlesim.engine.model.Model.vectorised", vectorised, raising=False)
        sim = simulate(scene, dt=0.02)
        sim.run(10)
        found.append(sim.position)
    assert np.allclose(found[0], found[1], rtol=0, atol=1e-11)


def test_only_what_is_required(device):
    """No positions of the last substep, with friction or without."""
    sim = simulate(grains([(0, 0, 0), (1, 0, 0)], contact={"friction": 0.5}), device)
    assert "previous_position" not in sim.state
    assert "force" not in sim.state


@pytest.mark.parametrize(
    ("x", "radius", "pinned"),
    [
        ([(0, 0, 0), (0, 0, 0)], 0.0, False),  # points
        ([(0, 0, 0)], 0.5, False),  # one grain
        (np.zeros((0, 3)), 0.5, False),  # none
        ([(0, 0, 0), (0.1, 0, 0)], 0.5, True),  # nothing can move
    ],
)
def test_nothing_to_touch(x, radius, pinned, device):
    """Each runs, and nothing moves."""
    sim = simulate(grains(x, radius, pinned=pinned), device)
    sim.run(2)
    assert np.array_equal(sim.position, np.reshape(x, (-1, 3)))


def test_empty_group_and_world_of_points(device):
    """A world whose group is empty, and one of points, beside one with contacts."""
    scenes = []
    for k, radius in enumerate((0.5, 0.0, 0.5)):
        scene = ps.Scene()
        some = scene.add_particles([(0, 0, 0), (0.9, 0, 0)], radius=radius)
        scene.add_constraint(ps.Contact(some if k < 2 else []))
        scenes.append(scene)
    sim = simulate(scenes, device, dt=1 / 60)
    sim.run(120)
    assert np.linalg.norm(np.diff(sim.world(0).position, axis=0)) >= 1 - 1e-9
    for k in (1, 2):
        assert np.array_equal(sim.world(k).position, [(0, 0, 0), (0.9, 0, 0)])


def test_no_time_passes(device):
    """A substep of nothing changes nothing."""
    sim = simulate(grains([(0, 0, 0), (0.5, 0, 0)], contact={"restitution": 0.5}), device)
    sim.substep(0.0)
    assert np.array_equal(sim.position, [(0, 0, 0), (0.5, 0, 0)])


def test_static_projection(device):
    """sim.project takes overlaps out of a start at once, without speed."""
    sim = simulate(grains([(0, 0, 0), (0.5, 0, 0)], contact={"friction": 0.5}), device)
    sim.project(1)
    assert np.allclose(sim.position[:, 0], [-0.25, 0.75])
    sim.step()
    assert np.allclose(sim.velocity, 0)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"friction": -0.1}, "Contact: friction must be at least 0, got -0.1"),
        ({"friction": np.nan}, "Contact: friction must be finite"),
        ({"restitution": 1.5}, "Contact: restitution must be at most 1, got 1.5"),
        ({"compliance": -1.0}, r"Contact: compliance must be at least 0 \[length/force\]"),
    ],
)
def test_bad_arguments(arguments, message):
    """Each in the house form."""
    with pytest.raises(ValueError, match=message):
        ps.Contact(**arguments)


def test_box_narrower_than_two_cutoffs(device):
    """Refused, as a grain would touch two images of another."""
    scene = ps.Scene(periodic=((0, 0, 0), (1.5, 1.5, 1.5)))
    scene.add_particles([(0, 0, 0), (0.7, 0, 0)], radius=0.5)
    scene.add_constraint(ps.Contact())
    with pytest.raises(ValueError, match="periodic length along x must be at least two cutoffs"):
        simulate(scene, device)
