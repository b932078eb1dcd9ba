"""Boundaries in motion: pistons, lifts, belts, turntables."""

import numpy as np
import pytest

import particlesim as ps

G, UP = 9.81, (0, 1, 0)


def floor(**motion):
    """A horizontal plane through the origin."""
    return ps.PlaneBoundary((0, 0, 0), UP, **motion)


# Laws of mechanics --------------------------------------------------------------------------------


def test_piston_reflects_into_its_own_frame(precision, device, simulate, scene_of):
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


def test_lift_carries_what_lies_on_it(precision, device, simulate, scene_of):
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


def test_sinking_floor_is_fallen_after(device, simulate, scene_of):
    """A floor that sinks faster than what fell has come leaves it in free fall."""
    scene = scene_of([(0, 0, 0)], floor(velocity=(0, -30, 0)), gravity=True)
    sim = simulate(scene, device)
    sim.run(100)
    assert sim.velocity[0, 1] == pytest.approx(-G, rel=1e-12)


@pytest.mark.parametrize("slope", [0.0, 0.3])
def test_belt_drags_until_nothing_slips(slope, precision, device, simulate, scene_of):
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


def test_turntable_takes_along(device, simulate, scene_of):
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


def test_turntable_lets_slip_what_is_too_far_out(device, simulate, scene_of):
    """Where omega^2 r > mu g nothing stays."""
    table = floor(friction=0.1, angular_velocity=(0, 2.0, 0))
    sim = simulate(
        scene_of([(0.3, 0, 0)], table, velocity=(0, 0, -0.6), gravity=True), device
    )  # fmt: skip
    sim.run(200)
    assert np.hypot(*sim.position[0, [0, 2]]) > 0.5


def test_a_spinning_ball_drags_what_lies_in_it(device, simulate, scene_of):
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
