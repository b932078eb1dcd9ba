"""Contacts in scenes: worlds, execution, requirements, arguments."""

import numpy as np
import pytest

import particlesim as ps
from cases.worlds import equal_alone


@pytest.fixture
def heap(grains):
    """A function: grains over a floor, with every parameter of contacts of its own."""

    def make(k, device="cpu", worlds=None, **knobs):
        rng = np.random.default_rng(k)
        x = ps.sample.lattice("sc", (3, 4 + k, 3), 1.1) + rng.uniform(-0.04, 0.04, (9 * (4 + k), 3))
        scene = grains(x, radius=rng.uniform(0.4, 0.5, len(x)), gravity=True,
                       contact=[{}, {"friction": 0.4}, {"restitution": 0.5},
                                {"compliance": 1e-4, "friction": 0.2}][k])  # fmt: skip
        scene.add_constraint(ps.PlaneBoundary((0, -0.5, 0), (0, 1, 0), friction=0.1 * k))
        return scene

    return make


def test_a_world_in_a_batch_equals_it_alone(precision, device, simulate, heap):
    """Bit for bit, with and without friction, restitution and compliance; all overlap in space."""
    knobs = {"dt": 1 / 60, "substeps": 5, "iterations": 2, "precision": precision}
    scenes = [heap(k) for k in range(4)]
    equal_alone(simulate, scenes, device, 40, **knobs)


def test_reset_and_placement_leave_other_worlds(device, simulate, heap):
    """World 0 goes as at first after its reset; world 1 never notices."""
    scenes = [heap(1), heap(1)]
    knobs = {"dt": 1 / 60, "substeps": 5}
    sim, untouched = (simulate(scenes, device, **knobs) for _ in range(2))
    untouched.run(20)
    sim.run(10)
    first = sim.world(0).position
    sim.world(0).position = sim.world(0).position * 0.9
    sim.run(5)
    sim.reset([0])
    sim.run(5)
    assert np.array_equal(sim.world(1).position, untouched.world(1).position)
    sim.run(5)
    assert np.array_equal(sim.world(0).position, first)


def test_graph_equals_threads(simulate, grains, cloud):
    """Bit for bit, with friction and restitution, through rebuilds of the lists."""
    found = []
    for knobs in ({"execution": "graph"}, {"execution": "threads", "threads": 3}):
        given = cloud(2500)
        scene = grains(**given, gravity=True, contact={"friction": 0.3, "restitution": 0.5})
        scene.add_constraint(ps.BoxBoundary((-5, -5, -5), (20, 20, 20), friction=0.3))
        sim = simulate(scene, dt=1 / 60, substeps=4, precision="float32", **knobs)
        sim.run(5)
        found.append((sim.position, sim.velocity))
        sim.close()
    assert np.array_equal(found[0], found[1])


def test_plain_loop_equals_native(monkeypatch, simulate, grains, cloud):
    """The loop in Warp's own language, as on CUDA, against the vectorised one."""
    found = []
    for vectorised in (True, False):
        scene = grains(**cloud(60), contact={"friction": 0.4, "restitution": 0.5})
        monkeypatch.setattr("particlesim.engine.model.Model.vectorised", vectorised, raising=False)
        sim = simulate(scene, dt=0.02)
        sim.run(10)
        found.append(sim.position)
    assert np.allclose(found[0], found[1], rtol=0, atol=1e-11)


def test_only_what_is_required(device, simulate, grains):
    """No positions of the last substep, with friction or without."""
    sim = simulate(grains([(0, 0, 0), (1, 0, 0)], contact={"friction": 0.5}), device)
    assert "previous_position" not in sim.state
    assert "force" not in sim.state


@pytest.mark.parametrize(
    ("x", "radius", "pinned"),
    [
        ([(0, 0, 0), (0, 0, 0)], 0.0, False),  # points
        ([(0, 0, 0)], 0.5, False),  # one grain
        (np.zeros((0, 3)), 0.5, False),  # none
        ([(0, 0, 0), (0.1, 0, 0)], 0.5, True),  # nothing can move
    ],
)
def test_nothing_to_touch(x, radius, pinned, device, simulate, grains):
    """Each runs, and nothing moves."""
    sim = simulate(grains(x, radius, pinned=pinned), device)
    sim.run(2)
    assert np.array_equal(sim.position, np.reshape(x, (-1, 3)))


