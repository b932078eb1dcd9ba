"""Shape matching: rigid bodies by Euler's equations, soft ones by statics, and bad input."""

import numpy as np
import pytest
import warp as wp

import particlesim as ps
from cases.worlds import equal_alone, goes_on_after_reset_and_save
from particlesim.kernels.engine.bounces import bounces_type
from particlesim.kernels.precision import FLOAT64

G = 9.81
EPS = float(np.finfo(np.float64).eps)
# A body of six masses with different moments about its axes, and what these are.
ARMS = np.array([0.3, 0.2, 0.1])
TOP = np.concatenate([np.diag(ARMS), -np.diag(ARMS)])
MOMENTS = 2 * (np.square(ARMS).sum() - np.square(ARMS))


@pytest.fixture
def thrown(scene_of):
    """A function: a scene of one cluster that spins and flies."""

    def make(x, spin, velocity=(0, 0, 0), mass=1.0, **options):
        x = np.asarray(x, dtype=float)
        m = np.broadcast_to(mass, len(x))
        v = velocity + np.cross(spin, x - m @ x / m.sum())
        body = ps.ShapeMatching([range(len(x))], **options)
        return scene_of(x, body, velocity=v, mass=mass)

    return make


def distances(x):
    return np.linalg.norm(x[:, None] - x[None], axis=2)


def spin_of(sim):
    """Angular momentum about the centre of mass."""
    found = sim.diagnostics()
    m = sim.get("mass")
    return np.ravel(found.angular_momentum) - np.cross(
        m @ sim.position / m.sum(), np.ravel(found.momentum)
    )


def euler(spin, time, steps=4000):
    """The rotation of TOP after that time, by Euler's equations and the classical Runge-Kutta."""

    def slope(R, w):
        W = np.array([[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]])
        return R @ W, -np.cross(w, MOMENTS * w) / MOMENTS

    R, w, h = np.eye(3), np.array(spin, dtype=float), time / steps
    for _ in range(steps):
        a, b = slope(R, w)
        c, d = slope(R + h / 2 * a, w + h / 2 * b)
        e, f = slope(R + h / 2 * c, w + h / 2 * d)
        g, i = slope(R + h * e, w + h * f)
        R, w = R + h / 6 * (a + 2 * c + 2 * e + g), w + h / 6 * (b + 2 * d + 2 * f + i)
    return R


def test_a_racket_flips_as_eulers_equations_have_it(simulate, thrown):
    """About the middle axis a free body turns over again and again (Dzhanibekov): after 2 s it
    has once. The method is of second order: half the step, a quarter of the error.
    """
    scene, time = thrown(TOP, (0.3, 6.0, 0.0)), 2.0
    R = euler((0.3, 6.0, 0.0), time)
    assert R[1, 1] < -0.9
    errors = []
    for substeps in (2, 4):
        sim = simulate(scene, substeps=substeps)
        sim.run(round(time / 0.01))
        errors.append(np.abs(sim.position - TOP @ R.T).max())
    # From an unstable axis what is off grows by e^(2.7 t); terms of fourth order are h^2 of it.
    assert errors[0] / errors[1] == pytest.approx(4, rel=0.02)
    assert errors[1] < 1e-3


@pytest.mark.parametrize("body", ["rigid", "soft"])
def test_momentum_and_angular_momentum_are_kept(body, simulate, thrown):
    rng = np.random.default_rng(0)
    x = rng.uniform(0, 0.3, (12, 3))
    options = {"mass": rng.uniform(0.5, 1.5, 12), "compliance": 0.01 * (body == "soft")}
    scene = thrown(x, (1, 4, -2), (1, 2, 0.5), **options)
    frames, substeps = 20, 10
    sim = simulate(scene, substeps=substeps)
    before, spin = sim.diagnostics(), spin_of(sim)
    sim.run(frames)
    # A substep rounds goals by eps of the size, 0.3 m, so velocities by that over dt = 1 ms:
    # 7e-14 m/s of 1 m/s, and of spins of 4.6 /s by 1.6e-14 of them; at worst all one way, and the
    # sums that a goal comes of have some ten roundings of this size.
    worst = 10 * EPS * 0.3 / 1e-3 * frames * substeps
    assert np.abs(sim.diagnostics().momentum - before.momentum).max() < worst * scene.mass.sum()
    assert np.abs(spin_of(sim) - spin).max() < worst * np.linalg.norm(spin)
    if body == "rigid":
        assert np.abs(distances(sim.position) - distances(x)).max() < 1e-14


