"""SPH against known answers: stars, sound, shear."""

import numpy as np
import pytest
import warp as wp

import particlesim as ps
from cases.stars import ball, disc
from particlesim.interactions.fluid.smoothing import SMOOTHING


@ps.law
def trap(position: wp.vec3, mass: float):
    return -mass * position


@ps.law
def trap_energy(position: wp.vec3, mass: float):
    return 0.5 * mass * wp.dot(position, position)


# Stars ----------------------------------------------------------------------------------------


AT_REST = 1e-7  # kinetic over potential energy, as phantom asks


def relaxed_polytrope(count):
    """A self-gravitating ball with P = K rho^2, M = R = G = 1, damped until it rests."""
    spacing = (4 * np.pi / 3 / count) ** (1 / 3)
    scene = ps.Scene()
    star = scene.add_particles(
        ps.sample.stretch(ball(count), (0, 0, 0), 1.0, np.sinc), mass=1 / count
    )
    scene.add_interaction(
        ps.SPH(star, smoothing_length=spacing, equation_of_state=ps.Polytrope(2 / np.pi, index=1.0))
    )
    scene.add_interaction(ps.Gravity(G=1.0, softening=0.3 * spacing))
    scene.add_interaction(ps.Drag(linear=4.0 / count))
    # The speed of sound is at most sqrt(2 K rho) = 1: dt = 0.3 h / c.
    settings = ps.Settings(
        dt=1.0, substeps=int(np.ceil(1 / (0.3 * spacing))), integrator="velocity_verlet"
    )
    sim = ps.Simulation(scene, settings, device="cpu")
    sim.run(100)
    while sim.diagnostics().kinetic[0] > 0.74 * AT_REST and sim.time < 400:
        sim.run(20)
    return sim, spacing


def energy_of(sim, k):
    """The energy of the k-th interaction."""
    energy = wp.zeros(sim.particle_count, dtype=wp.float64, device=sim.device)
    sim.interactions[k].measure(sim.state, energy, wp.zeros_like(energy))
    return energy.numpy().sum()


def check_polytrope(sim, spacing):
    """Central density pi/4, profile sin(xi)/xi, U = -3/4, internal energy 1/4, virial 0."""
    r = np.linalg.norm(sim.position - sim.position.mean(axis=0), axis=1)
    found = sim.diagnostics()
    density, exact = sim.get("density"), np.pi / 4 * np.sinc(r)
    inside = r < 0.8
    # phantom accepts 4 % at 1000 particles.
    assert np.sqrt(np.mean((density[inside] / exact[inside] - 1) ** 2)) < 0.04
    assert density[np.argmin(r)] == pytest.approx(np.pi / 4, rel=0.04)
    # Point masses lack the field of their own cell: U / N is raised by 0.9 m^2 / a, a the radius
    # of a cell (Wigner's, of the one-component plasma), that is by 0.9 (spacing / 1.6) in U, and a
    # little more by softening; W smooths the surface over h, to as much of the opposite sign.
    fluid, gravity = energy_of(sim, 0), energy_of(sim, 1)
    assert abs(gravity + 0.75) < 0.9 / len(r) / (0.62 * spacing) + 0.25 * spacing**2
    # Its own u = K rho is off by as much as the density: a little more than inside.
    assert fluid == pytest.approx(0.25, rel=0.06)
    assert found.potential[0] == pytest.approx(fluid + gravity, rel=1e-6)
    # At rest sum r.F = 0; what is left makes it move.
    assert abs(found.virial[0]) < 1e-3
    assert found.kinetic[0] / -gravity < AT_REST


def test_polytrope():
    check_polytrope(*relaxed_polytrope(1000))


@pytest.mark.slow
def test_polytrope_large():
    check_polytrope(*relaxed_polytrope(4000))


MASS = {1: 4 / 3, 2: np.pi / 2, 3: 8 * np.pi / 15}  # of the density 1 - r^2
VOLUME = {1: 2.0, 2: np.pi, 3: 4 * np.pi / 3}


