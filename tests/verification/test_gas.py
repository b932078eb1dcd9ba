"""Ideal gas, Maxwell-Boltzmann speeds, and the stability of an oscillator."""

import numpy as np
import pytest
import warp as wp

import particlesim as ps


def test_pressure_of_an_ideal_gas(precision, device):
    # P = N k T / V, from the momentum that crosses a plane of a periodic box: m |v_x| each time,
    # over area and time.
    n, side, temperature, mass, time = 4000, 2.0, 3.0, 0.5, 40.0
    v = ps.sample.maxwell_boltzmann(n, temperature, mass, seed=1)
    scene = ps.Scene(periodic=((0, 0, 0), (side,) * 3))
    scene.add_particles(np.random.default_rng(0).uniform(0, side, (n, 3)), velocity=v, mass=mass)
    settings = ps.Settings(dt=time / 4, substeps=100, precision=precision)
    sim = ps.Simulation(scene, settings, device=device)
    sim.run(4)
    crossings = np.abs(sim.get("image"))
    pressure = (mass * np.abs(sim.velocity) * crossings).sum(axis=0) / (side**2 * time)
    # A particle crosses |v| t / L = 30 times in the mean, rounded up or down at random: together
    # to 0.5 / 30 / sqrt(n) = 3e-4. The speeds are a sample: a sum of n v^2 scatters by sqrt(2 / n).
    expected = n * temperature / side**3
    np.testing.assert_allclose(pressure, mass * (v**2).sum(axis=0) / side**3, rtol=2e-3)
    np.testing.assert_allclose(pressure, expected, rtol=4 * np.sqrt(2 / n))


@ps.law
def wall(position: wp.vec3, stiffness: float, half: float):
    beyond = wp.vec3(0.0, 0.0, 0.0)
    for a in range(3):
        beyond[a] = wp.max(wp.abs(position[a]) - half, 0.0) * wp.sign(position[a])
    return -stiffness * beyond


def test_pressure_on_walls(device):
    # Stiff springs for walls: the mean force on them is P A. By the virial theorem the same holds
    # for any wall, with the volume that the gas really takes: 2 x half and the depth of a bounce.
    n, half, temperature, k = 2000, 1.0, 1.0, 1e4
    v = ps.sample.maxwell_boltzmann(n, temperature, 1.0, seed=2)
    scene = ps.Scene()
    scene.add_particles(np.random.default_rng(3).uniform(-half, half, (n, 3)), velocity=v)
    scene.add_interaction(ps.ParticleForce(wall, stiffness=k, half=half))
    settings = ps.Settings(dt=0.02, substeps=20, integrator="velocity_verlet")
    sim = ps.Simulation(scene, settings, device=device)
    frames = []
    for _ in range(400):
        sim.step()
        frames.append(np.abs(sim.get("force")).sum(axis=0))
    force = np.mean(frames, axis=0)  # on both walls of an axis
    # Along an axis a particle of speed c goes back and forth in 4 half / c, and spends half a
    # swing, pi / omega, in each wall: F = 4 m c / (4 half / c + 2 pi / omega).
    c, omega = np.abs(v), np.sqrt(k)
    exact = (4 * c / (4 * half / c + 2 * np.pi / omega)).sum(axis=0)
    # In 8 time units a particle makes some 4 bounces, each caught by the frames (every 0.02, a
    # bounce takes 0.03) to about its own size: 1 / sqrt(4 n) = 1.1 %; four times that.
    np.testing.assert_allclose(force, exact, rtol=4 / np.sqrt(4 * n))
    # P = F / A = N k T / V, the sample's temperature scattering by sqrt(2 / n), and the walls
    # giving way by pi c / (2 omega) / half = 1.6 %.
    pressure = force / (2 * (2 * half) ** 2)
    ideal = n * temperature / (2 * half) ** 3
    np.testing.assert_allclose(pressure, ideal, rtol=4 * np.sqrt(2 / n) + 0.02)


@ps.law
def sphere(r: float, stiffness: float, cutoff: float):
    overlap = wp.max(cutoff - r, 0.0)
    return 0.5 * stiffness * overlap * overlap


