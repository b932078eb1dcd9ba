"""Constraints on tuples in scenes: worlds, execution, extremes, arguments."""

import functools

import numpy as np
import pytest
import warp as wp

import particlesim as ps
from cases.worlds import equal_alone


@pytest.fixture
def simulate(simulate):
    """In float32, unless told otherwise."""
    return functools.partial(simulate, precision="float32")


# Worlds and execution -------------------------------------------------------------------------


@pytest.fixture
def hung_cloth(cloth):
    """A function: a cloth hung by two corners."""

    def make(compliance, seed=0):
        x, pairs = cloth(n=8, seed=seed)
        scene = ps.Scene()
        scene.add_particles(x, pinned=np.isin(np.arange(len(x)), (0, 7)))
        scene.add_interaction(ps.UniformGravity())
        scene.add_constraint(
            ps.Distance(pairs, 0.1, compliance=compliance, damping=5.0, break_force=400.0)
        )
        return scene

    return make


def test_a_world_in_a_batch_equals_it_alone(precision, device, simulate, hung_cloth):
    """Bit for bit, with a compliance of its own in each world."""
    compliances = [0.0, 1e-6, 1e-4]
    knobs = {"dt": 1 / 60, "substeps": 8, "iterations": 2, "precision": precision}
    scenes = [hung_cloth(c, seed=k) for k, c in enumerate(compliances)]
    equal_alone(simulate, scenes, device, 10, **knobs)


def test_reset_of_one_world_leaves_the_others(device, simulate, hung_cloth):
    """The world that is reset goes as at first; the other goes on as if nothing had happened."""
    scenes = [hung_cloth(1e-6), hung_cloth(1e-4)]
    sim = simulate(scenes, device, dt=1 / 60, substeps=8)
    sim.run(5)
    first = sim.world(0).position
    untouched = simulate(scenes, device, dt=1 / 60, substeps=8)
    untouched.run(10)
    sim.reset([0])
    sim.run(5)
    assert np.array_equal(sim.world(0).position, first)
    assert np.array_equal(sim.world(1).position, untouched.world(1).position)


def test_graph_equals_threads(simulate, cloth):
    """Bit for bit, however a launch is cut; enough tuples for chunks."""
    x, pairs = cloth(n=60)
    found = []
    for knobs in ({"execution": "graph"}, {"execution": "threads", "threads": 3}):
        scene = ps.Scene()
        scene.add_particles(x, pinned=np.arange(len(x)) < 60)
        scene.add_interaction(ps.UniformGravity())
        scene.add_constraint(ps.Distance(pairs, 0.1, compliance=1e-7))
        sim = simulate(scene, dt=1 / 60, substeps=4, **knobs)
        sim.run(3)
        found.append((sim.position, sim.velocity))
        sim.close()
    assert np.array_equal(found[0], found[1])


def test_only_what_is_required(device, simulate, pair, hung_cloth):
    """No positions of the last substep, no pass for what cannot break."""
    sim = simulate(hung_cloth(1e-6), device)
    assert "previous_position" not in sim.state
    launches = [key for who, key, _ in sim.explain().launches if who == "Distance"]
    assert any("strain" in key for key in launches)
    scene = pair()
    scene.add_constraint(ps.Distance([(0, 1)]))
    launches = [key for who, key, _ in simulate(scene, device).explain().launches]
    assert not any("strain" in key for key in launches)


# Extremes -------------------------------------------------------------------------------------


@pytest.mark.parametrize("compliance", [0.0, 1e-12, 1e12])
@pytest.mark.parametrize("ratio", [1.0, 1e4, 1e-4])
def test_extreme_masses_and_compliances(compliance, ratio, precision, device, simulate):
    """A chain of ten thousandfold mass steps stays bounded and falls no faster than gravity."""
    scene = ps.Scene()
    x = np.stack([np.arange(5.0), 0 * np.arange(5.0), 0 * np.arange(5.0)], axis=1)
    mass = np.where(np.arange(5) % 2, ratio, 1.0)
    scene.add_particles(x, mass=mass, pinned=np.arange(5) == 0)
    scene.add_interaction(ps.UniformGravity((0, -10, 0)))
    scene.add_constraint(ps.Distance([(k, k + 1) for k in range(4)], compliance=compliance))
    sim = simulate(scene, device, dt=1 / 60, substeps=20, precision=precision)
    sim.run(60)
    energy = sim.diagnostics().energy[0] / mass.max()
    assert np.isfinite(sim.position).all()
    assert energy < 1e-3  # started at 0, and nothing adds to it


@pytest.mark.parametrize("gap", [0.0, 5e-9, 1e-30])
def test_coincident_ends_part(gap, precision, device, simulate, pair):
    """Equally and opposite, to the rest length, whatever little is between them."""
    scene = pair(x=[(0, 0, 0), (gap, 0, 0)])
    scene.add_constraint(ps.Distance([(0, 1)], 1.0))
    sim = simulate(scene, device, precision=precision)
    sim.project(1)
    apart = sim.position[1] - sim.position[0]
    assert np.linalg.norm(apart) == pytest.approx(1, rel=1e-6)
    assert np.abs(sim.position.sum(axis=0)).max() < 1e-7
    sim.step()
    assert np.allclose(sim.velocity, 0, atol=1e-4)


