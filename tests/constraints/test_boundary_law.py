"""Boundaries from one law, a signed distance: against the ready ones and closed forms."""

import numpy as np
import pytest
import warp as wp

import particlesim as ps

G = 9.81


@ps.law
def half_space(x: wp.vec3, point: wp.vec3, normal: wp.vec3):
    return wp.dot(x - point, normal)


@ps.law
def ball(x: wp.vec3, center: wp.vec3, radius: float, side: float = 1.0):
    return side * (wp.length(x - center) - radius)


@ps.law
def torus(x: wp.vec3, ring: float, tube: float):
    return wp.length(wp.vec2(wp.length(wp.vec2(x[0], x[2])) - ring, x[1])) - tube


@ps.law
def pipe(x: wp.vec3, axis: wp.vec3, radius: float):
    """The inside of a cylinder about an axis through the origin, a unit vector."""
    return radius - wp.length(x - axis * wp.dot(x, axis))


@ps.law
def post(x: wp.vec3, radius: float):
    """The outside of a cylinder about y."""
    return wp.sqrt(x[0] * x[0] + x[2] * x[2]) - radius


@ps.law
def implicit_ball(x: wp.vec3, scale: float):
    """The outside of the unit sphere, by what is no distance."""
    return scale * (wp.dot(x, x) - 1.0)


@ps.law
def no_number(x: wp.vec3):
    return wp.sqrt(x[1])


def mix(seed, count=200, side=1.0, speed=2.0):
    """Particles of many sizes about the origin."""
    rng = np.random.default_rng(seed)
    return {
        "x": rng.uniform(-side, side, (count, 3)), "radius": rng.uniform(0, 0.1, count),
        "velocity": rng.normal(0, speed, (count, 3)),
    }  # fmt: skip


# Against the ready ones ---------------------------------------------------------------------------


@pytest.mark.parametrize("motion", [{}, {"velocity": (0.5, 0.3, 0), "angular_velocity": (1, 2, 3)}])
@pytest.mark.parametrize(
    "kind", ["bowl", *(pytest.param(k, marks=pytest.mark.slow) for k in ("plane", "hill"))]
)
def test_laws_equal_the_ready_ones(kind, motion, precision, device, simulate, scene_of):
    """To round-off: friction, bounces, starts outside, at rest and in motion."""
    touch = {"friction": 0.4, "restitution": 0.6, **motion}
    n = np.array([1.0, 2.0, -0.5]) / np.linalg.norm([1.0, 2.0, -0.5])
    at = (0.1, -0.2, 0.3)
    ready, law = {
        "plane": (
            ps.PlaneBoundary(at, n, **touch),
            ps.Boundary(half_space, point=at, normal=n, pivot=at, **touch),
        ),
        "bowl": (
            ps.SphereBoundary(at, 1.2, **touch),
            ps.Boundary(ball, center=at, radius=1.2, side=-1.0, pivot=at, **touch),
        ),
        "hill": (
            ps.SphereBoundary(at, 0.6, False, **touch),
            ps.Boundary(ball, center=at, radius=0.6, pivot=at, **touch),
        ),
    }[kind]
    found = []
    for boundary in (ready, law):
        given = mix(1)
        scene = scene_of(given.pop("x"), boundary, gravity=True, **given)
        sim = simulate(scene, device, precision=precision, iterations=2)
        sim.run(20)
        found.append((sim.position, sim.velocity))
    # 20 steps of some roundings of numbers up to 4; a velocity is a way of 10 ms. What one of both
    # just misses bounces in the next step.
    eps = np.finfo(precision).eps
    close = np.abs(found[0][1] - found[1][1]).max(axis=1) < 20 * 20 * 4 * eps / 0.01
    assert close.mean() > (0.98 if precision == "float32" else 0.999)
    assert np.abs(found[0][0] - found[1][0])[close].max() < 20 * 20 * 4 * eps


