"""Boundaries at rest: the projection, friction, bounces, starts outside, worlds, extremes."""

import numpy as np
import pytest

import particlesim as ps

G = 9.81
INF = np.inf


def simulate(scene, device="cpu", **knobs):
    """One substep a frame in float64, unless told otherwise."""
    settings = {"dt": 0.01, "substeps": 1, "precision": "float64", **knobs}
    return ps.Simulation(scene, ps.Settings(**settings), device=device)


def scene_of(x, *boundaries, gravity=False, **particles):
    """Particles within boundaries."""
    scene = ps.Scene()
    scene.add_particles(x, **particles)
    if gravity:
        scene.add_interaction(ps.UniformGravity((0, -G, 0)))
    for each in boundaries:
        scene.add_constraint(each)
    return scene


# Projection -----------------------------------------------------------------------------------


def test_plane_holds_off_by_the_radius(precision, device):
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


def test_box_keeps_inside_by_the_radius(precision, device):
    """On every side that is closed."""
    rng = np.random.default_rng(0)
    x, radius = rng.uniform(-3, 3, (50, 3)), rng.uniform(0, 0.2, 50)
    lower, upper = np.array([-1, -2, -INF]), np.array([1.5, INF, 1])
    box = ps.BoxBoundary(lower, upper, friction=0.5)
    sim = simulate(scene_of(x, box, radius=radius), device, precision=precision)
    sim.project(1)
    inside = np.clip(x, lower + radius[:, None], upper - radius[:, None])
    assert np.allclose(sim.position, inside, atol=10 * np.finfo(precision).eps)


def test_box_too_narrow_holds_in_the_middle(device):
    """A particle wider than the box is centred, and does not bounce between the sides."""
    box = ps.BoxBoundary((0, -INF, -INF), (0.5, INF, INF), restitution=1.0)
    sim = simulate(scene_of([(0.1, 0, 0)], box, radius=0.5), device, dt=1 / 60, substeps=10)
    sim.run(240)
    assert sim.position[0, 0] == pytest.approx(0.25, abs=1e-3)
    assert abs(sim.velocity[0, 0]) < 0.31  # brought in by 0.15 over half a second, and sent back


def test_only_the_group_is_held(device):
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


def test_rest_is_rest(precision, device):
    """On a floor and in a corner: nothing moves, whatever friction and restitution."""
    for mu, e in ((0.0, 0.0), (0.5, 0.9), (3.0, 1.0)):
        box = ps.BoxBoundary((0, 0, 0), (2, 2, 2), friction=mu, restitution=e)
        scene = scene_of([(0.1, 0.1, 0.1), (1, 0.1, 1)], box, radius=0.1, gravity=True)
        sim = simulate(scene, device, dt=1 / 60, substeps=20, precision=precision)
        start = sim.position
        sim.run(60)
        assert np.allclose(sim.position, start, atol=1e-6)
        assert np.abs(sim.velocity).max() < 1e-3


def test_fast_impact_is_stopped(precision, device):
    """However far beyond the floor a substep would have gone."""
    plane = ps.PlaneBoundary((0, 0, 0), (0, 1, 0))
    scene = scene_of([(0, 1, 0)], plane, velocity=(0, -1e4, 0), radius=0.1)
    sim = simulate(scene, device, dt=0.1, precision=precision)
    sim.run(2)
    assert sim.position[0, 1] == pytest.approx(0.1, abs=1e-4)
    assert abs(sim.velocity[0, 1]) < 0.01


@pytest.mark.parametrize("kind", ["plane", "box", "bowl", "hill"])
def test_far_from_the_origin(kind, device):
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


def test_friction_acts_on_every_side(device):
    """Sliding down a wall that a force presses against: the wall carries mu times the force."""
    box = ps.BoxBoundary((0, -INF, -INF), (INF, INF, INF), friction=0.5)
    scene = scene_of([(0, 0, 0)], box, gravity=True)
    scene.add_interaction(ps.ConstantForce((-10.0, 0, 0)))
    sim = simulate(scene, device, dt=0.1, substeps=100)
    sim.run(10)
    assert sim.velocity[0, 1] == pytest.approx(-(G - 5.0), rel=1e-9)