def test_degenerate_tuples_stay(precision, device, simulate, laws):
    """Of derived laws without a gradient: a length of nothing, angles of a folded triple."""
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0), (0, 0, 0), (1, 0, 0), (1, 0, 0), (1, 0, 0)])
    scene.add_constraint(ps.Constraint(laws.distance, [(0, 1)], rest_length=1.0))
    scene.add_constraint(ps.Constraint(laws.angle, [(2, 3, 4)], rest_angle=1.0))
    scene.add_constraint(ps.Constraint(laws.volume, [(0, 1, 2, 3)], rest_volume=1.0))
    sim = simulate(scene, device, precision=precision)
    sim.run(3)
    assert np.allclose(sim.position[:, 0], [0, 0, 1, 1, 1])


def test_all_pinned_and_empty(device, simulate, pair):
    """Nothing to move, and nothing at all."""
    scene = pair(pinned=True)
    scene.add_constraint(ps.Distance([(0, 1)], 3.0))
    empty = scene.add_constraint(ps.Distance(np.zeros((0, 2), int), break_force=1.0))
    sim = simulate(scene, device)
    sim.run(2)
    assert np.allclose(sim.position, [(0, 0, 0), (1, 0, 0)])
    assert sim.force(empty).shape == sim.broken(empty).shape == (0,)


def test_no_time_passes(device, simulate, pair):
    """A substep of nothing changes nothing."""
    scene = pair()
    scene.add_constraint(ps.Distance([(0, 1)], 3.0, compliance=1e-3, break_force=1.0))
    sim = simulate(scene, device)
    sim.substep(0.0)
    assert np.allclose(sim.position, [(0, 0, 0), (1, 0, 0)])


# Arguments ------------------------------------------------------------------------------------


@ps.law
def no_position(length: float):
    """Not a constraint."""
    return length


@ps.law
def own_name(a: wp.vec3, b: wp.vec3, compliance: float):
    """Takes a name that every constraint has."""
    return wp.length(b - a) - compliance


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (
            lambda laws: ps.Distance([(0, 1, 2)]),
            r"Distance: pairs must have shape \(m, 2\) of indices",
        ),
        (lambda laws: ps.Distance([(0, 0)]), "Distance: pairs.0. must name different particles"),
        (lambda laws: ps.Distance([(0, -1)]), "Distance: pairs must hold indices from 0 up"),
        (lambda laws: ps.Distance([(0, 1)], -1.0), "Distance: rest_length.0. must be at least 0"),
        (lambda laws: ps.Distance([(0, 1)], [1.0, 2.0]), "Distance: rest_length must have shape"),
        (lambda laws: ps.Distance([(0, 1)], np.nan), "Distance: rest_length.* must be finite"),
        (
            lambda laws: ps.Distance([(0, 1)], compliance=-1),
            "Distance: compliance.0. must be at least",
        ),
        (lambda laws: ps.Distance([(0, 1)], damping=np.inf), "Distance: damping.* must be finite"),
        (
            lambda laws: ps.Distance([(0, 1)], break_force=0),
            r"Distance: break_force.0. must be above 0",
        ),
        (
            lambda laws: ps.Distance([(0, 1)], inequality=True, tension_only=True),
            "Distance: tension_only must be False with inequality",
        ),
        (
            lambda laws: ps.Constraint(laws.distance, [(0, 1)]),
            r"Constraint: rest_length must be given, as distance\(a, b, rest_length\) asks for it",
        ),
        (
            lambda laws: ps.Constraint(laws.distance, [(0, 1, 2)], rest_length=1.0),
            r"Constraint: particles must have shape \(m, 2\) of indices",
        ),
        (
            lambda laws: ps.Constraint(no_position, [(0, 1)], length=1.0),
            r"Constraint: law must take positions \(wp.vec3\) first, got 'no_position'",
        ),
        (
            lambda laws: ps.Constraint(own_name, [(0, 1)], compliance=1.0),
            "Constraint: parameter compliance of own_name must have a name of its own",
        ),
        (
            lambda laws: ps.Constraint(laws.reach, [0], anchor=(1, 2), length=1.0),
            "Constraint: anchor must have shape",
        ),
        (
            lambda laws: ps.Distance([(0, 1)]).as_force(),
            r"Distance.as_force: compliance.0. must be above 0, got 0.0; its force would be",
        ),
        (
            lambda laws: ps.Distance([(0, 1)], compliance=1.0, break_force=1.0).as_force(),
            "Distance.as_force: break_force must be None",
        ),
    ],
)
def test_bad_arguments(make, message, laws):
    """Each in the house form."""
    with pytest.raises(ValueError, match=message):
        make(laws)


def test_unknown_parameter(laws):
    """Lists those that the law has."""
    with pytest.raises(TypeError, match="parameter of distance must be one of rest_length, got"):
        ps.Constraint(laws.distance, [(0, 1)], rest_lenght=1.0)


def test_index_beyond_the_scene(device, simulate, pair):
    """Found when the scene is known."""
    scene = pair()
    scene.add_constraint(ps.Distance([(0, 2)], 1.0))
    with pytest.raises(ValueError, match="Distance: particles must hold indices from 0 to 1, got"):
        simulate(scene, device)


def test_scenes_of_other_kinds_do_not_mix(device, simulate, pair):
    """A rope is not a rod."""
    scenes = []
    for options in ({}, {"tension_only": True}):
        scene = pair()
        scene.add_constraint(ps.Distance([(0, 1)], **options))
        scenes.append(scene)
    with pytest.raises(ValueError, match="be of the kinds of scenes"):
        simulate(scenes, device)
