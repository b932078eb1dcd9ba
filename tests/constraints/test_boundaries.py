"""Boundaries at rest: the projection, friction, bounces, starts outside."""

import numpy as np
import pytest

import particlesim as ps

G = 9.81
INF = np.inf


# Projection -----------------------------------------------------------------------------------


def test_plane_holds_off_by_the_radius(precision, device, simulate, scene_of):
    """Whatever is below comes to (x - point) . n = R; what is above stays."""
    rng = np.random.default_rng(0)
    x, radius = rng.uniform(-1, 1, (50, 3)), rng.uniform(0, 0.2, 50)
    point, normal = np.array([0.1, 0.2, -0.1]), np.array([1.0, 2.0, -0.5])
    plane = ps.PlaneBoundary(point, normal, friction=0.5)
    sim = simulate(scene_of(x, plane, radius=radius), device, precision=precision)
    sim.project(1)
    n = normal / np.linalg.norm(normal)
    lift = np.maximum(radius - (x - point) @ n, 0)
    assert np.allclose(sim.position, x + lift[:, None] * n, atol=10 * np.finfo(precision).eps)


def test_box_keeps_inside_by_the_radius(precision, device, simulate, scene_of):
    """On every side that is closed."""
    rng = np.random.default_rng(0)
    x, radius = rng.uniform(-3, 3, (50, 3)), rng.uniform(0, 0.2, 50)
    lower, upper = np.array([-1, -2, -INF]), np.array([1.5, INF, 1])
    box = ps.BoxBoundary(lower, upper, friction=0.5)
    sim = simulate(scene_of(x, box, radius=radius), device, precision=precision)
    sim.project(1)
    inside = np.clip(x, lower + radius[:, None], upper - radius[:, None])
    assert np.allclose(sim.position, inside, atol=10 * np.finfo(precision).eps)


def test_box_too_narrow_holds_in_the_middle(device, simulate, scene_of):
    """A particle wider than the box is centred, and does not bounce between the sides."""
    box = ps.BoxBoundary((0, -INF, -INF), (0.5, INF, INF), restitution=1.0)
    sim = simulate(scene_of([(0.1, 0, 0)], box, radius=0.5), device, dt=1 / 60, substeps=10)
    sim.run(240)
    assert sim.position[0, 0] == pytest.approx(0.25, abs=1e-3)
    assert abs(sim.velocity[0, 0]) < 0.31  # brought in by 0.15 over half a second, and sent back


def test_only_the_group_is_held(device, simulate):
    """Others pass."""
    scene = ps.Scene()
    held = scene.add_particles([(0, 1, 0)])
    scene.add_particles([(1, 1, 0)])
    scene.add_interaction(ps.UniformGravity((0, -G, 0)))
    scene.add_constraint(ps.PlaneBoundary((0, 0, 0), (0, 1, 0), group=held))
    sim = simulate(scene, device)
    sim.run(100)
    assert sim.position[0, 1] == pytest.approx(0, abs=1e-12)
    assert sim.position[1, 1] < -3


def test_rest_is_rest(precision, device, simulate, scene_of):
    """On a floor and in a corner: nothing moves, whatever friction and restitution."""
    for mu, e in ((0.0, 0.0), (0.5, 0.9), (3.0, 1.0)):
        box = ps.BoxBoundary((0, 0, 0), (2, 2, 2), friction=mu, restitution=e)
        scene = scene_of([(0.1, 0.1, 0.1), (1, 0.1, 1)], box, radius=0.1, gravity=True)
        sim = simulate(scene, device, dt=1 / 60, substeps=20, precision=precision)
        start = sim.position
        sim.run(60)
        assert np.allclose(sim.position, start, atol=1e-6)
        assert np.abs(sim.velocity).max() < 1e-3


def test_fast_impact_is_stopped(precision, device, simulate, scene_of):
    """However far beyond the floor a substep would have gone."""
    plane = ps.PlaneBoundary((0, 0, 0), (0, 1, 0))
    scene = scene_of([(0, 1, 0)], plane, velocity=(0, -1e4, 0), radius=0.1)
    sim = simulate(scene, device, dt=0.1, precision=precision)
    sim.run(2)
    assert sim.position[0, 1] == pytest.approx(0.1, abs=1e-4)
    assert abs(sim.velocity[0, 1]) < 0.01


@pytest.mark.parametrize("kind", ["plane", "box", "bowl", "hill"])
def test_far_from_the_origin(kind, device, simulate, scene_of):
    """At rest 10 km away in float32."""
    far = 1e4
    boundary = {
        "plane": ps.PlaneBoundary((far, far, far), (0, 1, 0)),
        "box": ps.BoxBoundary((far - 1, far, far - 1), (far + 1, INF, far + 1)),
        "bowl": ps.SphereBoundary((far, far + 2, far), 2.0),
        "hill": ps.SphereBoundary((far, far - 2, far), 2.0, inside=False),
    }[kind]
    scene = scene_of([(far, far + 0.25, far)], boundary, radius=0.25, gravity=True)
    sim = simulate(scene, device, dt=1 / 60, substeps=20, precision="float32")
    sim.run(60)
    assert np.abs(sim.velocity).max() < 1e-3


# Friction and restitution -----------------------------------------------------------------------


def test_friction_acts_on_every_side(device, simulate, scene_of):
    """Sliding down a wall that a force presses against: the wall carries mu times the force."""
    box = ps.BoxBoundary((0, -INF, -INF), (INF, INF, INF), friction=0.5)
    scene = scene_of([(0, 0, 0)], box, gravity=True)
    scene.add_interaction(ps.ConstantForce((-10.0, 0, 0)))
    sim = simulate(scene, device, dt=0.1, substeps=100)
    sim.run(10)
    assert sim.velocity[0, 1] == pytest.approx(-(G - 5.0), rel=1e-9)


