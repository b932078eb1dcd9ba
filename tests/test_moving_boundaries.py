"""Boundaries in motion: pistons, lifts, belts, turntables, drums, and what keeps them exact."""

import numpy as np
import pytest

import particlesim as ps

G, INF, UP = 9.81, np.inf, (0, 1, 0)


def simulate(scene, device="cpu", **knobs):
    """Float64 and one substep of 10 ms a frame, where the test does not say otherwise."""
    knobs = {"dt": 0.01, "substeps": 1, "precision": "float64"} | knobs
    return ps.Simulation(scene, ps.Settings(**knobs), device=device)


def scene_of(x, *boundaries, gravity=False, **particles):
    """Particles that meet boundaries."""
    scene = ps.Scene()
    scene.add_particles(x, **particles)
    for each in boundaries:
        scene.add_constraint(each)
    if gravity:
        scene.add_interaction(ps.UniformGravity((0, -G, 0)))
    return scene


def floor(**motion):
    """A horizontal plane through the origin."""
    return ps.PlaneBoundary((0, 0, 0), UP, **motion)


def drum(**motion):
    """A box off the origin that tumbles as it goes."""
    return ps.BoxBoundary(
        (-1, -0.5, -1), (1, 0.7, 1), velocity=(0.5, 0.1, -0.2), angular_velocity=(0.3, 0.5, 2.0),
        **motion,
    )  # fmt: skip


def grains(*boundaries, count=100, gravity=True):
    """Grains of many sizes and speeds about the origin."""
    rng = np.random.default_rng(count)
    return scene_of(
        rng.uniform(-0.4, 0.4, (count, 3)), *boundaries, gravity=gravity,
        radius=rng.uniform(0, 0.1, count), velocity=rng.normal(0, 2, (count, 3)),
    )  # fmt: skip


# Laws of mechanics --------------------------------------------------------------------------------


def test_piston_reflects_into_its_own_frame(precision, device):
    """Particles that do not meet each other: v -> 2u - v along the piston, unchanged across it."""
    rng = np.random.default_rng(0)
    x = rng.uniform((-1, 0.1, -1), (1, 1, 1), (50, 3))
    v = rng.uniform((-1, -6, -1), (1, -4, 1), (50, 3))
    u = 1.5
    sim = simulate(
        scene_of(x, floor(restitution=1.0, velocity=(0.7, u, 0)), velocity=v), device,
        precision=precision,
    )  # fmt: skip
    sim.run(40)
    after = np.stack([v[:, 0], 2 * u - v[:, 1], v[:, 2]], axis=1)
    # The hit rounds v + correction / h, whose parts are up to 2 |v - u|.
    assert np.allclose(sim.velocity, after, atol=50 * np.finfo(precision).eps)


def test_lift_carries_what_lies_on_it(precision, device):
    """At u, from the start on; the place is that of the floor at that time."""
    u, radius, frames, eps = 1.5, 0.1, 200, float(np.finfo(precision).eps)
    scene = scene_of([(0, radius, 0)], floor(velocity=(0, u, 0)), radius=radius, gravity=True)
    sim = simulate(scene, device, precision=precision, substeps=10)
    sim.run(frames)
    height = radius + u * frames * sim.settings.dt
    # A height of 3 is rounded to 2 eps; the clock, in float64, in each of its 2000 steps up to 2.
    assert sim.position[0, 1] == pytest.approx(height, abs=4 * eps + u * 2000 * 2.2e-16)
    # The velocity is the way of a substep over h: places of 3 are rounded twice.
    assert sim.velocity[0, 1] == pytest.approx(u, abs=4 * eps / sim.settings.substep)


def test_sinking_floor_is_fallen_after(device):
    """A floor that sinks faster than what fell has come leaves it in free fall."""
    scene = scene_of([(0, 0, 0)], floor(velocity=(0, -30, 0)), gravity=True)
    sim = simulate(scene, device)
    sim.run(100)
    assert sim.velocity[0, 1] == pytest.approx(-G, rel=1e-12)


@pytest.mark.parametrize("slope", [0.0, 0.3])
def test_belt_drags_until_nothing_slips(slope, precision, device):
    """At mu g to the speed of the belt, in a way of v^2 / (2 mu g); then it goes along.

    On a slope the belt works against g sin: at g (mu cos - sin).
    """
    mu, speed, dt, radius = 0.5, 2.0, 1e-3, 0.1
    n = np.array([-np.sin(slope), np.cos(slope), 0.0])
    uphill = np.array([np.cos(slope), np.sin(slope), 0.0])
    belt = ps.PlaneBoundary((0, 0, 0), n, friction=mu, velocity=speed * uphill)
    scene = scene_of([radius * n], belt, radius=radius, gravity=True)
    sim = simulate(scene, device, dt=dt, precision=precision)
    a = G * (mu * np.cos(slope) - np.sin(slope))
    sim.run(round(speed / a / 2 / dt))
    # Rounding of places near 1 over dt: 1e-4 in float32.
    assert sim.velocity[0] @ uphill == pytest.approx(a * sim.time, abs=2e-3)
    sim.run(round(speed / a / dt))
    rest = sim.velocity[0]
    assert np.allclose(rest, speed * uphill, atol=2e-3)
    slipping = speed / a
    way = speed**2 / (2 * a) + speed * (sim.time - slipping)
    # Symplectic Euler runs a h t / 2 ahead, and stops slipping within a substep.
    assert sim.position[0] @ uphill == pytest.approx(way, abs=2 * speed * dt)
    assert belt.pose(sim.time)[0] == pytest.approx(np.zeros(3), abs=1e-15)


