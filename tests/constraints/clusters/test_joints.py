"""Joints of rigid clusters: the physical pendulum, free pairs, limits, forces, and bad input."""

import numpy as np
import pytest
import warp as wp

import particlesim as ps
from cases.worlds import equal_alone, goes_on_after_reset_and_save
from particlesim.kernels.engine.bounces import bounces_type
from particlesim.kernels.precision import FLOAT64

G = 9.81
EPS = float(np.finfo(np.float64).eps)
BOX = ps.sample.box((0, 0, 0), (0.4, 0.2, 0.2), 0.1)
COUNT = len(BOX)


def turn_of(y, x):
    """The rotation that takes x to y, by the singular value decomposition (Kabsch 1976)."""
    u, _, v = np.linalg.svd((y - y.mean(axis=0)).T @ (x - x.mean(axis=0)))
    return u @ np.diag([1, 1, np.sign(np.linalg.det(u @ v))]) @ v


def material(y, x, point):
    """Where a point of a body is."""
    return y.mean(axis=0) + turn_of(y, x) @ (np.asarray(point) - x.mean(axis=0))


def pair(joint, spins, middle=(0.45, 0.1, 0.1)):
    """Two boxes, one behind the other along x, in a joint, each with a spin about the middle."""
    x = np.concatenate([BOX, BOX + np.array([0.5, 0, 0])])
    scene = ps.Scene()
    v = np.repeat(spins, COUNT, axis=0)
    scene.add_particles(x, velocity=np.cross(v, x - middle))
    scene.add_constraint(joint)
    scene.add_constraint(ps.ShapeMatching([range(COUNT), range(COUNT, 2 * COUNT)]))
    return scene


def test_a_box_on_a_hinge_is_a_physical_pendulum(simulate):
    """Let go level, its period is 1.180341 times that of small swings, 2 pi (I / (M g l))^(1/2),
    and the amplitude stays.
    """
    length = 0.25
    x = BOX - BOX.mean(axis=0) + (length, 0, 0)
    scene = ps.Scene()
    scene.add_particles(x)
    scene.add_interaction(ps.UniformGravity((0, -G, 0)))
    scene.add_constraint(ps.Hinge(range(COUNT), None, (0, 0, 0), (0, 0, 1)))
    scene.add_constraint(ps.ShapeMatching([range(COUNT)]))
    moment = np.square(x[:, :2]).sum()
    period = 1.180341 * 2 * np.pi * np.sqrt(moment / (COUNT * G * length))
    sim, angles, far = simulate(scene, substeps=5), [], []
    for _ in range(round(1.4 * period / 0.01)):
        sim.step()
        c = sim.position.mean(axis=0)
        angles.append(np.arctan2(c[0], -c[1]))
        far.append(np.linalg.norm(c) - length)
    angles = np.array(angles)
    (down,) = np.nonzero((angles[:-1] > 0) & (angles[1:] <= 0))
    crossed = down + 1 + angles[down] / (angles[down] - angles[down + 1])
    # Between frames of 10 ms the angle is taken as a line, off by theta'' t^2 / 8 at most, where
    # theta'' is 0 at the crossing: 1e-5 of a period. The method is of second order,
    # (omega dt)^2 / 24 with omega = 6.3 and dt = 2 ms: 1e-5.
    assert np.diff(crossed)[0] * 0.01 == pytest.approx(period, rel=1e-4)
    assert angles.min() == pytest.approx(-np.pi / 2, abs=2e-3)  # between two frames at rest
    # One sweep leaves the square of what it corrects, (theta'^2 dt^2)^2.
    assert np.abs(far).max() < 1e-7
    assert np.abs(x - material(sim.position, x, x[0])).max() > 0.1


def pivoted(kind):
    where = (0.45, 0.1, 0.1)
    sides = range(COUNT), range(COUNT, 2 * COUNT)
    return ps.Hinge(*sides, where, (0, 1, 1)) if kind == "hinge" else ps.BallJoint(*sides, where)