@pytest.mark.parametrize(
    "boundary",
    [
        ps.PlaneBoundary((0.1, 0.2, -0.1), (1, 2, -0.5)), ps.SphereBoundary((0.1, 0, 0), 0.7),
        ps.SphereBoundary((0.1, 0, 0), 0.7, inside=False),
        ps.BoxBoundary((-0.5, -0.4, -np.inf), (0.3, np.inf, 0.4)),
    ],
)  # fmt: skip
def test_ready_ones_have_a_distance(boundary, device, simulate, scene_of):
    """Where it is less than the radius, and there only, they bring a particle back."""
    given = mix(2)
    d = boundary.distance(given["x"])
    sim = simulate(scene_of(given["x"], boundary, radius=given["radius"]), device)
    sim.project(1)
    back = np.abs(sim.position - given["x"]).max(axis=1)
    assert np.array_equal(back > 0, d < given["radius"])
    assert (boundary.distance(sim.position) >= given["radius"] - 1e-14).all()


def test_rest_far_from_the_origin(device, simulate, scene_of):
    """10 km away in float32."""
    far = 1e4
    floor = ps.Boundary(half_space, point=(far, far, far), normal=(0, 1, 0))
    scene = scene_of([(far, far + 0.25, far)], floor, radius=0.25, gravity=True)
    sim = simulate(scene, device, dt=1 / 60, substeps=20, precision="float32")
    sim.run(60)
    assert np.abs(sim.velocity).max() < 1e-3


# Closed forms -------------------------------------------------------------------------------------


def test_projection_is_along_the_gradient(precision, device, simulate, scene_of):
    """Onto a torus: to R from the nearest point of its surface."""
    given = mix(0, side=1.5)
    x, radius = given["x"], given["radius"]
    sim = simulate(scene_of(x, ps.Boundary(torus, ring=1.0, tube=0.3), radius=radius), device,
                   precision=precision)  # fmt: skip
    sim.project(1)
    out = np.hypot(x[:, 0], x[:, 2])
    core = x * [1, 0, 1] / out[:, None]  # the nearest point of the circle within the tube
    n = x - core
    r = np.linalg.norm(n, axis=1)
    expected = core + n / r[:, None] * np.maximum(r, 0.3 + radius)[:, None]
    assert (r < 0.3 + radius).sum() > 10
    assert np.allclose(sim.position, expected, atol=20 * np.finfo(precision).eps)


@pytest.mark.parametrize("turn", [0.0, 0.6])
def test_a_pipe_is_a_pendulum(turn, precision, device, simulate, scene_of):
    """In a frictionless pipe, lying along any direction, a point goes round as on a rod.

    T = 2 pi sqrt(l / g) (1 + a^2 / 16) of amplitude a, with l = r - R.
    """
    r, radius, a, h = 1.5, 0.1, 0.1, 1e-4
    axis, across = (np.cos(turn), 0, np.sin(turn)), np.array([-np.sin(turn), 0, np.cos(turn)])
    length = r - radius
    start = length * (np.sin(a) * across - np.cos(a) * np.array([0, 1, 0]))
    boundary = ps.Boundary(pipe, axis=axis, radius=r)
    sim = simulate(scene_of([start], boundary, radius=radius, gravity=True), device, dt=h,
                   precision=precision)  # fmt: skip
    sim.run(round(0.5 * np.pi * np.sqrt(length / G) * (1 + a * a / 16) / h))
    speed = np.sqrt(2 * G * length * (1 - np.cos(a)))
    x, v = sim.position[0], sim.velocity[0]
    eps = float(np.finfo(precision).eps)
    assert np.linalg.norm(x) == pytest.approx(length, rel=1e-12 + 10 * eps)
    assert abs(x @ axis) < 1e-12 + 4000 * eps
    # First order: the swing is early or late by some h, and loses a part h / T of its height.
    assert abs(x @ across) < 10 * speed * h
    assert -v @ across == pytest.approx(speed, rel=5e-3)