def test_a_way_into_one_side_is_no_slip_along_another(device):
    """Thrown into an edge of rough sides, a particle stays in it."""
    box = ps.BoxBoundary((0, 0, -INF), (INF, INF, INF), friction=5.0)
    sim = simulate(scene_of([(0.01, 0.01, 0)], box, velocity=(-5, -7, 0)), device)
    sim.run(3)
    assert np.allclose(sim.position, 0, atol=1e-15)
    assert np.allclose(sim.velocity, 0, atol=1e-12)


def test_what_pressed_and_then_slips_takes_no_more_than_it_may(precision, device):
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


def test_elastic_box_keeps_the_energy(precision, device):
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


def test_bounces_die_out(device):
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
def test_start_outside_is_brought_in_slowly(depth, device):
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


def test_points_outside_are_brought_in(device, precision):
    """Without a radius there is no speed of one radius a frame: they come in by e-folds."""
    plane = ps.PlaneBoundary((0, 0, 0), (0, 1, 0))
    sim = simulate(scene_of([(0, -1, 0)], plane), device, dt=1 / 60, precision=precision)
    sim.run(600)
    assert sim.position[0, 1] > -1e-4
    # 1 over 30 frames of 1/60; float32 rounds positions of 1 over h.
    assert np.abs(sim.velocity).max() <= 2.0 + 60 * 2e-7


def test_positions_written_outside(device):
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


# Worlds, execution, arguments -------------------------------------------------------------------


def hail(k):
    """Particles over a slope in a box, with parameters of their own."""
    rng = np.random.default_rng(k)
    normal = (0.1 * k, 1, 0)
    return scene_of(
        rng.uniform(0.2, 2, (30 + k, 3)),
        ps.PlaneBoundary((0, 0.1 * k, 0), normal, friction=0.2 * k, restitution=0.3 * k),
        ps.BoxBoundary((0, -INF, 0), (2 + k, 3, 2), friction=0.1 * k, restitution=0.2 * k),
        ps.SphereBoundary((1, 1, 1), 0.3 + k, k > 0, friction=0.1 * k, restitution=0.3 * k),
        radius=rng.uniform(0, 0.1, 30 + k), velocity=rng.normal(0, 3, (30 + k, 3)), gravity=True,
    )  # fmt: skip


def test_a_world_in_a_batch_equals_it_alone(precision, device):
    """Bit for bit, with parameters of its own."""
    knobs = {"dt": 1 / 60, "substeps": 5, "precision": precision}
    together = simulate([hail(k) for k in range(3)], device, **knobs)
    together.run(60)
    for k in range(3):
        alone = simulate(hail(k), device, **knobs)
        alone.run(60)
        assert np.array_equal(together.world(k).position, alone.position)
        assert np.array_equal(together.world(k).velocity, alone.velocity)


def test_graph_equals_threads():
    """Bit for bit, however the launches are cut."""
    rng = np.random.default_rng(0)
    x, v = rng.uniform(0.2, 1.8, (5000, 3)), rng.normal(0, 3, (5000, 3))
    found = []
    for knobs in ({"execution": "graph"}, {"execution": "threads", "threads": 3}):
        box = ps.BoxBoundary((0, 0, 0), (2, 2, 2), friction=0.3, restitution=0.5)
        scene = scene_of(x, box, velocity=v, radius=0.01, gravity=True)
        sim = simulate(scene, dt=1 / 60, substeps=4, **knobs)
        sim.run(5)
        found.append((sim.position, sim.velocity))
        sim.close()
    assert np.array_equal(found[0], found[1])


