"""Contacts: the sweep against NumPy, conservation, friction, bounces."""

import numpy as np
import pytest

import particlesim as ps

G = 9.81


def sweeps(x, way, w, radius, friction, relaxation, count, length=0.0):
    """Ways after so many sweeps over all contacts, pair by pair, with the multipliers they have."""
    d = x[:, None] - x[None]
    if length:
        d -= length * np.round(d / length)
    i, j = np.nonzero(~np.eye(len(x), dtype=bool) & ((w[:, None] + w) > 0))
    d = d[i, j]
    r = np.linalg.norm(d, axis=1)
    n, lam, rub, w_in = d / r[:, None], np.zeros(len(i)), np.zeros((len(i), 3)), w / relaxation
    # Who comes near on the way of the substep; what others push there comes from no farther.
    u = way[i] - way[j]
    at = np.clip(-(d * u).sum(1) / np.maximum((u * u).sum(1), 1e-300), 0, 1)
    margin = 0.2 * np.minimum(radius[i], radius[j])
    near = np.linalg.norm(d + at[:, None] * u, axis=1) < radius[i] + radius[j] + margin
    for _ in range(count):
        u = way[i] - way[j]
        y = d + u
        at, along = np.linalg.norm(y, axis=1), (n * y).sum(1)
        lack = radius[i] + radius[j] - np.where(along < 0.5 * at, along, at)
        touching = near & ((lack > 0) | (lam > 0))
        tensor, contacts = np.zeros((len(x), 3, 3)), np.bincount(i[touching], minlength=len(x))
        np.add.at(tensor, i[touching], n[touching, :, None] * n[touching, None])
        crowding = (np.linalg.eigvalsh(tensor).clip(0) ** 8).sum(axis=1) ** (1 / 8)
        split, grip = crowding, contacts
        if friction:
            a = 1 - crowding / np.maximum(contacts, 1)
            split, grip = crowding / (1 - a + 0.75 * a**2), contacts / (1 - 0.75 * a)
        shares, grips = w_in * split, w_in * grip
        grew, rubbed = np.zeros(len(i)), np.zeros((len(i), 3))
        for k in np.flatnonzero(touching):
            grew[k] = max(lam[k] + lack[k] / (shares[i[k]] + shares[j[k]]), 0.0) - lam[k]
            if friction:
                t = u[k] - (u[k] @ n[k]) * n[k]
                full = rub[k] - t / (grips[i[k]] + grips[j[k]])
                size = np.linalg.norm(full)
                full *= min(1.0, friction * (lam[k] + grew[k]) / size) if size > 0 else 0.0
                rubbed[k] = full - rub[k]
        lam, rub = lam + grew, rub + rubbed
        total = np.zeros_like(x)
        np.add.at(total, i, n * grew[:, None] + rubbed)
        way = way + w[:, None] * total
    return way


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
    way = sweeps(x, h * given["velocity"], w, radius, friction, relaxation, 2, length)
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


@pytest.mark.parametrize("contact", [{}, {"restitution": 0.5}, {"restitution": 1.0}])
def test_angular_momentum_is_conserved_to_rounding(contact, device, simulate, grains, cloud):
    """Corrections lie along the pair where the substep began; many touch at once."""
    sim = simulate(grains(**cloud(200), contact=contact), device, iterations=3)
    before = sim.diagnostics()
    sim.run(30)
    after = sim.diagnostics()
    # 1200 at the start; 30 steps of 200 particles of m x v near 60, a handful of roundings each.
    tolerance = np.finfo(float).eps * 60 * np.sqrt(30 * 200 * 10)
    assert np.abs(after.angular_momentum - before.angular_momentum).max() < tolerance
    assert np.abs(after.momentum - before.momentum).max() < tolerance


@pytest.mark.parametrize(("gap", "after"), [(0.0, [-0.6, 0.4, 0.4, 0.4, 0.4]),
                                            (1e-3, [0.0, 0.0, 0.0, 0.0, 1.0])])  # fmt: skip