@pytest.mark.slow
@pytest.mark.parametrize(("precision", "bound"), [("float64", 2e-11), ("float32", 1e-5)])
def test_a_thrown_body_keeps_its_spin_for_two_seconds(precision, bound, simulate, thrown):
    """2400 substeps, each of which rounds by eps / (omega dt), of random sign:
    2.2e-16 / (4.6 * 8.3e-4) * 49 = 2.8e-12, and some terms of it; in float32 places are sums of
    two numbers, and velocities of 2 m/s are rounded by 1.2e-7 of them.
    """
    rng = np.random.default_rng(0)
    scene = thrown(
        rng.uniform(0, 0.3, (12, 3)), (1, 4, -2), (1, 2, 0.5), mass=rng.uniform(0.5, 1.5, 12)
    )
    sim = simulate(scene, precision=precision, dt=1 / 60, substeps=20)
    spin = spin_of(sim)
    sim.run(120)
    assert np.abs(spin_of(sim) - spin).max() < bound * np.linalg.norm(spin)


@pytest.mark.parametrize("spin", [(30, 100, -50), (3e3, 1e4, -5e3)])
def test_no_spin_is_too_fast(spin, simulate, thrown):
    """Over one radian in a substep the rotation is the nearest one; the momentum is kept still."""
    sim = simulate(thrown(TOP, spin))
    L = spin_of(sim)
    sim.run(20)
    # The way of a substep is up to 100 times the body's size: its rounding times that.
    assert np.abs(spin_of(sim) - L).max() < 1e-9 * np.linalg.norm(L)
    assert np.abs(distances(sim.position) - distances(TOP)).max() < 1e-13


@pytest.mark.parametrize("places", [
    [(0, 0, 0), (1, 0, 0)], [(0, 0, 0), (1, 0, 0), (3, 0, 0)],
    [(0, 0, 0), (1, 0, 0), (0, 1, 0), (1, 1, 0)], [(0, 0, 0), (0, 0, 0), (1, 0, 0)],
    [(1, 1, 1), (1, 1, 1)],
], ids=["pair", "line", "plane", "two in one place", "all in one place"])  # fmt: skip
def test_thin_clusters(places, simulate, thrown):
    sim = simulate(thrown(places, (0.3, 1, 2), (1, 0, 0)))
    L = spin_of(sim)
    sim.run(50)
    assert np.abs(distances(sim.position) - distances(np.array(places, float))).max() < 1e-14
    # 50 roundings of eps times the size, 2, over dt.
    assert np.abs(spin_of(sim) - L).max() < 50 * 10 * EPS * 2 / 0.01


def test_a_gyroscope_precesses(simulate):
    """A wheel on a horizontal axis of length l that is held at one end: Omega = M g l / (I omega).

    Started as it precesses, it goes on so, but for the half substep by which symplectic Euler is
    ahead: an offset of the order of Omega dt.
    """
    radius, length, spin = 0.2, 0.3, 60.0
    k = np.arange(8) * np.pi / 4
    wheel = np.stack([np.full(8, length), radius * np.cos(k), radius * np.sin(k)], axis=1)
    precession = G * length / (radius**2 * spin)
    v = np.cross((spin, precession, 0), wheel)
    scene = ps.Scene()
    pivot = scene.add_particles([(0, 0, 0)], pinned=True)
    rim = scene.add_particles(wheel, velocity=v)
    scene.add_interaction(ps.UniformGravity((0, -G, 0)))
    scene.add_constraint(ps.ShapeMatching([[*pivot, *rim]]))
    sim = simulate(scene, substeps=12)
    sim.run(50)
    x, y, z = sim.position[1:].mean(axis=0)
    dt = 0.01 / 12
    assert np.arctan2(-z, x) == pytest.approx(precession * 0.5, abs=2 * precession * dt)
    assert abs(y) < length * precession * dt  # it nutates a little, and does not sink
    assert sim.position[0].tolist() == [0, 0, 0]


def test_a_soft_cluster_hangs_as_deep_whatever_the_iterations(simulate, scene_of):
    """Three members in a line, the middle one pinned: each end is a spring of m / (mean m) / alpha
    to its goal, and weighs on it by m g: on average they go down by g alpha (mean m). The line is
    free to turn, which drag makes it do before it rests.
    """
    x, m, alpha = np.array([(-1, 0, 0), (0, 0, 0), (2, 0, 0)], float), np.array([2.0, 1, 1]), 1e-3
    for iterations in (1, 4):
        body = ps.ShapeMatching([range(3)], compliance=alpha)
        scene = scene_of(x, body, gravity=True, mass=m, pinned=[False, True, False])
        scene.add_interaction(ps.Drag(20.0))
        sim = simulate(scene, iterations=iterations)
        sim.run(300)
        # The pinned one holds the goals but for one part in 1e4 of the way.
        fall = (m[[0, 2]] @ sim.position[[0, 2], 1]) / 3
        assert fall == pytest.approx(-G * alpha * 1.5, rel=3e-4)
        assert sim.force(body) == pytest.approx(2 * G, rel=1e-6)