def test_shapes():
    """What exports draw."""
    (plane,) = ps.PlaneBoundary((1, 2, 3), (0, 0, 5)).shapes()
    assert plane["kind"] == "plane"
    assert plane["normal"].tolist() == [0, 0, 1]
    assert plane["point"].tolist() == [1, 2, 3]
    (box,) = ps.BoxBoundary((0, 0, 0), (1, INF, 1)).shapes()
    assert box["kind"] == "box"
    assert box["upper"].tolist() == [1, INF, 1]
    (ball,) = ps.SphereBoundary((1, 0, 0), 2.0, inside=False).shapes()
    assert ball["kind"] == "sphere"
    assert not ball["container"]


def test_no_bounce_pass_without_restitution(device):
    """A plane of e = 0 has no pass after the velocities."""
    for e in (0.0, 0.5):
        scene = scene_of([(0, 1, 0)], ps.PlaneBoundary((0, 0, 0), (0, 1, 0), restitution=e))
        keys = [key for _, key, _ in simulate(scene, device).explain().launches]
        assert any("bounce" in key for key in keys) == (e > 0)


def test_nothing_to_hold(device):
    """No particles, all pinned, no time."""
    plane = ps.PlaneBoundary((0, 0, 0), (0, 1, 0), restitution=0.5)
    simulate(scene_of(np.zeros((0, 3)), plane), device).run(2)
    sim = simulate(scene_of([(0, -1, 0)], plane, pinned=True), device)
    sim.run(2)
    sim.substep(0.0)
    assert np.array_equal(sim.position, [(0, -1, 0)])


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: ps.PlaneBoundary((0, 0), (0, 1, 0)), r"PlaneBoundary: point must have shape \(3,"),
        (lambda: ps.PlaneBoundary((0, 0, 0), (0, 0, 0)), "PlaneBoundary: normal must have a direc"),
        (lambda: ps.PlaneBoundary((0, np.nan, 0), (0, 1, 0)), "PlaneBoundary: point.1. must be fi"),
        (
            lambda: ps.PlaneBoundary((0, 0, 0), (0, 1, 0), friction=-1),
            "PlaneBoundary: friction must be at least 0, got -1",
        ),
        (
            lambda: ps.PlaneBoundary((0, 0, 0), (0, 1, 0), restitution=2),
            "PlaneBoundary: restitution must be at most 1, got 2",
        ),
        (lambda: ps.BoxBoundary((0, 0, 0), (1, 0, 1)), "BoxBoundary: upper must be above lower"),
        (lambda: ps.BoxBoundary((0, 0, INF), (1, 1, INF)), "BoxBoundary: lower.2. must be finite"),
        (lambda: ps.BoxBoundary((0, 0, np.nan), (1, 1, 1)), "BoxBoundary: lower.2. must be finite"),
        (lambda: ps.BoxBoundary((0, 0), (1, 1)), "BoxBoundary: lower must have shape"),
        (lambda: ps.BoxBoundary("abc", (1, 1, 1)), "BoxBoundary: lower must be numbers"),
        (lambda: ps.SphereBoundary((0, 0, 0), 0.0), "SphereBoundary: radius must be above 0"),
        (lambda: ps.SphereBoundary((0, 0), 1.0), "SphereBoundary: center must have shape"),
    ],
)
def test_bad_arguments(make, message):
    """Each in the house form."""
    with pytest.raises(ValueError, match=message):
        make()


@pytest.mark.parametrize(
    ("boundary", "message"),
    [
        (ps.PlaneBoundary((0, 0, 0), (1, 1, 0)), "PlaneBoundary: normal must be along the open"),
        (ps.BoxBoundary((0, 0, 0), (1, 1, 1)), "BoxBoundary: sides along x must be open where"),
        (ps.SphereBoundary((0, 0, 0), 1.0), "SphereBoundary: scene must be open along all axes"),
    ],
)
def test_periodic_axes_have_no_sides(boundary, message, device):
    """A wall across a periodic axis would have two sides to be on."""
    scene = ps.Scene(periodic=((0, None, 0), (1, None, 1)))
    scene.add_particles([(0.5, 0.5, 0.5)])
    scene.add_constraint(boundary)
    with pytest.raises(ValueError, match=message):
        simulate(scene, device)
