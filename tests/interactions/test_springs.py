"""Springs: energy, damping, periodic boundaries, a known frequency."""

import numpy as np
import pytest

import particlesim as ps


def test_springs_hold_energy_and_virial(device, simulate):
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0), (3, 0, 0), (3, 4, 0)])
    scene.add_interaction(ps.Springs([(0, 1), (1, 2)], [2.0, 10.0], [1.0, 5.0]))
    measured = simulate(scene, device, precision="float64").diagnostics()
    assert measured.potential[0] == pytest.approx(0.5 * 2 * 2**2 + 0.5 * 10 * 1**2, rel=1e-14)
    # The sum of r.F over pairs: -k (r - L) r.
    assert measured.virial[0] == pytest.approx(-2 * 2 * 3 + 10 * 1 * 4, rel=1e-14)


def test_springs_are_at_rest_as_they_start(device, cluster, force_of):
    scene = cluster(20)
    scene.add_interaction(ps.Springs([(0, 1), (3, 17)], 100.0))
    assert np.abs(force_of(scene, "float64", device)).max() < 1e-12


def test_springs_across_a_periodic_boundary(precision, device, force_of):
    scene = ps.Scene(periodic=((0, None, None), (10, None, None)))
    scene.add_particles([(0.5, 0, 0), (9.0, 0, 0)])
    scene.add_interaction(ps.Springs([(0, 1)], 2.0))
    scene.add_interaction(ps.Springs([(0, 1)], 3.0, 1.0))
    # 1.5 apart by way of the boundary: the first is at rest, the second pulls by 3 (1.5 - 1).
    np.testing.assert_allclose(force_of(scene, precision, device)[:, 0], [-1.5, 1.5], rtol=1e-6)


def test_two_bodies_on_a_spring_swing_at_their_frequency(device, simulate):
    # omega = sqrt(k / mu); leapfrog swings at omega' with sin(omega' dt / 2) = omega dt / 2.
    m, k = (1.0, 3.0), 12.0
    omega = np.sqrt(k * (1 / m[0] + 1 / m[1]))
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0), (1.1, 0, 0)], mass=m)
    scene.add_interaction(ps.Springs([(0, 1)], k, 1.0))
    dt = 0.01
    sim = simulate(
        scene, device, dt=dt, substeps=1, precision="float64", integrator="velocity_verlet"
    )
    phase = 2 / dt * np.arcsin(omega * dt / 2)
    for step in range(1, 301):
        sim.step()
        if step % 50 == 0:
            stretch = np.linalg.norm(sim.position[1] - sim.position[0]) - 1.0
            # Right to the round-off of 300 steps.
            assert stretch == pytest.approx(0.1 * np.cos(phase * step * dt), abs=1e-12)


def test_damping_acts_along_the_spring_only(device, force_of):
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0), (2, 0, 0)], velocity=[(0, 0, 0), (3, 5, 7)])
    scene.add_interaction(ps.Springs([(0, 1)], 0.0, damping=0.5))
    np.testing.assert_allclose(
        force_of(scene, "float64", device), [(1.5, 0, 0), (-1.5, 0, 0)], rtol=1e-14
    )