def test_turntable_takes_along(device):
    """What grips it goes round with it: the angle is omega t, the radius stays."""
    omega, r, dt = 2.0, 0.3, 0.01
    table = floor(friction=1.0, angular_velocity=(0, omega, 0))
    scene = scene_of(
        [(r, 0.05, 0)], table, radius=0.05, velocity=(0, 0, -omega * r), gravity=True
    )  # fmt: skip
    sim = simulate(scene, device, dt=dt)
    sim.run(100)
    x, _, z = sim.position[0]
    # Halfway velocities: a way of tan(omega h / 2) 2 / omega, off by (omega h)^2 / 12 of the angle;
    # halfway by the way that it would have gone leads outward by (omega h)^2 / 4 in all.
    error = (omega * dt) ** 2
    assert np.hypot(x, z) == pytest.approx(r, rel=error)
    assert np.arctan2(-z, x) == pytest.approx(omega * sim.time, rel=error)


def test_turntable_lets_slip_what_is_too_far_out(device):
    """Where omega^2 r > mu g nothing stays."""
    table = floor(friction=0.1, angular_velocity=(0, 2.0, 0))
    sim = simulate(
        scene_of([(0.3, 0, 0)], table, velocity=(0, 0, -0.6), gravity=True), device
    )  # fmt: skip
    sim.run(200)
    assert np.hypot(*sim.position[0, [0, 2]]) > 0.5


def test_a_spinning_ball_drags_what_lies_in_it(device):
    """A rough bowl that spins about the vertical sets a grain near its lowest place going round."""
    bowl = ps.SphereBoundary((0, 1, 0), 1.0, friction=1.0, angular_velocity=(0, 1.0, 0))
    s = 0.2  # sin of the place's angle, so that mu holds it there
    scene = scene_of([(s, 1 - np.sqrt(1 - s * s), 0)], bowl, gravity=True)
    sim = simulate(scene, device, dt=1e-3)
    sim.run(1000)
    x, _, z = sim.position[0]
    # It slips for omega s / (mu g) = 20 ms, and then goes round at omega.
    assert np.arctan2(-z, x) == pytest.approx(1.0, abs=0.02)
    assert np.hypot(x, z) == pytest.approx(s, rel=0.05)


# Where they are -----------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", ["plane", "box", "sphere"])
def test_pose_is_a_rigid_motion(kind):
    """About the own middle, by turns of the right sense, and the way that was gone."""
    spin, velocity, time = np.array([0.3, -0.5, 1.1]), np.array([1.0, 2.0, -3.0]), 1.7
    motion = {"velocity": velocity, "angular_velocity": spin}
    boundary, middle = {
        "plane": (ps.PlaneBoundary((1, 2, 3), (1, 1, 0), **motion), (1, 2, 3)),
        "box": (ps.BoxBoundary((0, 1, 2), (2, 3, 4), **motion), (1, 2, 3)),
        "sphere": (ps.SphereBoundary((1, 2, 3), 1.0, **motion), (1, 2, 3)),
    }[kind]
    at = np.array([[0.5, -1.0, 2.0], [4.0, 0.0, 0.0], middle])
    T, R = boundary.pose(time)
    angle = np.linalg.norm(spin) * time if kind != "sphere" else 0.0  # it turns in itself
    turned = ps.sample.rotate(at - middle, spin, angle) + middle + velocity * time
    assert np.allclose(at @ R.T + T, turned, atol=1e-14)
    T, R = boundary.pose(0.0)
    assert np.array_equal(T, np.zeros(3))
    assert np.array_equal(R, np.eye(3))


def test_nothing_leaves_a_drum(precision, device):
    """Turning and going: every grain is within, as seen from the box's own pose."""
    box = drum(friction=0.3, restitution=0.4)
    sim = simulate(grains(box), device, precision=precision)
    sim.run(200)
    T, R = box.pose(sim.time)
    seen, radius = (sim.position - T) @ R, sim.get("radius")[:, None]
    # Places of about 1, moved there and back.
    error = 8 * np.finfo(precision).eps
    assert (seen - radius >= box.lower - error).all()
    assert (seen + radius <= box.upper + error).all()
    assert np.linalg.norm(sim.velocity, axis=1).max() < 8


def test_far_and_long(device):
    """In float32, a kilometre on after 1000 s, a lift is where it is to a part in 10^7."""
    plane = floor(velocity=(0, 1, 0))
    scene = scene_of([(0, 0, 0)], plane, velocity=(0, 1, 0))
    sim = simulate(scene, device, dt=10.0, substeps=100, precision="float32")
    sim.run(100)
    assert sim.position[0, 1] == pytest.approx(1000, rel=2e-7)
    assert plane.pose(1000.0)[0].tolist() == [0, 1000, 0]