@pytest.mark.parametrize("kind", ["hinge", pytest.param("ball", marks=pytest.mark.slow)])
def test_a_free_pair_keeps_momentum_angular_momentum_and_energy(kind, simulate):
    about = np.array([0.0, 1.0, 1.0]) / np.sqrt(2)
    spins = (3 * about + (1, 0, 0), -4 * about + (1, 0, 0))  # which the hinge lets be
    scene = pair(pivoted(kind), spins)
    sim = simulate(scene, iterations=4, substeps=5)
    before = sim.diagnostics()
    sim.run(5)
    first = sim.diagnostics().kinetic
    sim.run(60)
    after = sim.diagnostics()
    # 325 substeps, each rounding velocities by ten times eps of the size over dt, 2e-13, one way.
    worst = 325 * 10 * EPS * 1.0 / 2e-3
    assert np.abs(after.momentum - before.momentum).max() < worst * 2 * COUNT
    assert np.abs(after.angular_momentum - before.angular_momentum).max() < worst * 2 * COUNT
    # Symplectic, of second order: (omega dt)^2 = 6e-5.
    assert after.kinetic == pytest.approx(first, rel=3e-4)
    x, y = scene.position, sim.position
    a, b = (
        material(y[rows], x[rows], (0.45, 0.1, 0.1))
        for rows in (slice(COUNT), slice(COUNT, None))
    )  # fmt: skip
    assert np.linalg.norm(a - b) < 1e-7
    if kind == "hinge":
        turns = [turn_of(y[rows], x[rows]) @ about for rows in (slice(COUNT), slice(COUNT, None))]
        assert np.linalg.norm(turns[0] - turns[1]) < 1e-7


def test_a_hinge_stops_at_its_limit_and_tells_its_force(simulate):
    """A box that hangs from a level hinge at its end falls to -0.5 rad and rests there."""
    scene = ps.Scene()
    scene.add_particles(BOX)
    scene.add_interaction(ps.UniformGravity((0, -G, 0)))
    where = (0.0, 0.1, 0.1)
    hinge = scene.add_constraint(ps.Hinge(range(COUNT), None, where, (0, 0, 1), upper=0.5))
    scene.add_constraint(ps.ShapeMatching([range(COUNT)]))
    sim = simulate(scene, iterations=4)
    sim.run(200)
    R = turn_of(sim.position, BOX)
    # The angle of the world against the box is upper: the box has turned by -0.5.
    assert np.arctan2(R[1, 0], R[0, 0]) == pytest.approx(-0.5, abs=1e-6)
    assert np.abs(sim.velocity).max() < 1e-6
    # The stop is a torque alone: the point bears all the weight.
    assert sim.force(hinge) == pytest.approx(COUNT * G, rel=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["hinge", "ball"])
def test_a_change_of_velocities_goes_through_a_joint(kind, simulate):
    """One side is struck: the points keep together, and the axes; momentum and spin are kept."""
    scene = pair(pivoted(kind), [(0, 0, 0), (0, 0, 0)])
    sim, x, n = simulate(scene), scene.position, 2 * COUNT
    joint, before = sim.constraints[0], np.zeros((n, 3))
    push = np.zeros((n, 3))
    push[:COUNT] = np.cross((3, -1, 2), x[:COUNT] - x[:COUNT].mean(axis=0))
    push[:COUNT] += (1, 2, 3)
    sim.state.velocity.assign(push)
    bounces = bounces_type(FLOAT64)()
    bounces.before = wp.array(before, dtype=wp.vec3d, device="cpu")
    bounces.running = wp.ones(1, dtype=wp.int32, device="cpu")
    joint.bounce(sim.state, sim.neighbors, bounces, 0.01)
    u = sim.velocity
    # Sums of some tens of terms of size 3.
    assert np.abs((u - push).sum(axis=0)).max() < n * 3 * EPS
    assert np.abs(np.cross(x, u - push).sum(axis=0)).max() < n * 9 * EPS
    motions = []
    for rows in (slice(COUNT), slice(COUNT, None)):
        r = x[rows] - x[rows].mean(axis=0)
        inertia = (r**2).sum() * np.eye(3) - r.T @ r
        spin = np.linalg.solve(inertia, np.cross(r, u[rows]).sum(axis=0))
        at = np.array([0.45, 0.1, 0.1]) - x[rows].mean(axis=0)
        motions.append((u[rows].mean(axis=0) + np.cross(spin, at), spin))
    assert np.abs(motions[0][0] - motions[1][0]).max() < 1e3 * EPS
    apart = motions[0][1] - motions[1][1]
    assert np.linalg.norm(apart) > 0.1
    if kind == "hinge":
        # What keeps the answer of a line finite adds 1e-12 of the mean one, over the least one.
        assert np.abs(np.cross(apart, (0, 1, 1))).max() < 1e-10


