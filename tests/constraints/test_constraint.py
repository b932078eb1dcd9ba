"""Constraints on tuples: gradients, and the solve itself."""

import functools

import numpy as np
import pytest

import particlesim as ps
from particlesim.engine import topology

RNG = np.random.default_rng(7)


def _angle(x, rest_angle):
    u, v = x[0] - x[1], x[2] - x[1]
    return np.arccos(u @ v / np.linalg.norm(u) / np.linalg.norm(v)) - rest_angle


def _volume(x, rest_volume):
    return np.cross(x[1] - x[0], x[2] - x[0]) @ (x[3] - x[0]) / 6 - rest_volume


def _distance(x, rest_length):
    return np.linalg.norm(x[1] - x[0]) - rest_length


def _reach(x, length):
    return np.linalg.norm(x[0] - np.array([1.0, 2.0, 3.0])) - length


# Particles, a reference in NumPy, its parameters, and those that it has built in.
LAWS = {
    "distance": (2, _distance, {"rest_length": 0.8}, {}),
    "angle": (3, _angle, {"rest_angle": 1.1}, {}),
    "volume": (4, _volume, {"rest_volume": 0.3}, {}),
    "reach": (1, _reach, {"length": 1.7}, {"anchor": (1, 2, 3)}),
}


@pytest.fixture
def simulate(simulate):
    """In float32, unless told otherwise."""
    return functools.partial(simulate, precision="float32")


# Laws and their gradients ---------------------------------------------------------------------


@pytest.mark.parametrize("name", LAWS)
def test_projection_follows_the_gradient(name, precision, device, simulate, laws):
    """dx_a = w_a grad_a C dlam, dlam = -C / sum w |grad C|^2, by central differences."""
    size, reference, parameters, fixed = LAWS[name]
    law = getattr(laws, name)
    x = RNG.uniform(-1, 1, (size, 3))
    w = RNG.uniform(0.5, 2, size)
    scene = ps.Scene()
    scene.add_particles(x, mass=1 / w)
    scene.add_constraint(ps.Constraint(law, np.arange(size)[None], **parameters, **fixed))
    sim = simulate(scene, device, precision=precision)
    sim.project(1)
    step = 1e-6
    gradient = np.zeros((size, 3))
    for at in np.ndindex(size, 3):
        moved = np.zeros((size, 3))
        moved[at] = step
        gradient[at] = (
            reference(x + moved, *parameters.values()) - reference(x - moved, *parameters.values())
        ) / (2 * step)
    c = reference(x, *parameters.values())
    dx = -c * w[:, None] * gradient / (w[:, None] * gradient**2).sum()
    # Differences are exact to step^2 + 1e-16 / step; in float32 acos(c) loses 1e-7 / sin^2.
    assert np.allclose(sim.position - x, dx, rtol=0, atol=1e-8 if precision == "float64" else 1e-5)


def test_distance_is_its_law(device, simulate, cloth, laws):
    """The gradient written by hand, for rods, springs with damping and inequalities."""
    x, pairs = cloth()
    found = []
    for make in (
        lambda **kw: ps.Distance(pairs, 0.1, **kw),
        lambda **kw: ps.Constraint(laws.distance, pairs, rest_length=0.1, **kw),
    ):
        for options in (
            {},
            {"compliance": 1e-5, "damping": 10.0},
            {"inequality": True},
        ):
            scene = ps.Scene()
            scene.add_particles(x, pinned=np.arange(len(x)) < 2)
            scene.add_interaction(ps.UniformGravity())
            scene.add_constraint(make(**options))
            sim = simulate(scene, device, iterations=3, precision="float64")
            sim.run(5)
            found.append(sim.position)
    for a, b in zip(found[:3], found[3:], strict=True):
        assert np.allclose(a, b, rtol=0, atol=1e-13)


# The solve ------------------------------------------------------------------------------------