def test_a_way_into_one_side_is_no_slip_along_another(device, simulate, scene_of):
    """Thrown into an edge of rough sides, a particle stays in it."""
    box = ps.BoxBoundary((0, 0, -INF), (INF, INF, INF), friction=5.0)
    sim = simulate(scene_of([(0.01, 0.01, 0)], box, velocity=(-5, -7, 0)), device)
    sim.run(3)
    assert np.allclose(sim.position, 0, atol=1e-15)
    assert np.allclose(sim.velocity, 0, atol=1e-12)


def test_what_pressed_and_then_slips_takes_no_more_than_it_may(
    precision, device, simulate, scene_of
):
    """Grip that rounding leaves below 0 holds nothing: a NaN would be an error of the step."""
    rng = np.random.default_rng(3)
    x, v = rng.uniform(-1, 3, (400, 3)), rng.normal(0, 4, (400, 3))
    box = ps.BoxBoundary((0, 0, 0), (2, 2, 2), friction=0.3, restitution=0.6)
    scene = scene_of(x, box, velocity=v, radius=rng.uniform(0, 0.3, 400))
    sim = simulate(scene, device, dt=1 / 60, substeps=4, iterations=3, precision=precision)
    sim.run(20)
    # What started outside is brought in at a radius a frame; nothing else gives speed.
    fastest = np.linalg.norm(v, axis=1).max() + 0.3 * 60 * np.sqrt(3)
    assert np.linalg.norm(sim.velocity, axis=1).max() <= fastest


def test_elastic_box_keeps_the_energy(precision, device, simulate, scene_of):
    """A gas without collisions between walls of e = 1: every speed stays what it was."""
    rng = np.random.default_rng(0)
    v = rng.normal(0, 1, (100, 3))
    box = ps.BoxBoundary((0, 0, 0), (1, 1, 1), restitution=1.0)
    sim = simulate(scene_of(rng.uniform(0.1, 0.9, (100, 3)), box, velocity=v), device,
                   precision=precision)  # fmt: skip
    sim.run(300)
    # Each hit rounds v + correction / h, whose parts are up to twice v.
    assert np.allclose(np.abs(sim.velocity), np.abs(v), atol=30 * 20 * np.finfo(precision).eps)
    assert sim.position.min() >= 0
    assert sim.position.max() <= 1


def test_bounces_die_out(device, simulate, scene_of):
    """A ball of e = 0.7 comes to rest, and its energy never grows."""
    plane = ps.PlaneBoundary((0, 0, 0), (0, 1, 0), restitution=0.7)
    sim = simulate(scene_of([(0, 1, 0)], plane, gravity=True), device, dt=1 / 60, substeps=20)
    last = sim.diagnostics().energy[0]
    for _ in range(240):
        sim.step()
        energy = sim.diagnostics().energy[0]
        # Symplectic Euler's energy swings by m g v h / 2.
        assert energy <= last + G * np.sqrt(2 * G) / 1200
        last = energy
    assert abs(sim.velocity[0, 1]) < 1e-9


# Starts outside ---------------------------------------------------------------------------------


@pytest.mark.parametrize("depth", [0.01, 0.5, 20.0])
def test_start_outside_is_brought_in_slowly(depth, device, simulate, scene_of):
    """At the depenetration speed at most."""
    for boundary in (
        ps.PlaneBoundary((0, 0, 0), (0, 1, 0)),
        ps.BoxBoundary((-5, 0, -5), (5, INF, 5)),
        ps.SphereBoundary((0, 30, 0), 30.0),
        ps.SphereBoundary((0, -40, 0), 40.0, inside=False),
    ):
        scene = scene_of([(0, 0.1 - depth, 0)], boundary, radius=0.1)
        sim = simulate(scene, device, dt=1 / 60, substeps=10, depenetration_speed=4.0)
        fastest = 0.0
        for _ in range(600):
            sim.step()
            fastest = max(fastest, float(np.abs(sim.velocity).max()))
        assert 0 < fastest <= 4.0 * (1 + 1e-9)
        assert sim.position[0, 1] >= 0.1 - 1e-9


def test_points_outside_are_brought_in(device, precision, simulate, scene_of):
    """Without a radius there is no speed of one radius a frame: they come in by e-folds."""
    plane = ps.PlaneBoundary((0, 0, 0), (0, 1, 0))
    sim = simulate(scene_of([(0, -1, 0)], plane), device, dt=1 / 60, precision=precision)
    sim.run(600)
    assert sim.position[0, 1] > -1e-4
    # 1 over 30 frames of 1/60; float32 rounds positions of 1 over h.
    assert np.abs(sim.velocity).max() <= 2.0 + 60 * 2e-7


def test_positions_written_outside(device, simulate, scene_of):
    """What a user puts outside is treated like a start; other worlds never notice."""
    plane = ps.PlaneBoundary((0, 0, 0), (0, 1, 0))
    scenes = [scene_of([(0, 1, 0)], plane, gravity=True, radius=0.1) for _ in range(2)]
    sim, untouched = (simulate(scenes, device, dt=1 / 60, substeps=4) for _ in range(2))
    sim.run(5)
    sim.world(0).position = [(0, -1, 0)]
    sim.run(60)
    untouched.run(65)
    assert np.abs(sim.velocity).max() < 5
    assert np.array_equal(sim.world(1).position, untouched.world(1).position)
    sim.reset()
    sim.run(65)
    assert np.array_equal(sim.position, untouched.position)