def test_static_projection_goes_by_the_clock(device):
    """``project`` brings what is outside onto the floor where that is now."""
    sim = simulate(scene_of([(0, 0, 0)], floor(velocity=(0, 2, 0))), device)
    sim.run(50)
    sim.position = [(0, -1, 0)]
    sim.project(1)
    assert sim.position[0, 1] == pytest.approx(1.0, abs=1e-13)


def test_start_under_a_moving_floor_is_brought_in_slowly(device):
    """Against the floor, at no more than the depenetration speed, give or take its own."""
    u = 3.0
    scene = scene_of([(0, -0.4, 0)], floor(velocity=(0, u, 0)), radius=0.1, velocity=(0, u, 0))
    sim = simulate(scene, device, dt=1 / 60, substeps=10, depenetration_speed=1.0)
    for _ in range(120):
        sim.step()
        assert sim.velocity[0, 1] <= u + 1.0 + 1e-9
    assert sim.position[0, 1] >= 0.1 + u * sim.time - 1e-9


# Worlds, restarts, cost ---------------------------------------------------------------------------


def shaken(k):
    """Grains in a drum on a belt, of world k; the boundaries of world 0 are at rest."""
    spin, speed = 0.7 * k, 0.5 * k
    return grains(
        ps.BoxBoundary((-1, -1, -1), (1, 1, 1), friction=0.2, restitution=0.3,
                       angular_velocity=(0, 0, spin)),
        ps.PlaneBoundary((0, -0.8, 0), UP, friction=0.4, velocity=(speed, 0.1 * k, 0)),
        ps.SphereBoundary((0, -0.5, 0), 0.2, inside=False, velocity=(0, 0, -0.2 * k)),
        count=30 + k,
    )  # fmt: skip


def test_a_world_in_a_batch_equals_it_alone(precision, device):
    """Bit for bit, also the one in which nothing moves."""
    knobs = {"dt": 1 / 60, "substeps": 4, "precision": precision}
    together = simulate([shaken(k) for k in range(3)], device, **knobs)
    together.run(40)
    for k in range(3):
        alone = simulate(shaken(k), device, **knobs)
        alone.run(40)
        assert np.array_equal(together.world(k).position, alone.position)
        assert np.array_equal(together.world(k).velocity, alone.velocity)


def test_reset_and_checkpoint(tmp_path, device):
    """A world that is reset goes as at first; a run that was saved goes on, bit for bit."""
    scenes = [shaken(k) for k in range(1, 3)]
    straight = simulate(scenes, device)
    straight.run(20)
    first = straight.world(0).position
    sim = simulate(scenes, device)
    sim.run(7)
    sim.reset([0])
    sim.save(tmp_path / "half.npz")
    sim.run(20)
    assert np.array_equal(sim.world(0).position, first)
    loaded = ps.Simulation.load(tmp_path / "half.npz", scenes, device=device)
    loaded.run(20)
    assert np.array_equal(loaded.position, sim.position)


def test_graph_equals_threads():
    """Bit for bit, however the launches are cut."""
    found = []
    for knobs in ({"execution": "graph"}, {"execution": "threads", "threads": 3}):
        sim = simulate(grains(drum(friction=0.5), count=3000), **knobs)
        sim.run(5)
        found.append((sim.position, sim.velocity))
        sim.close()
    assert np.array_equal(found[0], found[1])


def test_only_what_moves_has_a_clock(device):
    """Boundaries at rest allocate no time and launch nothing for it."""
    for motion in ({}, {"velocity": (0, 1, 0)}):
        sim = simulate(grains(floor(**motion)), device)
        keys = [key for _, key, _ in sim.explain().launches]
        assert any("place_shapes" in key for key in keys) == bool(motion)
        assert ("time" in sim.state) == bool(motion)
        assert sim.scenes[0].constraints[0].shapes()[0]["moving"] == bool(motion)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: floor(velocity=(1, 2)), r"PlaneBoundary: velocity must have shape \(3,"),
        (lambda: floor(velocity=(1, 2, INF)), "PlaneBoundary: velocity.2. must be finite"),
        (
            lambda: ps.BoxBoundary((0, 0, 0), (1, INF, 1), angular_velocity=(0, 0, 1)),
            "BoxBoundary: angular_velocity must be 0 where sides are open",
        ),
    ],
)
def test_bad_arguments(make, message, refused):
    """Each in the house form."""
    with refused(message):
        make()


def test_turning_into_a_periodic_axis(device, refused):
    """A plane may turn about an axis that its normal keeps off the periodic ones, and no other."""
    scene = ps.Scene(periodic=((0, None, None), (1, None, None)))
    scene.add_particles([(0.5, 0.5, 0.5)])
    scene.add_constraint(floor(angular_velocity=(2.0, 0, 0)))
    simulate(scene, device).run(2)
    scene.add_constraint(floor(angular_velocity=(0, 0, 2.0)))
    with refused("PlaneBoundary: normal must be along the open axes"):
        simulate(scene, device)