def test_collisions_make_maxwell_boltzmann_speeds(precision, device):
    # All start with the same speed: the kurtosis of a component is 9/5. Soft spheres of diameter
    # 0.4 at a density of 2 collide every 1 / (sqrt(2) pi 0.4^2 2) = 0.7 time units.
    n, side = 2000, 10.0
    direction = np.random.default_rng(0).normal(size=(n, 3))
    scene = ps.Scene(periodic=((0, 0, 0), (side,) * 3))
    scene.add_particles(
        ps.sample.random((0, 0, 0), (side,) * 3, n, seed=1, minimum_distance=0.4),
        velocity=direction / np.linalg.norm(direction, axis=1)[:, None],
    )
    scene.add_interaction(ps.PairPotential(sphere, cutoff=0.4, stiffness=1000.0))
    settings = ps.Settings(dt=0.5, substeps=100, integrator="velocity_verlet", precision=precision)
    sim = ps.Simulation(scene, settings, device=device)

    def kurtosis(v):
        return (v**4).mean() / (v**2).mean() ** 2

    start = sim.diagnostics()
    # Isotropic directions of one speed, to sampling: 9/5.
    assert kurtosis(sim.velocity) == pytest.approx(9 / 5, abs=0.05)
    sim.run(16)
    # Samples a collision time and more apart, taken as six independent ones of 3 n components:
    # the kurtosis of a normal sample scatters by sqrt(24 / n), its mean speed by 0.42 / sqrt(n).
    found, speeds = [], []
    for _ in range(6):
        sim.run(3)
        v = sim.velocity.astype(float)
        temperature = (v**2).mean()
        found.append(kurtosis(v))
        speeds.append(np.linalg.norm(v, axis=1).mean() / np.sqrt(8 * temperature / np.pi))
    assert np.mean(found) == pytest.approx(3, abs=4 * np.sqrt(24 / (6 * 3 * n)))
    assert np.mean(speeds) == pytest.approx(1, abs=4 * 0.42 / np.sqrt(6 * n))
    # Leapfrog at omega dt = sqrt(2 k) 0.005 = 0.22, squared, over 8 of the energy in contacts,
    # which is a tenth of all.
    after = sim.diagnostics()
    assert after.energy[0] == pytest.approx(start.energy[0], rel=0.22**2 / 8)


@ps.law
def spring(position: wp.vec3, omega: float):
    return -omega * omega * position


@pytest.mark.parametrize("method", ["velocity_verlet", "symplectic_euler"])
def test_oscillator_is_stable_up_to_omega_dt_of_two(method, precision, device):
    def swing(z, steps):
        scene = ps.Scene()
        scene.add_particles([(1, 0, 0)])
        scene.add_interaction(ps.ParticleForce(spring, omega=z))
        # The watchdog would stop what is to be seen here.
        settings = ps.Settings(
            dt=1.0, substeps=1, integrator=method, precision=precision, watchdog=False
        )
        sim = ps.Simulation(scene, settings, device=device)
        largest = 0.0
        for _ in range(steps):
            sim.step()
            largest = max(largest, abs(float(sim.position[0, 0])))
        return largest

    # Below 2 leapfrog conserves v^2 + (1 - z^2/4) x^2 z^2 (Verlet), so x stays under
    # 1 / sqrt(1 - z^2 / 4) = 10.0; symplectic Euler's ellipse, x^2 z^2 + v^2 - z^2 x v, reaches as
    # far from a start at rest. Round-off grows the orbit by an eps a step at most.
    bound = 1 / np.sqrt(1 - 1.99**2 / 4)
    assert swing(1.99, 3000) <= bound * (1 + 3000 * 10 * np.finfo(precision).eps)
    # Above, x grows by z^2/2 - 1 + sqrt((z^2/2 - 1)^2 - 1) a step: at least 1.22^80 / 4.
    growth = 2.01**2 / 2 - 1
    growth += np.sqrt(growth**2 - 1)
    assert swing(2.01, 80) > growth**80 / 4
