"""Boundaries in motion: where they are, drums, worlds, restarts, cost."""

import numpy as np
import pytest

import particlesim as ps
from cases.worlds import equal_alone, goes_on_after_reset_and_save

INF, UP = np.inf, (0, 1, 0)


def floor(**motion):
    """A horizontal plane through the origin."""
    return ps.PlaneBoundary((0, 0, 0), UP, **motion)


def drum(**motion):
    """A box off the origin that tumbles as it goes."""
    return ps.BoxBoundary(
        (-1, -0.5, -1), (1, 0.7, 1), velocity=(0.5, 0.1, -0.2), angular_velocity=(0.3, 0.5, 2.0),
        **motion,
    )  # fmt: skip


@pytest.fixture
def flying(scene_of):
    """A function: grains of many sizes and speeds about the origin."""

    def make(*boundaries, count=100, gravity=True):
        rng = np.random.default_rng(count)
        return scene_of(
            rng.uniform(-0.4, 0.4, (count, 3)), *boundaries, gravity=gravity,
            radius=rng.uniform(0, 0.1, count), velocity=rng.normal(0, 2, (count, 3)),
        )  # fmt: skip

    return make


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


def test_nothing_leaves_a_drum(precision, device, simulate, flying):
    """Turning and going: every grain is within, as seen from the box's own pose."""
    box = drum(friction=0.3, restitution=0.4)
    sim = simulate(flying(box), device, precision=precision)
    sim.run(200)
    T, R = box.pose(sim.time)
    seen, radius = (sim.position - T) @ R, sim.get("radius")[:, None]
    # Places of about 1, moved there and back.
    error = 8 * np.finfo(precision).eps
    assert (seen - radius >= box.lower - error).all()
    assert (seen + radius <= box.upper + error).all()
    assert np.linalg.norm(sim.velocity, axis=1).max() < 8


def test_far_and_long(device, simulate, scene_of):
    """In float32, a kilometre on after 1000 s, a lift is where it is to a part in 10^7."""
    plane = floor(velocity=(0, 1, 0))
    scene = scene_of([(0, 0, 0)], plane, velocity=(0, 1, 0))
    sim = simulate(scene, device, dt=10.0, substeps=100, precision="float32")
    sim.run(100)
    assert sim.position[0, 1] == pytest.approx(1000, rel=2e-7)
    assert plane.pose(1000.0)[0].tolist() == [0, 1000, 0]


def test_static_projection_goes_by_the_clock(device, simulate, scene_of):
    """``project`` brings what is outside onto the floor where that is now."""
    sim = simulate(scene_of([(0, 0, 0)], floor(velocity=(0, 2, 0))), device)
    sim.run(50)
    sim.position = [(0, -1, 0)]
    sim.project(1)
    assert sim.position[0, 1] == pytest.approx(1.0, abs=1e-13)


def test_start_under_a_moving_floor_is_brought_in_slowly(device, simulate, scene_of):
    """Against the floor, at no more than the depenetration speed, give or take its own."""
    u = 3.0
    scene = scene_of([(0, -0.4, 0)], floor(velocity=(0, u, 0)), radius=0.1, velocity=(0, u, 0))
    sim = simulate(scene, device, dt=1 / 60, substeps=10, depenetration_speed=1.0)
    for _ in range(120):
        sim.step()
        assert sim.velocity[0, 1] <= u + 1.0 + 1e-9
    assert sim.position[0, 1] >= 0.1 + u * sim.time - 1e-9


# Worlds, restarts, cost ---------------------------------------------------------------------------


@pytest.fixture
def shaken(flying):
    """A function: grains in a drum on a belt, of world k; the boundaries of world 0 are at rest."""

    def make(k):
        spin, speed = 0.7 * k, 0.5 * k
        return flying(
            ps.BoxBoundary((-1, -1, -1), (1, 1, 1), friction=0.2, restitution=0.3,
                           angular_velocity=(0, 0, spin)),
            ps.PlaneBoundary((0, -0.8, 0), UP, friction=0.4, velocity=(speed, 0.1 * k, 0)),
            ps.SphereBoundary((0, -0.5, 0), 0.2, inside=False, velocity=(0, 0, -0.2 * k)),
            count=30 + k,
        )  # fmt: skip

    return make


def test_a_world_in_a_batch_equals_it_alone(precision, device, simulate, shaken):
    """Bit for bit, also the one in which nothing moves."""
    knobs = {"dt": 1 / 60, "substeps": 4, "precision": precision}
    equal_alone(simulate, [shaken(k) for k in range(3)], device, 40, **knobs)


def test_reset_and_checkpoint(tmp_path, device, simulate, shaken):
    """A world that is reset goes as at first; a run that was saved goes on, bit for bit."""
    scenes = [shaken(k) for k in range(1, 3)]
    goes_on_after_reset_and_save(simulate, scenes, device, tmp_path / "half.npz")


def test_graph_equals_threads(simulate, flying):
    """Bit for bit, however the launches are cut."""
    found = []
    for knobs in ({"execution": "graph"}, {"execution": "threads", "threads": 3}):
        sim = simulate(flying(drum(friction=0.5), count=3000), **knobs)
        sim.run(5)
        found.append((sim.position, sim.velocity))
        sim.close()
    assert np.array_equal(found[0], found[1])


def test_only_what_moves_has_a_clock(device, simulate, flying):
    """Boundaries at rest allocate no time and launch nothing for it."""
    for motion in ({}, {"velocity": (0, 1, 0)}):
        sim = simulate(flying(floor(**motion)), device)
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


def test_turning_into_a_periodic_axis(device, refused, simulate):
    """A plane may turn about an axis that its normal keeps off the periodic ones, and no other."""
    scene = ps.Scene(periodic=((0, None, None), (1, None, None)))
    scene.add_particles([(0.5, 0.5, 0.5)])
    scene.add_constraint(floor(angular_velocity=(2.0, 0, 0)))
    simulate(scene, device).run(2)
    scene.add_constraint(floor(angular_velocity=(0, 0, 2.0)))
    with refused("PlaneBoundary: normal must be along the open axes"):
        simulate(scene, device)