def toy_star(dimension, count, dt, start=None):
    """P = rho^2 / 4 in a trap -r, at rest with rho = 1 - r^2; damped unless started from points.

    Returns the simulation and h, 1.6 spacings and in three dimensions one.
    """
    points = {1: lambda n: np.linspace(-1, 1, 2 * n + 1)[1::2, None] * [1.0, 0, 0],
              2: disc, 3: ball}[dimension](count)  # fmt: skip
    h = (1.0 if dimension == 3 else 1.6) * (VOLUME[dimension] / count) ** (1 / dimension)
    mass = MASS[dimension] / count
    scene = ps.Scene()
    x = start
    if start is None:
        x = ps.sample.stretch(points, (0, 0, 0), 1.0, lambda r: 1 - r**2, dimension)
    star = scene.add_particles(x, velocity=0.0 if start is None else 0.05 * x, mass=mass)
    scene.add_interaction(
        ps.SPH(star, smoothing_length=h, equation_of_state=ps.Polytrope(0.25, 1.0),
               dimension=dimension)
    )  # fmt: skip
    scene.add_interaction(ps.ParticleForce(trap, potential=trap_energy))
    if start is None:
        scene.add_interaction(ps.Drag(linear=2 * mass))
    settings = ps.Settings(
        dt=0.05, substeps=max(1, round(0.05 / dt)), precision="float64",
        integrator="velocity_verlet",
    )  # fmt: skip
    return ps.Simulation(scene, settings, device="cpu"), h


@pytest.mark.parametrize("dimension, count", [(1, 50), (2, 400), (3, 800)])
def test_toy_star(dimension, count):
    """At rest rho = 1 - r^2; it breathes at omega = sqrt(d (gamma - 1) + 2), gamma = 2."""
    sim, h = toy_star(dimension, count, 0.025)
    sim.run(400)
    r, density = np.linalg.norm(sim.position, axis=1), sim.get("density")
    # W averages over h, which moves the density by some (h / R)^2 of its curvature; in more than
    # one dimension the particles do not find their best order either, which phantom puts at 4 %.
    error = density[r < 0.8] / (1 - r[r < 0.8] ** 2) - 1
    assert np.sqrt(np.mean(error**2)) < h**2 + (0.01 if dimension > 1 else 0.001)
    sim, _ = toy_star(dimension, count, 0.025, start=sim.position)
    times = 0.05 * np.arange(400)
    inertia = np.zeros(400)
    for k in range(400):
        inertia[k] = (sim.position**2).sum()
        sim.step()
    exact = np.sqrt(dimension + 2)
    assert frequency(times, inertia, exact) == pytest.approx(exact, rel=2 * h**2)


def frequency(times, signal, near):
    """Angular frequency, within 10 % of ``near``, of the harmonic that fits best."""
    best = (np.inf, 0.0)
    for omega in near * np.linspace(0.9, 1.1, 801):
        columns = np.stack(
            [np.ones_like(times), np.cos(omega * times), np.sin(omega * times)], axis=1
        )
        residual = np.linalg.lstsq(columns, signal, rcond=None)[1][0]
        best = min(best, (residual, omega))
    return best[1]


def test_energy_is_conserved_to_second_order():
    """Halving the step quarters the error: the force is the gradient of the energy reported."""
    start = toy_star(2, 200, 0.05)[0].position
    errors = []
    for dt in (0.05, 0.025, 0.0125):
        sim, _ = toy_star(2, 200, dt, start)
        energies = []
        for _ in range(60):
            energies.append(sim.diagnostics().energy[0])
            sim.step()
        errors.append(np.ptp(energies) / abs(energies[0]))
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert np.all(np.abs(orders - 2) < 0.1)
    assert errors[-1] < 1e-4