def gauss_seidel(x, v, w, pairs, length, alpha, beta, h, iterations, sign):
    """One XPBD substep of distances in NumPy, tuple after tuple in the order of the colours.

    Corrections go along where the pair was as the substep began, if it has not turned by more than
    60 degrees nor is shifted by more than half its length; then dampers brake the velocities.
    """
    order = [r for r in np.argsort(topology.colors(pairs), kind="stable") if w[pairs[r]].any()]
    previous, x = x.copy(), x + h * v
    lam = np.zeros(len(pairs))
    side = -1 if sign < 0 else 1

    def seen(at, r):
        d = at[pairs[r, 1]] - at[pairs[r, 0]]
        return side * (np.linalg.norm(d) - length[r]), side * d / np.linalg.norm(d)

    for _ in range(iterations):
        for r in order:
            i, j = pairs[r]
            c, n = seen(x, r)
            soft, along, s = alpha[r] / h**2, seen(previous, r)[1], w[i] + w[j]
            shift = s * abs(lam[r] + (-c - soft * lam[r]) / (s + soft))
            reach = np.linalg.norm(previous[j] - previous[i])
            if n @ along >= 0.5 and shift <= 0.5 * reach:
                s *= n @ along
                n = along
            change = (-c - soft * lam[r]) / (s + soft)
            if sign != 0:
                change = 0.0 if c >= 0 and lam[r] == 0 else max(change, -lam[r])
            lam[r] += change
            x[i] -= w[i] * n * change
            x[j] += w[j] * n * change
    v = (x - previous) / h
    for r in order:
        i, j = pairs[r]
        n = seen(x, r)[1]
        push = -beta[r] * h * (v[j] - v[i]) @ n / (1 + beta[r] * h * (w[i] + w[j]))
        if sign != 0:
            push = max(push, -lam[r] / h) if lam[r] > 0 else 0.0
        lam[r] += h * push
        v[i] -= w[i] * n * push
        v[j] += w[j] * n * push
    return x, v, lam


@pytest.mark.parametrize("kind", ["rod", "strut", "rope"])
def test_solve_equals_gauss_seidel_in_order(kind, precision, device, simulate, cloth):
    """Coloured sweeps against NumPy's, with compliance, damping, masses and pinned particles."""
    x, pairs = cloth()
    m = len(pairs)
    v = RNG.normal(0, 0.1, x.shape)
    w = RNG.uniform(0.5, 2, len(x)) * (np.arange(len(x)) > 1)
    length = RNG.uniform(0.08, 0.12, m)
    alpha, beta = RNG.uniform(0, 1e-4, m), RNG.uniform(0, 5, m)
    h, iterations = 0.01, 4
    scene = ps.Scene()
    v[w == 0] = 0
    scene.add_particles(x, velocity=v, mass=1 / np.where(w > 0, w, 1), pinned=w == 0)
    options = {"strut": {"inequality": True}, "rope": {"tension_only": True}, "rod": {}}[kind]
    rods = scene.add_constraint(
        ps.Distance(pairs, length, compliance=alpha, damping=beta, **options)
    )
    sim = simulate(scene, device, dt=h, iterations=iterations, precision=precision)
    sign = {"rod": 0, "strut": 1, "rope": -1}[kind]
    for _ in range(3):
        sim.step()
        x, v, lam = gauss_seidel(x, v, w, pairs, length, alpha, beta, h, iterations, sign)
    tolerance = 1e-12 if precision == "float64" else 2e-6  # some tens of last bits of lengths of 1
    assert np.allclose(sim.position, x, rtol=0, atol=tolerance)
    assert np.allclose(sim.velocity, v, rtol=0, atol=tolerance / h)
    assert np.allclose(sim.force(rods), np.abs(lam) / h**2, rtol=1e-3, atol=10 * tolerance / h**2)


def test_inequality_pushes_only(device, simulate, laws):
    """C >= 0 is left alone while it holds, and no tuple pulls."""
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0), (0.5, 0, 0), (0, 1, 0), (1.5, 1, 0)])
    scene.add_constraint(
        ps.Constraint(laws.distance, [(0, 1), (2, 3)], rest_length=1.0, inequality=True)
    )
    sim = simulate(scene, device, precision="float64")
    sim.project(3)
    assert np.allclose(sim.position[:, 0], [-0.25, 0.75, 0, 1.5], atol=1e-15)


def test_rope_pulls_only(device, simulate):
    """The counterpart, tension_only."""
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0), (0.5, 0, 0), (0, 1, 0), (1.5, 1, 0)])
    scene.add_constraint(ps.Distance([(0, 1), (2, 3)], 1.0, tension_only=True))
    sim = simulate(scene, device, precision="float64")
    sim.project(3)
    assert np.allclose(sim.position[:, 0], [0, 0.5, 0.25, 1.25], atol=1e-15)


