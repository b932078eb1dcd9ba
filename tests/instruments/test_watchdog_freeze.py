"""The watchdog: worlds that are frozen, and others that never notice."""

import functools

import numpy as np
import pytest

import particlesim as ps
from cases.watchdog import quietly, same, spoiled
from particlesim.engine.neighbors import verlet


def cluster(seed, when=1e9, side=3):
    """A warm cluster of atoms; from ``when`` on something throws it apart."""
    scene = ps.Scene()
    count = side**3
    scene.add_particles(
        ps.sample.lattice("sc", (side,) * 3, 1.1),
        velocity=np.random.default_rng(seed).normal(0, 0.3, (count, 3)),
    )
    scene.add_interaction(ps.LennardJones(cutoff=2.5))
    scene.add_interaction(ps.ParticleForce(spoiled, when=when, push=1e15))
    return scene


WORLDS, SICK = 256, 97


def crowd(sick):
    return [cluster(w, when=0.022 if sick and w == SICK else 1e9) for w in range(WORLDS)]


@functools.cache
def healthy(kind, device, frames):
    """Positions and velocities of the worlds of a crowd in which nothing happens."""
    sim = ps.Simulation(crowd(sick=False), ps.Settings(dt=0.01, substeps=2), device=device)
    assert bool(sim.neighbors.verlet[0].grids) == (kind == "grid")
    quietly(sim, frames)
    return sim.position, sim.velocity


@pytest.mark.parametrize("kind", ["direct", "grid"])
@pytest.mark.parametrize("healing", ["freeze", "reset"])
def test_one_world_of_256_explodes_and_the_others_never_notice(kind, healing, device, monkeypatch):
    if kind == "grid":
        # Every world, of 27 atoms, then has a hash grid of its own.
        monkeypatch.setattr(verlet, "SMALL", 8)
        monkeypatch.setattr(verlet, "DIRECT", 8)
    on_failure = "freeze" if healing == "freeze" else "stop"
    settings = ps.Settings(dt=0.01, substeps=2, on_failure=on_failure)
    sim = ps.Simulation(crowd(sick=True), settings, device=device)
    assert bool(sim.neighbors.verlet[0].grids) == (kind == "grid")
    quietly(sim, 2)
    held = sim.world(SICK).position, sim.world(SICK).velocity
    if healing == "freeze":
        quietly(sim, 4)
        assert sim.frozen == [SICK]
        assert [(each.world, each.action) for each in sim.incidents] == [(SICK, "freeze")]
    else:
        with pytest.raises(ps.SimulationError, match=f"in world {SICK} between t = 0.02 and"):
            sim.step()
        sim.reset([SICK])
        for _ in range(4):
            sim.reset([SICK])  # it would explode again, by its clock, in its third frame
            sim.step()
    x, v = healthy(kind, device, 6)
    others = sim.model.world_of != SICK
    np.testing.assert_array_equal(sim.position[others], x[others])
    np.testing.assert_array_equal(sim.velocity[others], v[others])
    if healing == "freeze":
        np.testing.assert_array_equal(sim.world(SICK).position, held[0])
        np.testing.assert_array_equal(sim.world(SICK).velocity, held[1])


def grains(when=1e9):
    """All that a world can leave behind: broken links, slack, sums of errors, a clock, pressure."""
    scene = ps.Scene()
    x = ps.sample.lattice("sc", (3, 3, 3), 0.09, origin=(0.1, 0.1, 0.1))  # overlapping at first
    grain = scene.add_particles(x, mass=0.01, radius=0.05)
    water = scene.add_particles(
        ps.sample.box((1, 0, 0), (1.4, 0.4, 0.4), spacing=0.1), mass=1.0, group="water"
    )
    scene.add_interaction(ps.UniformGravity())
    scene.add_interaction(
        ps.SPH(water, smoothing_length=0.15, rest_density=1000.0,
               equation_of_state=ps.Tait(sound_speed=10.0))
    )  # fmt: skip
    scene.add_interaction(ps.ParticleForce(spoiled, [3], when=when, push=1e15))
    scene.add_constraint(ps.Distance([(0, 1), (1, 2)], compliance=1e-5, break_force=0.5))
    scene.add_constraint(ps.Contact(grain, friction=0.3))
    scene.add_constraint(ps.PlaneBoundary((0, 0, 0), (0, 1, 0)))
    return scene


