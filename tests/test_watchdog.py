"""The watchdog: what it finds and whom it names, what it does about it, and who never notices."""

import functools
import math
import warnings

import numpy as np
import pytest
import warp as wp

import particlesim as ps
from particlesim.engine.frames import Frames
from particlesim.engine.neighbors import verlet
from particlesim.instruments.watchdog import audit
from particlesim.instruments.watchdog.watch import Watchdog
from particlesim.simulation.resume import checkpoint_path

G = 9.81


@ps.law
def spoiled(position: wp.vec3, time: float, when: float, push: float):
    """Nothing until ``when``; then a push without measure: 1e30 is finite, and 1e39 is not."""
    along = wp.vec3(push, 0.0, 0.0)
    return wp.where(time > when, along * (push * push), wp.vec3(0.0, 0.0, 0.0))


@ps.law
def anchor(r: float, stiffness: float):
    return 0.5 * stiffness * r * r


def drifting(*interactions, count=3, **options):
    """Particles at 0, 1, 2... on x that fly along y."""
    scene = ps.Scene(**options)
    x = np.zeros((count, 3))
    x[:, 0] = np.arange(count)
    scene.add_particles(x, velocity=(0, 1, 0))
    for interaction in interactions:
        scene.add_interaction(interaction)
    return scene


def oscillator(omega=1.0, length=1.0):
    """A mass on a spring of no length to a pin: x = length cos(omega t)."""
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0)], pinned=True)
    scene.add_particles([(length, 0, 0)])
    scene.add_interaction(ps.Springs([(0, 1)], omega**2, rest_length=0.0))
    return scene


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