def test_a_grain_slides_to_the_bottom_of_a_pipe(device, simulate, scene_of):
    """And stays there, within the angle that friction holds: tan = mu."""
    r, radius, mu = 0.5, 0.05, 0.05
    axis = np.array([0.6, 0, 0.8])
    boundary = ps.Boundary(pipe, friction=mu, axis=axis, radius=r)
    start = 0.2 * axis + (r - radius) * np.array([0.8, 0, -0.6])  # at the height of the axis
    sim = simulate(scene_of([start], boundary, radius=radius, gravity=True), device, dt=1 / 60,
                   substeps=20)  # fmt: skip
    sim.run(1200)
    x = sim.position[0]
    assert x @ axis == pytest.approx(0.2, abs=1e-9)
    assert -x[1] >= (r - radius) * np.cos(np.arctan(mu)) - 1e-9
    assert np.abs(sim.velocity).max() < 1e-6


@pytest.mark.parametrize("e", [0.5, 0.8, 1.0])
def test_drop_onto_a_torus_returns_to_e_squared(e, device, simulate, scene_of):
    """From 1 m back to e^2 m, as from the ready boundaries (tests/verification/test_xpbd.py)."""
    radius, h = 0.1, 1 / 4800
    top = 0.3 + radius
    boundary = ps.Boundary(torus, restitution=e, ring=1.0, tube=0.3)
    scene = scene_of([(0.6, top + 1, 0.8)], boundary, radius=radius, gravity=True)
    sim = simulate(scene, device, dt=20 * h, substeps=20)
    sim.run(round(np.sqrt(2 / G) * (1 + e) / sim.settings.dt))  # to the top of the rebound
    height = sim.position[0, 1] - top
    # The speed counts that the substep of the hit began with: up to g h too low; and the start of
    # the fall is g h t / 2 low. Together under 2 g h / v of the height, 0.1 %.
    assert height == pytest.approx(e**2, rel=4 * G * h / np.sqrt(2 * G) * (1 + 1 / e))


def test_friction_stops(precision, device, simulate, scene_of):
    """A grain that slides along the lowest line of a pipe, after v^2 / (2 mu g)."""
    mu, speed, radius, h = 0.4, 2.0, 0.1, 1 / 1200
    axis = np.array([0.6, 0, 0.8])
    boundary = ps.Boundary(pipe, friction=mu, axis=axis, radius=1.0)
    scene = scene_of([(0, -0.9, 0)], boundary, velocity=speed * axis, radius=radius, gravity=True)
    sim = simulate(scene, device, dt=20 * h, substeps=20, precision=precision)
    sim.run(60)
    assert np.abs(sim.velocity).max() < 1e-6
    # Symplectic Euler stops mu g h / v sooner: 0.16 %.
    way = sim.position[0] @ axis
    assert way == pytest.approx(speed**2 / (2 * mu * G), rel=2 * mu * G * h / speed)


def test_a_turning_bowl_carries(device, simulate, scene_of):
    """A rough bowl that spins about the vertical takes a grain near its lowest place along."""
    center, s = (0, 1, 0), 0.2  # sin of the place's angle, so that mu holds it there
    bowl = ps.Boundary(ball, friction=1.0, angular_velocity=(0, 1.0, 0), pivot=center,
                       center=center, radius=1.0, side=-1.0)  # fmt: skip
    sim = simulate(scene_of([(s, 1 - np.sqrt(1 - s * s), 0)], bowl, gravity=True), device, dt=1e-3)
    sim.run(1000)
    x, _, z = sim.position[0]
    # It slips for omega s / (mu g) = 20 ms, and then goes round at omega.
    assert np.arctan2(-z, x) == pytest.approx(1.0, abs=0.02)
    assert np.hypot(x, z) == pytest.approx(s, rel=0.05)


def test_a_bowl_goes_round_its_pivot(precision, device, simulate, scene_of):
    """A tight bowl on an arm takes its grain to where the pose says."""
    touch = {"velocity": (0.1, 0, 0), "angular_velocity": (0, 0, 2.0), "pivot": (1, 1, 0)}
    bowl = ps.Boundary(ball, **touch, center=(2, 1, 0), radius=0.2, side=-1.0)
    sim = simulate(scene_of([(2, 1, 0)], bowl, radius=0.199), device, precision=precision)
    sim.run(100)
    T, R = bowl.pose(sim.time)
    there = R @ [2, 1, 0] + T
    assert there == pytest.approx([1.1 + np.cos(2), 1 + np.sin(2), 0])
    assert np.linalg.norm(sim.position[0] - there) < 1e-3 + 10 * np.finfo(precision).eps