GRAINS = ps.Settings(dt=0.02, substeps=10, on_failure="freeze")


def test_a_frozen_world_stands_still_in_all_that_it_is(precision, device, tmp_path):
    settings = GRAINS.replace(precision=precision)
    sim = ps.Simulation([grains(), grains(0.05)], settings, device=device)
    twin = ps.Simulation([grains(), grains()], settings, device=device)
    quietly(sim, 2)
    names = set(sim.state.arrays) - {"world", "correction", "density", "pressure"}
    names -= {"previous_position", "force"}  # of a substep, not of a state
    rows, held = sim.world(1).rows, {}
    for name in names:
        held[name] = sim.get(name)[slice(1, 2) if name == "time" else rows]
    quietly(sim, 3)
    quietly(twin, 5)
    assert sim.frozen == [1] and sim.incidents[0].part == "ParticleForce"
    for name, before in held.items():
        now = sim.get(name)[slice(1, 2) if name == "time" else rows]
        np.testing.assert_array_equal(now, before, err_msg=name)
    assert np.isfinite(sim.get("density")).all()
    assert np.isfinite(sim.get("pressure")).all()
    same(sim.world(0), twin.world(0))
    rods = sim.constraints[0]
    np.testing.assert_array_equal(rods.broken[:2], twin.constraints[0].broken[:2])


def test_a_reset_heals_completely(precision, device):
    settings = GRAINS.replace(precision=precision)
    sim = ps.Simulation([grains(), grains(0.09)], settings, device=device)
    first = []
    for _ in range(4):
        quietly(sim, 1)
        first.append((sim.world(1).position, sim.world(1).velocity, sim.get("density")))
    quietly(sim, 3)
    assert sim.frozen == [1]
    sim.reset([1])
    assert sim.frozen == []
    assert not sim.constraints[0].broken[2:].any() and not sim.constraints[0].force[2:].any()
    for x, v, density in first:
        quietly(sim, 1)
        np.testing.assert_array_equal(sim.world(1).position, x)
        np.testing.assert_array_equal(sim.world(1).velocity, v)
        rows = sim.world(1).rows
        np.testing.assert_array_equal(sim.get("density")[rows], density[rows])
    quietly(sim, 1)
    assert sim.frozen == [1] and len(sim.incidents) == 2


def test_worlds_freeze_one_after_the_other_and_thaw_alone(device):
    scenes = [grains(when) for when in (0.03, 1e9, 0.07)]
    sim = ps.Simulation(scenes, GRAINS, device=device)
    quietly(sim, 2)
    assert sim.frozen == [0]
    quietly(sim, 3)
    assert sim.frozen == [0, 2]
    third = sim.world(2).position
    sim.reset([0])
    assert sim.frozen == [2]
    quietly(sim, 1)
    assert sim.frozen == [2]
    np.testing.assert_array_equal(sim.world(2).position, third)
    alone = ps.Simulation(scenes[0], GRAINS, device=device)
    alone.step()
    same(sim.world(0), alone)


def test_a_checkpoint_carries_the_frozen_and_the_incidents(precision, device, tmp_path):
    settings = GRAINS.replace(precision=precision)
    scenes = [grains(), grains(0.05)]
    sim = ps.Simulation(scenes, settings, device=device)
    quietly(sim, 4)
    sim.save(tmp_path / "run.npz")
    loaded = ps.Simulation.load(tmp_path / "run.npz", scenes, device=device)
    assert loaded.frozen == [1] and loaded.incidents == sim.incidents
    quietly(sim, 2)
    quietly(loaded, 2)
    same(sim, loaded)
    np.testing.assert_array_equal(sim.get("density"), loaded.get("density"))
    loaded.reset([1])
    assert loaded.frozen == []
    quietly(loaded, 1)
    assert not np.array_equal(loaded.world(1).position, sim.world(1).position)