def test_empty_group_and_world_of_points(device, simulate):
    """A world whose group is empty, and one of points, beside one with contacts."""
    scenes = []
    for k, radius in enumerate((0.5, 0.0, 0.5)):
        scene = ps.Scene()
        some = scene.add_particles([(0, 0, 0), (0.9, 0, 0)], radius=radius)
        scene.add_constraint(ps.Contact(some if k < 2 else []))
        scenes.append(scene)
    sim = simulate(scenes, device, dt=1 / 60)
    sim.run(120)
    assert np.linalg.norm(np.diff(sim.world(0).position, axis=0)) >= 1 - 1e-9
    for k in (1, 2):
        assert np.array_equal(sim.world(k).position, [(0, 0, 0), (0.9, 0, 0)])


@pytest.mark.parametrize("how", ["pairs", "part", "True"])
def test_who_is_excluded_does_not_touch(how, device, simulate):
    """A chain of overlapping beads stays as it is, and beads that are not next to each other part.

    In the second world of the two nothing is excluded: its chain is pushed apart.
    """
    scenes = []
    for k in range(2):
        scene = ps.Scene()
        scene.add_particles([(0, 0, 0), (0.6, 0, 0), (0.6, 0.6, 0), (0, 0.7, 0)], radius=0.5)
        links = [(0, 1), (1, 2), (2, 3)]
        chain = scene.add_constraint(ps.Distance(links))
        given = {"pairs": links, "part": chain, "True": True}[how] if k == 0 else None
        scene.add_constraint(ps.Contact(exclude=given))
        scenes.append(scene)
    sim = simulate(scenes, device, dt=1 / 60, iterations=20)
    sim.run(300)
    x = sim.world(0).position
    lengths = np.linalg.norm(np.diff(x, axis=0), axis=1)
    assert np.allclose(lengths, [0.6, 0.6, np.hypot(0.6, 0.1)], rtol=0, atol=1e-6)
    assert np.linalg.norm(x[0] - x[3]) > 1 - 1e-3
    assert np.linalg.norm(sim.world(1).position[0] - sim.world(1).position[1]) > 0.61


def test_no_time_passes(device, simulate, grains):
    """A substep of nothing changes nothing."""
    sim = simulate(grains([(0, 0, 0), (0.5, 0, 0)], contact={"restitution": 0.5}), device)
    sim.substep(0.0)
    assert np.array_equal(sim.position, [(0, 0, 0), (0.5, 0, 0)])


def test_static_projection(device, simulate, grains):
    """sim.project takes overlaps out of a start at once, without speed."""
    sim = simulate(grains([(0, 0, 0), (0.5, 0, 0)], contact={"friction": 0.5}), device)
    sim.project(1)
    assert np.allclose(sim.position[:, 0], [-0.25, 0.75])
    sim.step()
    assert np.allclose(sim.velocity, 0)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"friction": -0.1}, "Contact: friction must be at least 0, got -0.1"),
        ({"friction": np.nan}, "Contact: friction must be finite"),
        ({"restitution": 1.5}, "Contact: restitution must be at most 1, got 1.5"),
        ({"exclude": [(0, 0)]}, "Contact: exclude"),
        ({"compliance": -1.0}, r"Contact: compliance must be at least 0 \[length/force\]"),
    ],
)
def test_bad_arguments(arguments, message):
    """Each in the house form."""
    with pytest.raises(ValueError, match=message):
        ps.Contact(**arguments)


def test_box_narrower_than_two_cutoffs(device, simulate):
    """Refused, as a grain would touch two images of another."""
    scene = ps.Scene(periodic=((0, 0, 0), (1.5, 1.5, 1.5)))
    scene.add_particles([(0, 0, 0), (0.7, 0, 0)], radius=0.5)
    scene.add_constraint(ps.Contact())
    with pytest.raises(ValueError, match="periodic length along x must be at least two cutoffs"):
        simulate(scene, device)
