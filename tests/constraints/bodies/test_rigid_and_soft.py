"""Rigid and soft bodies from a call: what they weigh, what holds them, and what is refused."""

import numpy as np
import pytest

import particlesim as ps

BRICK = ps.sample.box((0, 0, 0), (0.4, 0.2, 0.2), spacing=0.1)


def test_a_rigid_body_weighs_its_lattice_and_turns_about_its_middle():
    scene = ps.Scene()
    scene.add_particles([(9, 9, 9)])
    body = scene.add_rigid_body(
        BRICK, spacing=0.1, density=500.0, velocity=(1, 2, 3), angular_velocity=(0, 0, 2),
        pinned=[3], break_force=40.0, group="brick",
    )  # fmt: skip
    assert body.group is scene["brick"] and len(body.group) == 16
    np.testing.assert_allclose(scene.mass[1:], 500.0 * 0.1**3)
    np.testing.assert_allclose(scene.radius[1:], 0.05)
    assert np.flatnonzero(scene.pinned).tolist() == [4]
    lever = BRICK - (0.2, 0.1, 0.1)
    spin = np.stack([-2 * lever[:, 1], 2 * lever[:, 0], 0 * lever[:, 0]], axis=1)
    np.testing.assert_allclose(scene.velocity[1:], spin + np.array([1, 2, 3]))
    (shape,) = scene.constraints
    assert body.constraints == {"shape": shape}
    (members,) = shape.clusters
    assert np.array_equal(members, body.indices) and shape.break_force.tolist() == [40.0]


@pytest.mark.parametrize(
    ("options", "match"),
    [
        ({"points": BRICK[:1]}, "at least 2"),
        ({"points": BRICK[:, :2]}, r"points must have shape \(n, 3\)"),
        ({"spacing": 0.0}, "spacing must be above 0"),
        ({"density": -1.0}, "density must be above 0"),
        ({"pinned": [16]}, "pinned must hold numbers from 0 to 15"),
        ({"angular_velocity": 3.0}, r"angular_velocity must have shape \(3,\)"),
        ({"break_force": -1.0}, "break_force"),
    ],
)
def test_rigid_bodies_that_are_none_are_refused(refused, options, match):
    scene = ps.Scene()
    with refused(match):
        scene.add_rigid_body(**{"points": BRICK, "spacing": 0.1, "density": 1.0} | options)
    assert scene.particle_count == 0 and not scene.constraints
