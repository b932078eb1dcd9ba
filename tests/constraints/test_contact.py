"""Contacts: the sweep against NumPy, conservation, friction, bounces."""

import numpy as np
import pytest

import particlesim as ps

G = 9.81


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
def test_sweeps_equal_numpy(count, length, friction, precision, device, simulate, cloud):
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
def test_momentum_is_conserved_to_rounding(contact, precision, device, simulate, grains, cloud):
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
def test_contacts_never_add_energy(friction, iterations, device, simulate, grains, cloud):
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


# Friction, restitution, compliance --------------------------------------------------------------


def test_friction_stops_a_sliding_grain(device, precision, simulate, grains):
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


def test_friction_takes_no_more_than_mu(device, simulate, grains):
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
def test_restitution_of_a_pair(e, mass, precision, device, simulate, grains):
    """v' = -e v of the relative velocity, and momentum kept."""
    v = np.array([(2.0, 0, 0), (-1.0, 0, 0)])
    scene = grains([(0, 0, 0), (1.05, 0, 0)], mass=mass, velocity=v, contact={"restitution": e})
    sim = simulate(scene, device, precision=precision, dt=0.1, substeps=10)
    sim.step()
    after = sim.velocity[:, 0]
    rounding = float(20 * np.finfo(precision).eps / 0.01)  # of lengths, over h
    assert after[1] - after[0] == pytest.approx(3 * e, abs=rounding)
    assert mass @ after == pytest.approx(mass @ v[:, 0], abs=rounding * mass[1])


def test_elastic_gas_keeps_its_energy(device, simulate, grains, cloud):
    """e = 1 in collisions of two at a time."""
    given = cloud(64, spread=3.0, speed=5.0)
    scene = grains(**given, contact={"restitution": 1.0})
    sim = simulate(scene, device, dt=0.01, substeps=20)
    start = sim.diagnostics().kinetic[0]
    sim.run(50)
    # A pair keeps its energy to rounding; of three at a time each keeps a share of it back.
    assert sim.diagnostics().kinetic[0] == pytest.approx(start, rel=0.02)


@pytest.mark.parametrize("iterations", [1, 2, 20])
def test_compliance_does_not_depend_on_the_iterations(iterations, device, simulate, grains):
    """A grain rests on an overlap of alpha m g."""
    alpha = 1e-3
    scene = grains([(0, 0, 0), (0, 1, 0)], gravity=True, mass=2.0, pinned=[True, False],
                   contact={"compliance": alpha})  # fmt: skip
    sim = simulate(scene, device, dt=1 / 60, substeps=2, iterations=iterations)
    sim.run(600)
    assert 1 - sim.position[1, 1] == pytest.approx(2 * alpha * G, rel=1e-9)
