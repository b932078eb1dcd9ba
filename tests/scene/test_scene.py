"""Scene and Group: descriptions on the host."""

import subprocess
import sys

import numpy as np
import pytest

import particlesim as ps
from particlesim.scene.group import select


def test_groups_index_the_scene():
    scene = ps.Scene()
    scene.add_particles(np.zeros((4, 3)))
    rope = scene.add_particles(np.ones((5, 3)), group="rope")
    assert len(rope) == 5
    assert rope[0] == 4
    assert rope[-1] == 8
    assert list(rope) == [4, 5, 6, 7, 8]
    assert isinstance(rope[2], int)
    np.testing.assert_array_equal(rope[1:3], [5, 6])
    np.testing.assert_array_equal(rope[[0, 4]], [4, 8])
    np.testing.assert_array_equal(scene.position[rope.slice], np.ones((5, 3)))
    assert scene["rope"] is rope
    assert [group.name for group in scene.groups] == ["group_0", "rope"]
    with pytest.raises(IndexError):
        rope[5]


def test_one_value_for_all_or_one_each():
    scene = ps.Scene()
    scene.add_particles(np.zeros((2, 3)), velocity=(1, 2, 3), mass=2.0, radius=[0.1, 0.2])
    scene.add_particles(np.zeros((1, 3)), pinned=True)
    scene.add_particles(np.zeros((2, 3)), pinned=[False, True])
    np.testing.assert_array_equal(scene.velocity, [[1, 2, 3]] * 2 + [[0, 0, 0]] * 3)
    np.testing.assert_array_equal(scene.mass, [2, 2, 1, 1, 1])
    np.testing.assert_array_equal(scene.radius, [0.1, 0.2, 0, 0, 0])
    np.testing.assert_array_equal(scene.pinned, [False, False, True, False, True])


def test_attributes_are_zero_where_they_are_not_given():
    scene = ps.Scene()
    scene.add_particles(np.zeros((2, 3)))
    scene.add_particles(np.zeros((2, 3)), charge=[1, -1], spin=[(0, 0, 1)] * 2)
    scene.add_particles(np.zeros((1, 3)), charge=5)
    np.testing.assert_array_equal(scene.column("charge"), [0, 0, 1, -1, 5])
    np.testing.assert_array_equal(scene.column("spin")[:, 2], [0, 0, 1, 1, 0])
    assert scene.attributes["charge"] is None
    assert scene.attributes["spin"] == 3


def test_three_numbers_for_three_particles_are_numbers():
    scene = ps.Scene()
    scene.add_particles(np.zeros((3, 3)), charge=[1, 2, 3])
    assert scene.attributes["charge"] is None


@pytest.mark.parametrize("count", [1, 2, 3, 4])
def test_shapes_mean_the_same_at_every_count(count, refused):
    """A list of one is one particle's, and three numbers are those of three particles."""
    x = np.zeros((count, 3))
    given = {"mass": [2.0], "radius": [0.5], "pinned": [1], "charge": [2.0], "spin": (0, 0, 1)}
    rows = {"mass": 1, "radius": 1, "pinned": 1, "charge": 1, "spin": 3}
    for name, value in given.items():
        scene = ps.Scene()
        if rows[name] == count:
            scene.add_particles(x, **{name: value})
            np.testing.assert_array_equal(scene.column(name), value)
        else:
            with refused(f"{name} must have shape"):
                scene.add_particles(x, **{name: value})
    with refused("velocity must have shape"):
        ps.Scene().add_particles(x, velocity=5.0)


@pytest.mark.parametrize(
    "name, real",
    [("vel", "velocity"), ("velocities", "velocity"), ("masses", "mass"), ("radii", "radius"),
     ("pined", "pinned"), ("colour", "color"), ("groups", "group"), ("positions", "position")],
)  # fmt: skip
def test_a_misspelt_argument_is_no_attribute(name, real, refused):
    with refused(f"unlike its own argument {real}, got '{name}'; write {real}="):
        ps.Scene().add_particles([(0, 0, 0)], **{name: 1.0})


def test_numbers_as_text_are_refused(refused):
    with refused("mass must be numbers"):
        ps.Scene().add_particles([(0, 0, 0)], mass="1")
    with refused("cutoff must be a number"):
        ps.LennardJones(cutoff="3")


def test_what_stands_for_a_group(refused):
    """A group, its name, several of both, indices or a mask are the same particles."""
    scene = ps.Scene()
    scene.add_particles(np.zeros((2, 3)), group="sand")
    water = scene.add_particles(np.ones((3, 3)), group="water")
    for given in (water, "water", [water], ["water"], [2, 3, 4], scene.position[:, 0] > 0):
        np.testing.assert_array_equal(select(scene, given, "Part"), [2, 3, 4])
    np.testing.assert_array_equal(select(scene, ["sand", water], "Part"), np.arange(5))
    with refused("group must be one of sand, water, got 'wader'; did you mean 'water'"):
        select(scene, "wader", "Part")
    with refused(r"group must have shape \(5,\) where it is True and False"):
        select(scene, [True, False], "Part")


def test_what_was_given_may_change_afterwards():
    x = np.zeros((2, 3))
    scene = ps.Scene()
    scene.add_particles(x)
    x += 1
    assert not scene.position.any()


