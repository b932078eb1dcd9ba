"""The watchdog: what it finds and whom it names."""

import math

import numpy as np
import pytest

import particlesim as ps
from cases.watchdog import drifting, oscillator, quietly, same, spoiled
from particlesim.simulation.resume import checkpoint_path


@ps.law
def anchor(r: float, stiffness: float):
    return 0.5 * stiffness * r * r


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