def test_damping_is_a_damper(device, simulate, pair):
    """A spring with a damper decays as exp(-beta t / (2 m)) in amplitude."""
    k, beta = 1000.0, 4.0
    scene = pair(x=[(0, 0, 0), (1.1, 0, 0)], pinned=[True, False])
    scene.add_constraint(ps.Distance([(0, 1)], 1.0, compliance=1 / k, damping=beta))
    sim = simulate(scene, device, dt=0.5, substeps=50_000, precision="float64")
    sim.step()
    stretch, v = sim.position[1, 0] - 1, sim.velocity[1, 0]
    energy = (v**2 + k * stretch**2) / (k * 0.1**2)
    # Over whole and half periods alike up to beta / (2 sqrt(k m)) = 6 %; the integrator's own
    # damping is k h t = 0.5 %.
    assert np.log(energy) == pytest.approx(-beta * 0.5, rel=0.05)


def test_momentum_is_conserved_to_rounding(precision, device, simulate, cloth):
    """Of a free cloth in violent motion."""
    x, pairs = cloth()
    v = RNG.normal(0, 1, x.shape)
    scene = ps.Scene()
    scene.add_particles(x, velocity=v, mass=RNG.uniform(0.5, 2, len(x)))
    scene.add_constraint(ps.Distance(pairs, 0.1))
    sim = simulate(scene, device, iterations=4, precision=precision)
    before = sim.diagnostics()
    sim.run(50)
    after = sim.diagnostics()
    # 50 substeps, each adding to 36 particles' velocities some 100 roundings of numbers near 1.
    tolerance = np.finfo(precision).eps * np.sqrt(50 * 36 * 100) * 2
    assert np.abs(after.momentum - before.momentum).max() < tolerance


def test_far_from_the_origin(device, simulate, pair):
    """A pendulum 10 km away swings in float32 as at the origin: lengths do not lose digits."""

    def swing(shift, precision):
        scene = pair(x=np.array([(0, 0, 0), (1, 0, 0)]) + shift, pinned=[True, False], gravity=True)
        scene.add_constraint(ps.Distance([(0, 1)]))
        sim = simulate(scene, device, dt=1 / 60, substeps=100, precision=precision)
        sim.run(60)
        return sim.position[1] - shift, sim.velocity[1]

    (x, v), (x_far, v_far) = swing(0.0, "float64"), swing(1e4, "float32")
    assert np.abs(v_far - v).max() < 1e-2  # 6000 roundings of v, and of a length by 1e-7 over h
    assert np.abs(x_far - x).max() < 2e-3  # the last bit of 1e4 is 1e-3


def test_periodic_tuples_take_the_nearest_image(device, precision, simulate, laws):
    """Across the faces of a periodic box, for the law and for the built-in alike."""
    for make in (
        lambda: ps.Distance([(0, 1)], 0.3),
        lambda: ps.Constraint(laws.distance, [(0, 1)], rest_length=0.3),
    ):
        scene = ps.Scene(periodic=((0, 0, 0), (1, 1, 1)))
        scene.add_particles([(0.95, 0.5, 0.5), (0.05, 0.5, 0.5)])
        scene.add_constraint(make())
        sim = simulate(scene, device, precision=precision)
        sim.project(1)
        # From 0.1 apart to 0.3, each by 0.1.
        assert np.allclose(sim.position[:, 0], [0.85, 0.15], atol=1e-6)


def test_rest_length_from_the_start_is_across_faces(device, simulate):
    """None: the distances at the start, to the nearest image."""
    scene = ps.Scene(periodic=((0, 0, 0), (1, 1, 1)))
    scene.add_particles([(0.95, 0.5, 0.5), (0.05, 0.5, 0.5)], velocity=[(-1, 0, 0), (1, 0, 0)])
    scene.add_constraint(ps.Distance([(0, 1)]))
    sim = simulate(scene, device, precision="float64")
    sim.step()
    assert np.allclose(sim.position[:, 0], [0.95, 0.05], atol=1e-15)


def test_static_projection_gives_no_velocity(device, simulate, pair):
    """sim.project moves the start onto the constraints, rigidly."""
    scene = pair(x=[(0, 0, 0), (2, 0, 0)])
    scene.add_constraint(ps.Distance([(0, 1)], 1.0, compliance=1.0))
    sim = simulate(scene, device, precision="float64")
    sim.project(1)
    assert np.allclose(sim.position[:, 0], [0.5, 1.5])
    sim.step()
    assert np.allclose(sim.velocity, 0)