# Gradients that are none, or of another length ----------------------------------------------------


@pytest.mark.parametrize("kind", ["hill", "post", "implicit"])
def test_places_without_a_gradient_have_a_way_out(kind, precision, device, simulate, scene_of):
    """The middle of a sphere, the axis of a post: out along some direction, the same each time."""
    boundary, x, across, out = {
        "hill": (ps.Boundary(ball, center=(1, 0, 0), radius=0.5), (1, 0, 0), (1, 1, 1), 0.6),
        "post": (ps.Boundary(post, radius=0.5), (0, 0.3, 0), (1, 0, 1), 0.6),
        "implicit": (ps.Boundary(implicit_ball, scale=1.0), (0, 0, 0), (1, 1, 1), 1.1),
    }[kind]
    found = []
    for _ in range(2):
        sim = simulate(scene_of([x], boundary, radius=0.1), device, precision=precision)
        sim.project(1)
        found.append(sim.position)
    assert np.array_equal(*found)
    rounding = 100 * float(np.finfo(precision).eps)
    assert np.linalg.norm((found[0] - x) * across) == pytest.approx(out, rel=rounding)
    sim = simulate(scene_of([x], boundary, radius=0.1), device, precision=precision, dt=1 / 60,
                   substeps=4)  # fmt: skip
    fastest = 0.0
    for _ in range(600):
        sim.step()
        fastest = max(fastest, float(np.linalg.norm(sim.velocity)))
    assert 0 < fastest <= 0.1 * 60 * 1.001  # a radius a frame
    assert np.linalg.norm((sim.position - x) * across) >= out * (1 - 1e-6)


def test_a_ball_on_a_ring_stays_in_the_middle(precision, device, simulate, scene_of):
    """On the axis the derivative of the distance is no unit vector; it is held all the same."""
    ring = ps.Boundary(torus, friction=0.5, ring=1.0, tube=0.2)
    height = np.sqrt((0.2 + 1.2) ** 2 - 1)
    sim = simulate(scene_of([(0, height + 0.1, 0)], ring, radius=1.2, gravity=True), device,
                   dt=1 / 60, substeps=20, precision=precision)  # fmt: skip
    sim.run(30)
    # It is pushed aside first to one side and then rests there.
    assert ring.distance(sim.position)[0] == pytest.approx(1.2, abs=1e-3)
    assert sim.position[0, 1] > 0.8 * height


@pytest.mark.parametrize("scale", [0.01, 0.5, 30.0])
def test_a_law_that_is_no_distance(scale, precision, device, simulate, scene_of):
    """Its distance is taken along its gradient, whatever its scale: d / |grad d| to first order."""
    x = np.array([(0, 0.9, 0), (0, 1.05, 0), (0.6, -0.85, 0), (1e-3, 0, 0), (0, 1.11, 0)])
    radius = np.array([0.0, 0.1, 0.1, 0.1, 0.1])
    boundary = ps.Boundary(implicit_ball, scale=scale)
    sim = simulate(scene_of(x, boundary, radius=radius), device, precision=precision)
    sim.project(1)
    rounding = 40 * np.finfo(precision).eps
    right = np.append(1 + radius[:4], 1.11)
    assert np.allclose(np.linalg.norm(sim.position, axis=1), right, rtol=0, atol=rounding)


def test_what_is_no_number_is_found(device, simulate, scene_of):
    """A law without a value is an error of the frame, and names the particle."""
    scene = scene_of([(0, 1, 0), (0, 0.1, 0)], ps.Boundary(no_number), gravity=True, radius=0.01)
    sim = simulate(scene, device)
    with pytest.raises(ps.SimulationError, match="particle 1"):
        sim.run(100)