@pytest.mark.slow
def test_velocities_become_rigid(simulate, scene_of):
    """What members of a body are pushed by goes to all of it, momentum and spin unchanged."""
    rng = np.random.default_rng(1)
    n = 300  # more than one chunk
    x, m = rng.normal(size=(n, 3)), rng.uniform(0.5, 2, n)
    sim = simulate(scene_of(x, ps.ShapeMatching([range(n)]), mass=m))
    (body,) = sim.constraints
    v = rng.normal(size=(n, 3))
    sim.state.velocity.assign(v)
    bounces = bounces_type(FLOAT64)()
    bounces.running = wp.ones(1, dtype=wp.int32, device="cpu")
    body.bounce(sim.state, sim.neighbors, bounces, 0.01)
    u = sim.velocity
    # Sums of 300 terms of size 1 to 3.
    assert np.abs(m @ (u - v)).max() < n * 3 * EPS
    assert np.abs(m @ np.cross(x, u - v)).max() < n * 9 * EPS
    approach = ((x[:, None] - x[None]) * (u[:, None] - u[None])).sum(axis=2)
    assert np.abs(approach).max() < 100 * EPS


@pytest.mark.slow
def test_a_large_cluster_is_one_of_chunks(simulate, thrown):
    """10 000 members, in chunks that threads share: the same as of any number of threads."""
    x = ps.sample.box((0, 0, 0), (2.5, 2.0, 2.0), 0.1)
    scene, ends = thrown(x, (1, 2, 3)), []
    for threads in (1, 2):
        sim = simulate(scene, threads=threads)
        L = spin_of(sim)
        sim.run(50)
        ends.append(sim.position)
        # As above, of sums of 1e4 terms.
        assert np.abs(spin_of(sim) - L).max() < 1e-10 * np.linalg.norm(L)
    assert np.array_equal(*ends)
    assert np.abs(sim.position[0] - sim.position[-1]).max() > 0


@pytest.mark.slow
def test_worlds_resets_and_checkpoints(simulate, tmp_path):
    def scene(count):
        rng = np.random.default_rng(count)
        made = ps.Scene(periodic=((0, 0, 0), (4, 4, 4)))
        made.add_particles(rng.uniform(0, 1, (count, 3)), velocity=rng.normal(size=(count, 3)))
        clusters = [range(5), range(3, count)]
        made.add_constraint(
            ps.ShapeMatching(clusters, [0, 0.01], yield_strain=0.01, break_force=[1e9, 30.0])
        )
        return made

    scenes = [scene(12), scene(400)]
    equal_alone(simulate, scenes, "cpu", 20)
    goes_on_after_reset_and_save(
        lambda given, device: simulate(given, device), scenes, "cpu", tmp_path / "run.npz"
    )


@pytest.mark.slow
def test_a_press_leaves_its_shape(simulate):
    """A cube pressed to half its height between two plates stays low when they are gone, of the
    volume that it had.
    """
    scene = ps.Scene()
    cube = scene.add_particles(ps.sample.box((0, 0, 0), (0.4, 0.4, 0.4), 0.1), radius=0.03)
    body = scene.add_constraint(
        ps.ShapeMatching([cube], 1e-4, yield_strain=0.05, creep=50.0, largest_strain=2.0)
    )
    scene.add_constraint(ps.PlaneBoundary((0, 0, 0), (0, 1, 0)))
    press = ps.PlaneBoundary((0, 0.45, 0), (0, -1, 0), velocity=(0, -0.3, 0))
    scene.add_constraint(press)
    sim = simulate(scene)
    sim.run(75)
    (found,) = (each for each in sim.constraints if each.name == body.name)
    shape = np.eye(3) + found.struct.strain.numpy()[0]
    assert np.linalg.det(shape) == pytest.approx(1, abs=1e-9)
    assert np.linalg.svd(shape)[1].min() < 0.7


@pytest.mark.slow
def test_a_cluster_breaks(simulate, scene_of):
    """Two masses whose spin pulls them apart by m omega^2 r, at the goals 0.5 and 1 m off."""
    x, ends = np.array([(-1, 0, 0), (1, 0, 0)], float), []
    for limit in (0.9, 1.1):  # of m omega^2 r = 4
        body = ps.ShapeMatching([range(2)], break_force=4 * limit)
        sim = simulate(scene_of(x, body, velocity=np.cross((0, 0, 2), x)))
        sim.run(30)
        ends.append((bool(sim.broken(body)[0]), np.ptp(sim.position, axis=0)))
    assert ends[0][0] and np.linalg.norm(ends[0][1]) > 2.05
    assert not ends[1][0] and np.linalg.norm(ends[1][1]) == pytest.approx(2, abs=1e-12)


def test_pinned_members(simulate, scene_of):
    """One is a pivot, all are as they were."""
    for pinned in ([True, False, False], [True, True, True]):
        x = np.array([(0, 1, 0), (1, 1, 0), (1, 2, 0)], float)
        sim = simulate(scene_of(x, ps.ShapeMatching([range(3)]), gravity=True, pinned=pinned))
        sim.run(20)
        assert np.array_equal(sim.position[pinned], x[pinned])
        # By 1e-4 of the way in a substep, g dt^2 = 1e-3 m.
        assert np.abs(distances(sim.position) - distances(x)).max() < 2e-7
