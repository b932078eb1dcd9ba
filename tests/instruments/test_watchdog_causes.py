"""The watchdog: energies that have a cause, and frames done again."""

import math

import numpy as np
import pytest

import particlesim as ps
from cases.watchdog import drifting, falling, oscillator, quietly, same, spoiled


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