@pytest.mark.slow
def test_joints_give_way_and_break(simulate):
    """A soft one by force times compliance; one that bears less than its load is gone."""
    for limit in (None, 0.99 * COUNT * G):
        scene = ps.Scene()
        scene.add_particles(BOX)
        scene.add_interaction(ps.UniformGravity((0, -G, 0)))
        middle, alpha = BOX.mean(axis=0), 1e-4
        joint = scene.add_constraint(
            ps.BallJoint(range(COUNT), None, middle, compliance=alpha, break_force=limit)
        )
        scene.add_interaction(ps.Drag(20.0))
        scene.add_constraint(ps.ShapeMatching([range(COUNT)]))
        sim = simulate(scene)
        sim.run(100)
        fall = middle - sim.position.mean(axis=0)
        if limit is None:
            # Drag lets it settle with exp(-10 t).
            assert fall == pytest.approx((0, COUNT * G * alpha, 0), abs=1e-5)
        else:
            assert sim.broken(joint).tolist() == [True] and fall[1] > 0.1


@pytest.mark.slow
def test_a_chain_of_boxes_holds(simulate):
    """Ten boxes swing down from level. In a substep each joint parts by some of g dt^2, and what
    one sweep hands on along the chain adds up to n^2 of that at most; five hand on more.
    """
    n, pitch = 10, 0.5
    x = np.concatenate([BOX + np.array([pitch * k, 0, 0]) for k in range(n)])
    rows = [range(COUNT * k, COUNT * (k + 1)) for k in range(n)]
    places = [(pitch * k - 0.05, 0.1, 0.1) for k in range(1, n)]
    worst = {}
    for iterations in (1, 5):
        scene = ps.Scene()
        scene.add_particles(x)
        scene.add_interaction(ps.UniformGravity((0, -G, 0)))
        scene.add_constraint(ps.BallJoint(rows[0], None, (-0.05, 0.1, 0.1)))
        scene.add_constraint(ps.BallJoint(rows[:-1], rows[1:], places))
        scene.add_constraint(ps.ShapeMatching(rows))
        sim = simulate(scene, dt=1 / 60, substeps=20, iterations=iterations)
        for _ in range(120):
            sim.step()
            y = sim.position
            gaps = [
                material(y[list(a)], x[list(a)], p) - material(y[list(b)], x[list(b)], p)
                for a, b, p in zip(rows[:-1], rows[1:], places, strict=True)
            ]
            off = np.linalg.norm(gaps, axis=1).max()
            worst[iterations] = max(off, worst.get(iterations, 0.0))
    assert worst[1] < n**2 * G / 1200**2
    assert worst[5] < 0.5 * worst[1]


@pytest.mark.slow
def test_worlds_resets_and_checkpoints(simulate, tmp_path):
    scenes = [
        pair(ps.Hinge(range(COUNT), range(COUNT, 2 * COUNT), (0.45, 0.1, 0.1), axis, -0.3, 0.2),
             [(0, 0, 1), (1, 2, -1)])
        for axis in ((0, 0, 1), (0, 1, 1))
    ]  # fmt: skip
    equal_alone(simulate, scenes, "cpu", 20)
    goes_on_after_reset_and_save(
        lambda given, device: simulate(given, device), scenes, "cpu", tmp_path / "run.npz"
    )


def test_bad_joints(refused):
    with refused(r"a\[0\] must hold at least 2"):
        ps.BallJoint([0], None, (0, 0, 0))
    with refused(r"b\[0\] must hold other particles than a, got 1"):
        ps.BallJoint([0, 1], [1, 2], (0, 0, 0))
    with refused("a must hold a cluster for each of 2 points"):
        ps.BallJoint([[0, 1]], None, [(0, 0, 0), (1, 0, 0)])
    with refused(r"axis\[0\] must have a direction"):
        ps.Hinge([0, 1], None, (0, 0, 0), (0, 0, 0))
    with refused(r"lower\[0\] must be from -3.14159 to 0"):
        ps.Hinge([0, 1], None, (0, 0, 0), (0, 0, 1), lower=0.1)
    with refused("point"):
        ps.BallJoint([0, 1], None, (0, 0, np.nan))