# Waves ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("name, ratio", [("cubic_spline", 1.2), ("wendland_c2", 1.6)])
def test_sound_wave(name, ratio):
    """A wave in one dimension moves at c, but for the dispersion of the sums.

    Around a lattice at its rest density, where P = 0, linearising gives
    omega = c / rho0 sum_j m |W'(x_j)| sin(k |x_j|), which goes to c k with h.
    """
    count, amplitude, k = 40, 1e-4, 2 * np.pi
    spacing = 1 / count
    h = ratio * spacing
    away = spacing * np.arange(1, 5)
    q, sigma, e = away / h, SMOOTHING[name].in_dimension(1).sigma / h, 1e-6

    def w(q):
        if name == "cubic_spline":
            return np.maximum(2 - q, 0) ** 3 / 4 - np.maximum(1 - q, 0) ** 3
        return np.maximum(1 - q / 2, 0) ** 3 * (1 + 1.5 * q)

    mass = 1 / (sigma * (w(0.0) + 2 * w(q).sum()))
    slope = sigma / h * (w(q - e) - w(q + e)) / (2 * e)
    expected = 2 * mass * (slope * np.sin(k * away)).sum()
    assert expected == pytest.approx(k, rel=0.04)  # of the medium itself, (k h)^2 / 2 off

    x = np.zeros((count, 3))
    x[:, 0] = spacing * (np.arange(count) + 0.5)
    mode = np.sin(k * x[:, 0])
    scene = ps.Scene(periodic=((0, None, None), (1, None, None)))
    gas = scene.add_particles(x, velocity=amplitude * mode[:, None] * [1.0, 0, 0], mass=mass)
    scene.add_interaction(
        ps.SPH(gas, smoothing_length=h, rest_density=1.0, smoothing=name, dimension=1,
               equation_of_state=ps.Tait(1.0, negative_pressure=True))
    )  # fmt: skip
    settings = ps.Settings(dt=0.01, substeps=5, precision="float64", integrator="velocity_verlet")
    sim = ps.Simulation(scene, settings, device="cpu")
    signal = []
    for _ in range(200):  # two periods
        signal.append((sim.velocity[:, 0] * mode).mean())
        sim.step()
    # The steps of the fit, 2.5e-4, and the amplitude's own effect, amplitude * gamma.
    found = frequency(0.01 * np.arange(200), np.array(signal), expected)
    assert found == pytest.approx(expected, rel=1e-3)


def test_shear_decays_by_the_viscosity():
    """u = U sin(k y) decays at nu k^2, nu = alpha c h / (4 (d + 2)).

    The formula is an integral over a continuum in which half of the neighbours approach; the
    jitter of the particles, and the noise that the decay stirs up, change it by some percent.
    """
    count, alpha, c, u = 24, 0.5, 10.0, 0.1
    spacing, k = 1 / count, 2 * np.pi
    h = 1.6 * spacing
    x = ps.sample.box((0, 0, 0), (1, 1, 0), spacing, jitter=0.2)
    scene = ps.Scene(periodic=((0, 0, None), (1, 1, None)))
    gas = scene.add_particles(
        x, velocity=u * np.sin(k * x[:, 1:2]) * [1.0, 0, 0], mass=spacing**2
    )  # fmt: skip
    scene.add_interaction(
        ps.SPH(gas, smoothing_length=h, rest_density=1.0, dimension=2,
               equation_of_state=ps.Tait(c, negative_pressure=True),
               viscosity=ps.ArtificialViscosity(alpha))
    )  # fmt: skip
    rate = alpha * c * h / 16 * k**2
    dt = 0.3 * h / (c * (1 + 0.6 * alpha))
    settings = ps.Settings(dt=0.05 / rate, substeps=int(np.ceil(0.05 / rate / dt)))
    sim = ps.Simulation(scene, settings, device="cpu")
    signal = []
    for _ in range(17):
        signal.append((sim.velocity[:, 0] * np.sin(k * sim.position[:, 1])).mean())
        sim.step()
    times = 0.05 / rate * np.arange(4, 17)  # once the lattice has let go of its jitter
    found = -np.polyfit(times, np.log(signal[4:]), 1)[0]
    assert found == pytest.approx(rate, rel=0.1)
