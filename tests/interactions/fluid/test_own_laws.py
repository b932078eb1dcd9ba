"""An equation of state and a viscosity of one's own, written against public names only."""

import numpy as np
import pytest
import warp as wp

import particlesim as ps


@ps.law
def isothermal_pressure(density: float, sound_speed: float):
    return sound_speed * sound_speed * density


@ps.law
def isothermal_energy(density: float, rest_density: float, sound_speed: float):
    return sound_speed * sound_speed * wp.log(density / rest_density)


@ps.law
def isothermal_sound_speed(sound_speed: float):
    return sound_speed


class Isothermal(ps.EquationOfState):
    """An ideal gas at constant temperature, P = c^2 rho."""

    pressure, energy = isothermal_pressure, isothermal_energy
    sound_speed = isothermal_sound_speed

    def __init__(self, speed):
        self.parameters = {"sound_speed": speed}


@ps.law
def linear_term(
    approach: float, distance_squared: float, smoothing_length: float, density: float, nu: float
):
    h2 = smoothing_length * smoothing_length
    return -8.0 * nu * approach / ((distance_squared + 0.01 * h2) * density)


class Linear(ps.Viscosity):
    """A kinematic viscosity nu in two dimensions, whether pairs approach or recede."""

    term = linear_term

    def __init__(self, nu):
        self.parameters = {"nu": nu}


def test_pressure_and_energy_of_a_gas(cloud, fluid, prepared, precision, device):
    x, v, m = cloud(60)
    gas = {"equation_of_state": Isothermal(4.0), "viscosity": Linear(0.3)}
    sim = prepared(fluid(x, v, m, **gas), precision, device)
    density, eps = sim.get("density"), np.finfo(precision).eps
    np.testing.assert_allclose(sim.get("pressure"), 16 * density, rtol=4 * eps)
    expected = (m * 16 * np.log(density)).sum()
    # The logarithm near density 1 is right to an eps of 1; masses are below 0.8.
    np.testing.assert_allclose(sim.diagnostics().potential, expected, atol=60 * 16 * 4 * eps)
    force = sim.get("force")
    assert np.abs(force.sum(axis=0)).max() < 60 * eps * np.abs(force).max()


def test_force_is_the_gradient_of_the_energy(cloud, fluid, prepared):
    x, _, m = cloud(60)
    sim = prepared(fluid(0.4 * x, m=m, equation_of_state=Isothermal(4.0)))
    force, step = sim.get("force"), 1e-5
    for particle, axis in [(0, 0), (7, 1), (33, 2)]:
        energies = []
        for side in (step, -step):
            moved = 0.4 * x
            moved[particle, axis] += side
            sim.position = moved
            energies.append(sim.diagnostics().potential[0])
        derived = -(energies[0] - energies[1]) / (2 * step)
        # Central difference: step^2 / 6 (7 / h)^2 of the force is 2e-9 of it; round-off is 1e-8.
        assert force[particle, axis] == pytest.approx(derived, abs=1e-7 * np.abs(force).max())


def frequency(signal, dt):
    """Of a harmonic sampled at equal times: x_(n-1) + x_(n+1) = 2 cos(omega dt) x_n."""
    middle, around = signal[1:-1], signal[:-2] + signal[2:]
    return np.arccos((middle @ around) / (2 * middle @ middle)) / dt


def test_sound_moves_at_its_speed():
    """A wave in a gas on a line swings at omega = c k, but for the dispersion of the sums.

    Those over W'' that belong to the pressure at rest are exact for a cubic spline whose h is two
    spacings, as it is piecewise linear; smoothing is left, which changes omega by (k h)^2 / 50.
    """
    count, c, k, amplitude = 80, 2.0, 2 * np.pi, 1e-4
    h = 2.0 / count
    x = np.zeros((count, 3))
    x[:, 0] = (np.arange(count) + 0.5) / count
    mode = np.sin(k * x[:, 0])
    scene = ps.Scene(periodic=((0, None, None), (1, None, None)))
    gas = scene.add_particles(x, velocity=amplitude * mode[:, None] * [1.0, 0, 0], mass=1 / count)
    scene.add_interaction(
        ps.SPH(gas, smoothing_length=h, rest_density=1.0, dimension=1, smoothing="cubic_spline",
               equation_of_state=Isothermal(c))
    )  # fmt: skip
    settings = ps.Settings(dt=0.01, substeps=20, precision="float64", integrator="velocity_verlet")
    sim, signal = ps.Simulation(scene, settings, device="cpu"), []
    for _ in range(100):  # two periods
        signal.append((sim.velocity[:, 0] * mode).mean())
        sim.step()
    assert frequency(np.array(signal), 0.01) == pytest.approx(c * k, rel=(k * h) ** 2 / 40)


def test_shear_decays_by_the_viscosity():
    """u = U sin(k y) decays at nu k^2 (see tests/verification/test_sph.py)."""
    count, c, u, nu = 24, 10.0, 0.1, 0.02
    spacing, k = 1 / count, 2 * np.pi
    x = ps.sample.box((0, 0, 0), (1, 1, 0), spacing, jitter=0.2)
    scene = ps.Scene(periodic=((0, 0, None), (1, 1, None)))
    shear = u * np.sin(k * x[:, 1:2]) * [1.0, 0, 0]
    gas = scene.add_particles(x, velocity=shear, mass=spacing**2)
    scene.add_interaction(
        ps.SPH(gas, smoothing_length=2.0 * spacing, rest_density=1.0, dimension=2,
               equation_of_state=ps.Tait(c, negative_pressure=True), viscosity=Linear(nu))
    )  # fmt: skip
    rate = nu * k**2
    sim = ps.Simulation(scene, ps.Settings(dt=0.05 / rate, substeps=64), device="cpu")
    signal = []
    for _ in range(17):
        signal.append((sim.velocity[:, 0] * np.sin(k * sim.position[:, 1])).mean())
        sim.step()
    found = -np.polyfit(0.05 / rate * np.arange(4, 17), np.log(signal[4:]), 1)[0]
    assert found == pytest.approx(rate, rel=0.1)


def test_a_law_that_is_missing(refused):
    class Half(ps.EquationOfState):
        pressure = isothermal_pressure
        parameters = {"sound_speed": 1.0}  # noqa: RUF012

    with refused("Half: laws must be pressure, energy, sound_speed, got no energy", TypeError):
        ps.SPH(smoothing_length=0.1, equation_of_state=Half())