def test_newtons_cradle(gap, after, device, simulate, grains):
    """A row of balls: at once where they touch, one after the other where there are gaps.

    Of balls that touch none may come closer after the blow, and the first leaves the second at
    v: with lam_k of contact k, 2 lam_1 - lam_2 = 2 v, 2 lam_k = lam_(k-1) + lam_(k+1), hence
    lam = (8, 6, 4, 2) v / 5. That is Moreau's law for impacts at once; the row that collides one
    by one, of which the last ball flies off alone, is that of balls that do not quite touch.
    """
    x = [(k * (1 + 0.5 * gap), 0, 0) for k in range(5)]
    v = [(1, 0, 0)] + [(0, 0, 0)] * 4
    scene = grains(x, velocity=v, contact={"restitution": 1.0})
    sim = simulate(scene, device, dt=0.01, bounce_iterations=200)
    sim.run(20)
    # What is swept to 1e-6 of the way is off by as much over 1 - 0.9, the slowest part's rate.
    assert np.allclose(sim.velocity[:, 0], after, rtol=0, atol=1e-5)
    assert sim.diagnostics().kinetic[0] == pytest.approx(0.5, rel=1e-5)


def test_a_row_grows(device, simulate, grains):
    """A large grain that many small ones reach at once: each bounces off at its speed."""
    n = ps.sample.lattice("sc", (7, 7, 7), 1.0) - ps.sample.lattice("sc", (7, 7, 7), 1.0).mean(0)
    n = n[np.abs(n).max(axis=1) > 2.5]
    n /= np.linalg.norm(n, axis=1)[:, None]
    x, v = np.vstack([np.zeros((1, 3)), 1.1 * n]), np.vstack([np.zeros((1, 3)), -3 * n])
    radius, pinned = np.r_[1.0, np.full(len(n), 0.01)], np.arange(len(n) + 1) < 1
    scene = grains(x, radius=radius, velocity=v, pinned=pinned, contact={"restitution": 1.0})
    sim = simulate(scene, device, dt=0.01, substeps=4)
    sim.run(6)
    assert np.allclose(sim.velocity, -v, rtol=0, atol=1e-12)


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


@pytest.mark.slow
def test_elastic_gas_keeps_its_energy(device, simulate, grains):
    """2 000 spheres, a third of the room: 1e-3 in 4 s at 40 substeps; swept to 1e-6 it is less."""
    rng = np.random.default_rng(0)
    x = ps.sample.lattice("sc", (13, 13, 13), 1.15)[:2000]
    v = rng.normal(size=x.shape)
    scene = ps.Scene(periodic=((0, 0, 0), (13 * 1.15,) * 3))
    scene.add_particles(x + rng.uniform(-0.05, 0.05, x.shape), velocity=v - v.mean(0), radius=0.5)
    scene.add_constraint(ps.Contact(restitution=1.0))
    sim = simulate(scene, device, dt=1 / 60, substeps=40)
    start = sim.diagnostics().kinetic[0]
    sim.run(240)
    assert sim.diagnostics().kinetic[0] == pytest.approx(start, rel=1e-5)
    assert np.abs(sim.diagnostics().momentum).max() < 1e-9


@pytest.mark.parametrize("iterations", [1, 2, 20])
def test_compliance_does_not_depend_on_the_iterations(iterations, device, simulate, grains):
    """A grain rests on an overlap of alpha m g."""
    alpha = 1e-3
    scene = grains([(0, 0, 0), (0, 1, 0)], gravity=True, mass=2.0, pinned=[True, False],
                   contact={"compliance": alpha})  # fmt: skip
    sim = simulate(scene, device, dt=1 / 60, substeps=2, iterations=iterations)
    sim.run(600)
    assert 1 - sim.position[1, 1] == pytest.approx(2 * alpha * G, rel=1e-9)