def quietly(sim, frames):
    """Step without the reports of incidents; they are on ``sim.incidents``."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ps.SimulationWarning)
        for _ in range(frames):
            sim.step()


def same(ours, theirs):
    for name in ("position", "velocity"):
        np.testing.assert_array_equal(ours.get(name), theirs.get(name), err_msg=name)


@pytest.fixture
def alarms(monkeypatch):
    """How often any flag was up."""
    seen = []
    attend = Watchdog.attend
    monkeypatch.setattr(
        Watchdog,
        "attend",
        lambda self, frames: seen.append(frames.loop.frame) or attend(self, frames),
    )
    return seen


# What is found ----------------------------------------------------------------------------------


@pytest.mark.parametrize("execution", ["graph", "threads"])
@pytest.mark.parametrize("method", ["symplectic_euler", "velocity_verlet"])
def test_what_is_not_finite_is_named(method, execution, precision, device):
    push = 1e15 if precision == "float32" else 1e150  # cubed it overflows
    scene = drifting(
        ps.UniformGravity(), ps.ParticleForce(spoiled, [1], when=0.25, push=push), ps.Drag(0.1)
    )
    settings = ps.Settings(
        dt=0.1, substeps=5, execution=execution, precision=precision, integrator=method
    )
    sim = ps.Simulation(scene, settings, device=device)
    quietly(sim, 2)
    good = sim.position
    with pytest.raises(ps.SimulationError, match=r"in substep [34] of 5, by t = 0.2[68]") as caught:
        sim.step()
    for part in ("must stay finite", "particle 1 in world 0", "look at ParticleForce", "inf"):
        assert part in str(caught.value)
    np.testing.assert_array_equal(sim.position, good)
    (incident,) = sim.incidents
    assert (incident.kind, incident.part, incident.action) == (
        "not finite",
        "ParticleForce",
        "stop",
    )
    # The clock of the force is past 0.25 first at t = 0.26: in substep 4, or at the end of 3.
    assert incident.substep == (4 if method == "symplectic_euler" else 3)
    assert incident.time == pytest.approx(0.2 + 0.02 * incident.substep)


def test_of_fused_forces_the_one_is_named(device):
    scene = drifting(count=4)
    for name, strength in (("gentle", 1.0), ("broken", 1e38)):  # the class says who it is
        scene.add_interaction(
            type(name, (ps.PairForce,), {})(anchor, cutoff=1.5, stiffness=strength)
        )
    sim = ps.Simulation(scene, ps.Settings(dt=10.0, substeps=1), device=device)
    assert len(sim.loop.passes) == 1
    with pytest.raises(ps.SimulationError, match="look at broken, which did it"):
        sim.step()


def test_a_spring_past_its_limit_is_a_runaway(precision, device):
    # omega dt = 2.5: the amplitude grows by the larger root of z^2 + (6.25 - 2) z + 1, 4.0 a
    # substep, so to 4^4 in a frame of four, from the start's own.
    sim = ps.Simulation(
        oscillator(2.5), ps.Settings(dt=4.0, substeps=4, precision=precision), device=device
    )
    with pytest.raises(ps.SimulationError, match="must have a cause that finer") as caught:
        sim.step()
    assert "of particle 1 in world 0" in str(caught.value)
    assert "look at Springs, which did it" in str(caught.value)
    assert sim.incidents[0].kind == "runaway"
    np.testing.assert_array_equal(sim.position[1], (1, 0, 0))


def test_a_constraint_is_named(device):
    # A rod of 1000 that starts as 1: the correction within one substep makes the velocity, twice
    # as much with half the substep.
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0), (1, 0, 0)])
    scene.add_interaction(ps.UniformGravity())
    scene.add_constraint(ps.Distance([(0, 1)], 1000.0))
    sim = ps.Simulation(scene, ps.Settings(dt=0.1, substeps=1), device=device)
    with pytest.raises(ps.SimulationError, match="look at Distance, which did it in substep 1"):
        sim.step()


def test_who_leaves_the_bounds_is_named(device):
    scene = drifting(bounds=((None, -1, None), (None, 0.55, math.inf)))
    scene.add_particles([(0, 0, 0)], velocity=(5, -0.5, 0))
    sim = ps.Simulation(scene, ps.Settings(dt=0.1), device=device)
    quietly(sim, 5)
    with pytest.raises(ps.SimulationError, match="must stay within the bounds") as caught:
        sim.step()
    assert "of particle 0 in world 0 between t = 0.5 and 0.6" in str(caught.value)
    assert "-inf" in str(caught.value) or "-1." in str(caught.value)
    assert sim.incidents[0].kind == "escaped"
    # v = 1: y is past 0.55 with the sixth of ten substeps of 0.01.
    assert sim.incidents[0].substep == 6
    sim.velocity = 0.0
    quietly(sim, 3)


def test_bounds_are_checked(refused):
    with refused("Scene: bounds must be .lower, upper., three each"):
        ps.Scene(bounds=((0, 0), (1, 1)))
    with refused("Scene: bounds must have their upper corner above"):
        ps.Scene(bounds=((0, 0, 0), (1, -1, 1)))
    with refused("Scene: bounds upper.* must be finite"):
        ps.Scene(bounds=((0, 0, 0), (1, np.nan, 1)))
    with refused("Scene: bounds must hold all particles at the start, got 'particle 2 of scene 0"):
        ps.Simulation(drifting(bounds=((0, 0, 0), (1.5, 1, 1))), device="cpu")


def test_nobody_leaves_a_periodic_box(device):
    scene = ps.Scene(periodic=((0, None, 0), (1, None, 1)))
    scene.add_particles([(0.5, 0.5, 0.5)], velocity=(30, 0, 30))
    sim = ps.Simulation(scene, ps.Settings(dt=0.1), device=device)
    sim.run(20)
    assert sim.incidents == []


def test_positions_that_resolve_nothing(device):
    # Radius 0.01: in float32 one bit is as much at 0.01 / eps = 84 000; v = 1e5 arrives there
    # within a frame of one second. In float64 there is a long way to go.
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0)], velocity=(1e5, 0, 0), radius=0.01)
    sim = ps.Simulation(scene, ps.Settings(dt=1.0), device=device)
    with pytest.raises(ps.SimulationError, match="what its numbers resolve"):
        sim.step()
    finer = ps.Settings(dt=1.0, precision="float64")
    quietly(ps.Simulation(scene, finer, device=device), 3)


def test_a_watchdog_that_is_off_looks_at_nothing(device):
    scene = drifting(ps.ParticleForce(spoiled, when=-1.0, push=1e15))
    sim = ps.Simulation(scene, ps.Settings(watchdog=False), device=device)
    assert not list(sim.executor.frame.after.launches())
    sim.step()
    assert not np.isfinite(sim.position).all()
    on = ps.Simulation(scene, device=device)
    (look,) = on.executor.frame.after.launches()  # one launch a frame, whatever there is
    assert look.owner == "watchdog"


def test_a_run_that_stops_leaves_its_last_good_frame(device, tmp_path):
    scene = drifting(ps.ParticleForce(spoiled, [1], when=0.35, push=1e15))
    sim = ps.Simulation(scene, ps.Settings(dt=0.1), device=device)
    out = tmp_path / "run.npz"
    with pytest.raises(ps.SimulationError, match=r"between t = 0.3 and 0.4"):
        sim.run(10, record=out, checkpoint=1000)
    assert sim.frame == 3
    assert out.exists()
    saved = ps.Simulation.load(checkpoint_path(out), scene, device=device)
    assert saved.frame == 3
    same(saved, sim)


# What has a cause -------------------------------------------------------------------------------


def falling():
    """From rest, to 10 m/s, across 50 extents, in a frame of a second."""
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0), (0.1, 0, 0)])
    scene.add_interaction(ps.UniformGravity((0, -10, 0)))
    return scene, ps.Settings(dt=1.0)


def let_go():
    """A stiff spring, omega dt = 0.2, from rest: dt is 1.6 of its periods."""
    return oscillator(100.0), ps.Settings(dt=0.1, substeps=50)


def comet():
    """From aphelion of an orbit of eccentricity 0.98 past its perihelion, ten times as fast."""
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0)], mass=1.0, pinned=True)
    scene.add_particles([(1.98, 0, 0)], velocity=(0, math.sqrt(0.02 / 1.98), 0), mass=1e-9)
    scene.add_interaction(ps.Gravity(G=1.0))
    return scene, ps.Settings(
        dt=3.15, substeps=8000, integrator="velocity_verlet", precision="float64"
    )


def bounced():
    """Balls that hit a floor and each other at 100 extents a frame."""
    scene = ps.Scene()
    scene.add_particles([(0, 1, 0), (0, 1.5, 0)], velocity=(0, -3, 0), radius=0.1)
    scene.add_interaction(ps.UniformGravity((0, -10, 0)))
    scene.add_constraint(ps.Contact(restitution=0.8))
    scene.add_constraint(ps.PlaneBoundary((0, 0, 0), (0, 1, 0), restitution=0.8))
    return scene, ps.Settings(dt=0.1, substeps=40)


@pytest.mark.parametrize("build", [falling, let_go, comet, bounced])
def test_energy_that_has_a_cause_is_no_runaway(build, device, alarms):
    # With the limits so tight that every frame in which something gets faster is audited.
    scene, settings = build()
    sim = ps.Simulation(scene, settings.replace(energy_growth=1.0001), device=device)
    sim.watchdog.limits.scales["extent"][:] = 1e-12
    sim.watchdog.limits._write()
    twin = ps.Simulation(scene, settings.replace(watchdog=False), device=device)
    for _ in range(3):
        sim.step()
        twin.step()
    assert alarms and sim.incidents == []
    same(sim, twin)  # an audit leaves no trace


def test_a_velocity_that_is_given_is_no_runaway(device, alarms):
    sim = ps.Simulation(drifting(), ps.Settings(dt=0.1), device=device)
    sim.velocity = (0, 1e6, 0)
    quietly(sim, 2)
    sim.position = sim.position + 1e9
    quietly(sim, 2)
    sim.world(0).velocity = (1e9, 0, 0)
    quietly(sim, 2)
    assert not alarms


def test_a_coarse_explosion_is_not_excused_by_a_finer_one(precision, device):
    # omega dt = 5.4 multiplies K as much in one substep as 2.7 does in two: four times as many
    # tell them apart. (And 40, past the limit at all of them, by far.)
    for omega in (5.4, 40.0):
        sim = ps.Simulation(
            oscillator(omega, 1e-3), ps.Settings(dt=3.0, substeps=3, precision=precision),
            device=device,
        )  # fmt: skip
        with pytest.raises(ps.SimulationError, match="must have a cause that finer"):
            quietly(sim, 3)


# Retry ------------------------------------------------------------------------------------------


def test_a_frame_is_done_again_with_more_substeps(precision, device):
    # omega dt = 4 is past the limit and 2 is at it; 1, of four times the substeps, is not.
    settings = ps.Settings(dt=4.0, substeps=4, precision=precision, on_failure="retry")
    sim = ps.Simulation(oscillator(4.0), settings, device=device)
    with pytest.warns(ps.SimulationWarning, match="the frame was done again with 16 substeps"):
        sim.step()
    (incident,) = sim.incidents
    assert (incident.kind, incident.action, incident.substeps) == ("runaway", "retry", 16)
    finer = ps.Simulation(oscillator(4.0), settings.replace(substeps=16), device=device)
    finer.step()
    same(sim, finer)
    assert sim.time == 4.0


def test_what_no_substep_helps_is_given_up(device):
    sim = ps.Simulation(
        drifting(ps.ParticleForce(spoiled, [1], when=0.15, push=1e15)),
        ps.Settings(dt=0.1, on_failure="retry", retries=2), device=device,
    )  # fmt: skip
    sim.step()
    good = sim.position
    with pytest.raises(ps.SimulationError, match="even 40 substeps do not help"):
        sim.step()
    np.testing.assert_array_equal(sim.position, good)
    assert sim.frame == 1


def worlds_of_springs(stiff):
    """Three worlds with a rod that may break, the middle one as stiff as asked for."""

    def build(omega):
        scene = oscillator(omega)
        scene.add_particles([(3, 0, 0), (4, 0, 0)], velocity=[(0, 0, 0), (0, 0.1, 0)])
        scene.add_constraint(ps.Distance([(2, 3)], compliance=1e-3, break_force=1e3))
        return scene

    return [build(1.0), build(stiff), build(0.5)]


def test_only_the_world_that_needs_it_is_done_again(precision, device):
    settings = ps.Settings(dt=2.0, substeps=4, precision=precision, on_failure="retry")
    sim = ps.Simulation(worlds_of_springs(8.0), settings, device=device)
    twin = ps.Simulation(worlds_of_springs(1.0), settings, device=device)
    alone = ps.Simulation(worlds_of_springs(8.0)[1], settings, device=device)
    quietly(sim, 1)
    quietly(alone, 1)
    (incident,) = sim.incidents
    assert incident.world == 1 and incident.substeps == alone.incidents[0].substeps
    twin.step()
    same(sim.world(1), alone)
    # Each reads the force of its own last substep: lam is per dt^2, and dt is four times smaller.
    rods, own = sim.constraints[0], alone.constraints[0]
    np.testing.assert_allclose(rods.force[1], own.force[0], rtol=1e-6)
    for w in (0, 2):
        same(sim.world(w), twin.world(w))
        assert rods.force[w] == twin.constraints[0].force[w]


# Freeze and reset -------------------------------------------------------------------------------

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
        monkeypatch.setattr(verlet, "DIRECT_CPU", 8)
        monkeypatch.setattr(verlet, "DIRECT_CUDA", 8)
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


# False alarms -----------------------------------------------------------------------------------

SMALL = {
    "dam_break": {"spacing": 0.05},
    "star_collision": {"count": 150},
    "freezing": {"cells": 5},
    "gas_in_a_box": {"count": 400},
    "pile": {"count": 100},
}


@pytest.mark.parametrize("name", ["dam_break", "star_collision", "gas_in_a_box", "triple_pendulum",
                                  "three_body", "pile", "chain", "spring_lattice"])  # fmt: skip
def test_ready_scenes_raise_no_alarm(name, device, alarms):
    from particlesim.commands.scene_files import load_scene

    module = load_scene(name)
    sim = ps.Simulation(module.build(**SMALL.get(name, {})), module.settings, device=device)
    for _ in range(12):
        sim.step()
    assert not alarms


def test_an_audit_costs_three_refinements(device, monkeypatch):
    done = []
    peaks = Frames.peaks
    monkeypatch.setattr(
        Frames, "peaks",
        lambda self, substeps: done.append(substeps) or peaks(self, substeps),
    )  # fmt: skip
    scene, settings = falling()
    sim = ps.Simulation(scene, settings.replace(energy_growth=1.5), device=device)
    quietly(sim, 3)
    assert sim.incidents == []
    assert done[:3] == [settings.substeps * each for each in audit.REFINEMENTS]


def test_knobs_are_checked(refused):
    for knob, wrong in (
        ("watchdog", 1), ("on_failure", "ignore"), ("retries", 0), ("energy_growth", 1.0),
        ("ledger", None),
    ):  # fmt: skip
        with refused(f"Settings: {knob} must"):
            ps.Settings(**{knob: wrong})
