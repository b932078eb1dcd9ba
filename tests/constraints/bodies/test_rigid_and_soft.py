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


def test_a_soft_body_weighs_its_tetrahedra_and_is_drawn_as_its_surface():
    mesh = ps.sample.box_tetrahedra((0, 0, 0), (0.4, 0.2, 0.2), spacing=0.1)
    scene = ps.Scene()
    scene.add_particles([(9, 9, 9)])
    body = scene.add_soft_body(
        *mesh, density=1000.0, youngs_modulus=2e4, poissons_ratio=0.4, radius=0.05, pinned=[0],
        group="jelly",
    )  # fmt: skip
    assert scene.mass[1:].sum() == pytest.approx(1000.0 * 0.016)
    assert np.average(scene.position[1:], axis=0, weights=scene.mass[1:]) == pytest.approx(
        (0.2, 0.1, 0.1)
    )
    assert (body.group.triangles == ps.sample.surface(mesh[1])).all()
    assert (scene.radius[1:] == 0.05).all() and np.flatnonzero(scene.pinned).tolist() == [1]
    (elastic,) = scene.constraints
    assert body.constraints == {"elastic": elastic}
    assert (elastic.tetrahedra == mesh[1] + 1).all()


@pytest.mark.parametrize(
    ("options", "match"),
    [
        ({"tetrahedra": [(0, 1, 2)]}, r"tetrahedra must be whole numbers of shape \(t, 4\)"),
        ({"tetrahedra": [(0, 1, 2, 99)]}, "tetrahedra must hold indices from 0 to"),
        ({"tetrahedra": [(0, 1, 2, 3)]}, r"tetrahedra\[0\] must have a volume above 0"),
        ({"density": 0.0}, "density must be above 0"),
        ({"youngs_modulus": -1.0}, "youngs_modulus"),
        ({"poissons_ratio": 0.6}, "poissons_ratio"),
        ({"pinned": [99]}, "pinned must hold numbers from 0"),
    ],
)
def test_soft_bodies_that_are_none_are_refused(refused, options, match):
    vertices, tetrahedra = ps.sample.box_tetrahedra((0, 0, 0), (0.2, 0.1, 0.1), spacing=0.1)
    given = {"vertices": vertices, "tetrahedra": tetrahedra, "density": 1.0, "youngs_modulus": 1.0}
    scene = ps.Scene()
    with refused(match):
        scene.add_soft_body(**given | options)
    assert scene.particle_count == 0 and not scene.constraints