@pytest.mark.parametrize("empty", [[], np.zeros((0, 3)), np.zeros((0, 2))])
def test_an_empty_group(empty):
    scene = ps.Scene()
    none = scene.add_particles(empty, charge=2.0)
    assert len(none) == 0
    assert scene.position.shape == (0, 3)
    scene.add_particles([(0, 0, 0)], charge=1.0)
    np.testing.assert_array_equal(scene.column("charge"), [1.0])


@pytest.mark.parametrize(
    ("position", "says"),
    [
        ([0, 1, 2], r"position must have shape \(n, 3\)"),
        ([[0, 1]], "one row a particle"),
        (1.0, "shape"),
        (None, "shape"),
        ([[0, 1, 2], [0, 1]], "must be numbers"),
        ([["a", "b", "c"]], "must be numbers"),
        ([[0, 1, 2], [0, np.nan, 2]], r"position\[1, 1\] must be finite, got nan"),
        ([[0, 0, np.inf]], "got inf"),
    ],
)
def test_bad_positions(position, says, refused):
    scene = ps.Scene()
    with refused(says):
        scene.add_particles(position)
    assert scene.particle_count == 0
    assert not scene.groups


@pytest.mark.parametrize(
    ("argument", "value", "says"),
    [
        ("velocity", [1, 2], r"shape \(3,\) or \(2, 3\), got \(2,\)"),
        ("velocity", (0, np.inf, 0), "finite"),
        ("mass", [1, 2, 3], r"shape \(\) or \(2,\)"),
        ("mass", 0, r"mass\[0\] must be above 0, got 0.0; use pinned=True"),
        ("mass", [1, -2], r"mass\[1\] must be above 0, got -2.0"),
        ("mass", np.nan, "finite"),
        ("mass", np.inf, "finite"),
        ("mass", "heavy", "numbers"),
        ("radius", [0.1, -0.1], r"radius\[1\] must be at least 0, got -0.1"),
        ("radius", np.nan, "finite"),
        ("pinned", [True] * 3, "shape"),
        ("pinned", "no", "numbers"),
        ("pinned", 2, "True or False"),
        ("pinned", np.nan, "finite"),
        ("color", (1, 2), "shape"),
        ("color", (0, 0, 255), "from 0 to 1, got 255.0"),
        ("charge", np.zeros((2, 2)), "shape"),
        ("charge", [1, np.nan], r"charge\[1\] must be finite"),
        ("density", 1.0, "have a name of its own, got 'density'"),
        ("x", 1.0, "have a name of its own"),
    ],
)
def test_bad_values(argument, value, says, refused):
    with refused(says):
        ps.Scene().add_particles(np.zeros((2, 3)), **{argument: value})


def test_a_name_used_twice(refused):
    scene = ps.Scene()
    scene.add_particles([], group="a")
    with refused("be a new name, got 'a'"):
        scene.add_particles([], group="a")


def test_an_attribute_is_of_one_kind(refused):
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0)], charge=1.0)
    with refused("charge must be numbers as before"):
        scene.add_particles([(0, 0, 0)], charge=[(1, 2, 3)])


def test_a_group_that_is_not_there(refused):
    scene = ps.Scene()
    scene.add_particles([], group="water")
    with refused(r"must be one of \['water'\], got 'watre'", kind=KeyError):
        scene["watre"]


@pytest.mark.parametrize("wrong", [None, 5, ps.Gravity, ps.Scene()])
def test_only_interactions_and_constraints_are_added(wrong, refused):
    with refused("Scene.add_interaction: interaction must", kind=TypeError):
        ps.Scene().add_interaction(wrong)
    with refused("Scene.add_constraint: constraint must", kind=TypeError):
        ps.Scene().add_constraint(wrong)


def test_periodic_axes():
    assert ps.Scene().periodic is None
    assert ps.Scene(periodic=((None,) * 3, (None,) * 3)).periodic is None
    lower, upper, on = ps.Scene(periodic=((-1, None, 0), (1, None, 2))).periodic
    assert on == (True, False, True)
    np.testing.assert_array_equal(lower, [-1, 0, 0])
    np.testing.assert_array_equal(upper, [1, 0, 2])
    # Both corners as one array.
    assert ps.Scene(periodic=np.array([[0, 0, 0], [1, 1, 1]])).periodic[2] == (True,) * 3


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"periodic": 5}, "both corners"),
        ({"periodic": "ab"}, "both corners"),
        ({"periodic": ((0, 0, 0), (1, 1))}, "both corners"),
        ({"periodic": ((0, 0, 0), (1, 1, 0))}, "upper corner above the lower"),
        ({"periodic": ((0, 0, 0), (1, np.nan, 1))}, "finite"),
        ({"periodic": (("a", 0, 0), (1, 1, 1))}, "numbers"),
        ({"up_axis": "w"}, "one of x, y, z"),
        ({"meters_per_unit": 0}, r"above 0 \[m\]"),
        ({"meters_per_unit": np.nan}, "finite"),
    ],
)
def test_bad_scenes(options, says, refused):
    with refused(says):
        ps.Scene(**options)


def test_description_does_no_device_work():
    # Warp's runtime starts with the first simulation, not with the import or the scene.
    code = (
        "import particlesim as ps, warp._src.context as context\n"
        "scene = ps.Scene()\n"
        "scene.add_particles([(0, 0, 0)], charge=1.0)\n"
        "scene.add_interaction(ps.LennardJones())\n"
        "ps.Settings()\n"
        "assert context.runtime is None\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True, timeout=100)
