"""Ropes and cloth from a call: what they weigh, what holds them, and what is refused."""

import numpy as np
import pytest

import particlesim as ps

LINE = ps.sample.curve([(0, 0, 0), (2, 0, 0)], spacing=0.5)
SHEET = ps.sample.rectangle((0, 0, 0), [(0, 0, 1), (1, 0, 0)], cells=2)


def test_a_rope_weighs_its_links_and_stretches_by_its_stiffness():
    scene = ps.Scene()
    scene.add_particles([(9, 9, 9)])
    points = np.array([(0, 0, 0), (1, 0, 0), (1, 2, 0)])
    rope = scene.add_rope(
        points, linear_density=3.0, stiffness=50.0, bending_stiffness=0.5, radius=0.1, pinned=[-1],
        velocity=(0, 1, 0), group="rope", break_force=7.0, tension_only=True, color=(1, 0, 0),
    )  # fmt: skip
    assert rope.group is scene["rope"] and rope.indices.tolist() == [1, 2, 3]
    assert scene.mass[1:].tolist() == [1.5, 4.5, 3.0]
    assert scene.pinned.tolist() == [False, False, False, True]
    assert (scene.velocity[1:] == (0, 1, 0)).all() and rope.group.color == (1, 0, 0)
    stretch, bend = scene.constraints
    assert rope.constraints == {"stretch": stretch, "bend": bend}
    assert stretch.particles.tolist() == [[1, 2], [2, 3]] and stretch.tension_only
    np.testing.assert_allclose(stretch.compliance, [1 / 50, 2 / 50])  # l / EA
    assert stretch.break_force.tolist() == [7, 7]
    assert bend.particles.tolist() == [[1, 2, 3]]
    np.testing.assert_allclose(bend.compliance, [(1 + 2) / 2 / 0.5])


def test_a_rope_of_two_points_has_nothing_to_bend():
    scene = ps.Scene()
    rope = scene.add_rope([(0, 0, 0), (1, 0, 0)], linear_density=1.0, bending_stiffness=1.0)
    assert (
        list(rope.constraints) == ["stretch"] and not rope.constraints["stretch"].compliance.any()
    )


def test_a_cloth_weighs_its_triangles_and_stretches_by_its_stiffness():
    scene = ps.Scene()
    scene.add_particles([(9, 9, 9)])
    cloth = scene.add_cloth(*SHEET, areal_density=0.6, stiffness=50.0, pinned=[0, 2], group="sheet")
    assert scene.mass[1:].sum() == pytest.approx(0.6)
    # Cells of 1/4: a corner has one or two of the halves, the middle of a side always three, the
    # middle of the square four or eight; each weighs a third of 1/8 of 0.6.
    thirds = np.round(scene.mass[1:] / (0.6 / 8 / 3)).astype(int).reshape(3, 3)
    assert thirds[1, 1] in (4, 8) and thirds.sum() == 24
    assert (cloth.group.triangles == SHEET[1]).all()
    assert np.flatnonzero(scene.pinned).tolist() == [1, 3]
    (stretch,) = scene.constraints
    assert (stretch.particles == ps.sample.edges(SHEET[1]) + 1).all()
    # Y (A_1 + A_2) / l^2: along sides 1 inside and 1/2 at the rim, along diagonals 1/2.
    x = scene.position
    way = np.abs(x[stretch.particles[:, 1]] - x[stretch.particles[:, 0]])
    diagonal = (way > 0).sum(axis=1) == 2
    rim = ((x[stretch.particles] == 0) | (x[stretch.particles] == 1)).all(axis=1)[:, [0, 2]]
    share = np.where(diagonal | rim.any(axis=1), 0.5, 1.0)
    np.testing.assert_allclose(stretch.compliance, 1 / (50.0 * share))


def test_a_cloth_bends_by_its_stiffness():
    # Two right-angled halves of a square of 1/4, and two triangles that are larger.
    vertices = np.array([(0, 0, 0), (0.5, 0, 0), (0, 0.5, 0), (0.5, 0.5, 0), (1.5, 0.5, 0)])
    triangles = [(0, 1, 2), (2, 1, 3), (3, 1, 4)]
    scene = ps.Scene()
    scene.add_particles([(9, 9, 9)])
    cloth = scene.add_cloth(vertices, triangles, areal_density=1.0, bending_stiffness=0.04)
    assert list(cloth.constraints) == ["stretch", "bend"]
    bend = cloth.constraints["bend"]
    assert np.sort(bend.particles[:, :2], axis=1).tolist() == [[2, 3], [2, 4]]
    # k = D l^2 / (A_1 + A_2), of areas 1/8, 1/8, 1/4.
    np.testing.assert_allclose(bend.compliance, [0.25 / 0.5 / 0.04, 0.375 / 0.25 / 0.04])
    lone = ps.Scene().add_cloth(
        vertices[:3], triangles[:1], areal_density=1.0, bending_stiffness=0.04
    )
    assert list(lone.constraints) == ["stretch"]


@pytest.mark.parametrize(
    ("options", "match"),
    [
        ({"points": LINE[:1]}, "points must be at least two, got 1"),
        ({"points": LINE[[0, 1, 1]]}, r"points\[2\] must differ from the one before"),
        ({"linear_density": 0.0}, "linear_density must be above 0"),
        ({"stiffness": 0.0}, r"stiffness must be above 0 \[force\]"),
        ({"bending_stiffness": -1.0}, "bending_stiffness must be at least 0"),
        ({"pinned": [5]}, "pinned must hold numbers from 0 to 4, got 5"),
        ({"pinned": [0.5]}, r"pinned must be numbers of points, or \(5,\) bool"),
        ({"break_force": 0.0}, "break_force"),
        ({"group": "other"}, "group must be a new name"),
    ],
)
def test_ropes_that_are_none_are_refused(refused, options, match):
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0)], group="other")
    with refused(match):
        scene.add_rope(**{"points": LINE, "linear_density": 1.0} | options)
    assert scene.particle_count == 1 and not scene.constraints


@pytest.mark.parametrize(
    ("options", "match"),
    [
        ({"triangles": [(0, 1, 2)]}, r"triangles\[0\] must have an area"),
        ({"triangles": [(0, 1, 3)]}, "vertices must have every point in a piece"),
        ({"triangles": [(0, 1, 9)]}, "triangles must hold indices from 0 to 8"),
        ({"areal_density": -1.0}, "areal_density must be above 0"),
        ({"stiffness": np.inf}, "stiffness must be finite"),
        ({"bending_stiffness": -1.0}, "bending_stiffness must be at least 0"),
        ({"pinned": [True]}, "pinned must be numbers of points"),
        ({"radius": -1.0}, "radius"),
        ({"self_friction": -1.0}, "self_friction must be at least 0"),
        ({"self_collision": True}, "radius must be at least 0.3536"),
        ({"self_collision": True, "radius": 0.17}, "radius must be at least 0.183"),
        ({"self_collision": True, "radius": 0.26}, "radius must be at most 0.25"),
    ],
)
def test_cloths_that_are_none_are_refused(refused, options, match):
    given = {"vertices": SHEET[0], "triangles": SHEET[1], "areal_density": 0.1}
    scene = ps.Scene()
    with refused(match):
        scene.add_cloth(**given | options)
    assert scene.particle_count == 0 and not scene.constraints
