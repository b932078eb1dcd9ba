"""Gases with heat in vessels: pressures on walls, adiabats of pistons, shocks and their echoes."""

import numpy as np
import pytest

import particlesim as ps

pytestmark = pytest.mark.slow
GAMMA = 1.4
NORMAL = np.array([1.0, 0.0, 0.0])


def pressure(sim, *walls):
    """On walls of area 1, each."""
    return np.array([np.linalg.norm(sim.force(wall)) for wall in walls])


def on_sides(sim):
    """Pressures on the six sides of the unit box that is the one constraint."""
    sim.get("force")
    rows, force = sim.interactions[0].presses(sim.constraints[0])
    low = sim.position[rows] < 0.5
    return np.abs([(force * low).sum(axis=0), (force * ~low).sum(axis=0)])


def test_a_gas_in_a_closed_box_presses_on_all_sides():
    """p = (gamma - 1) rho u, also after its motion has become heat; its energy stays."""
    count = 12
    x = ps.sample.box((0, 0, 0), (1, 1, 1), 1 / count)
    random = np.random.default_rng(2)
    v = 0.2 * random.normal(size=x.shape)
    scene = ps.Scene()
    gas = scene.add_particles(
        x, velocity=v - v.mean(axis=0), mass=count**-3, radius=1e-6, internal_energy=1.0
    )
    scene.add_interaction(
        ps.SPH(gas, smoothing_length=2.0 / count, equation_of_state=ps.IdealGas(GAMMA),
               viscosity=ps.ArtificialViscosity(1.0, 2.0))
    )  # fmt: skip
    scene.add_constraint(ps.BoxBoundary((0, 0, 0), (1, 1, 1)))
    sim = ps.Simulation(scene, ps.Settings(dt=0.05, substeps=10, precision="float64"), device="cpu")
    start = sim.diagnostics()
    found = []
    for frame in range(60):
        sim.step()
        if frame >= 40:
            found.append(on_sides(sim))
    end = sim.diagnostics()
    assert end.kinetic[0] < 0.1 * start.kinetic[0]
    # To round-off but for the few that reach a wall itself, which stops them: a particle has 1/1728
    # of the gas's kinetic energy, which is 1 % of the whole when the first one does, a third of
    # that across the wall: 2e-6 each.
    assert end.energy[0] == pytest.approx(start.energy[0], rel=1e-4)
    expected = (GAMMA - 1) * (end.energy[0] - end.kinetic[0])
    np.testing.assert_allclose(np.mean(found, axis=0), expected, rtol=0.02)


def test_a_slow_piston_compresses_along_an_adiabat():
    """P V^gamma stays, and what the piston spends is what the gas gains.

    The gas starts with the motion of one that is compressed evenly, so that there is no sound.
    """
    count = 24
    spacing = 1 / count
    width = 8 * spacing
    scene = ps.Scene(periodic=((None, 0, None), (None, width, None)))
    x = ps.sample.box((0, 0, 0), (1, width, 0), spacing)
    speed, frames = 0.02, 15
    gas = scene.add_particles(
        x, velocity=-speed * x * NORMAL, mass=spacing**2, radius=1e-6, internal_energy=2.0
    )
    scene.add_interaction(
        ps.SPH(gas, smoothing_length=1.6 * spacing, dimension=2,
               equation_of_state=ps.IdealGas(GAMMA), viscosity=ps.ArtificialViscosity(0.2))
    )  # fmt: skip
    scene.add_constraint(ps.PlaneBoundary((0, 0, 0), (1, 0, 0)))
    piston = scene.add_constraint(ps.PlaneBoundary((1, 0, 0), (-1, 0, 0), velocity=(-speed, 0, 0)))
    settings = ps.Settings(dt=1.0, substeps=400, precision="float64")
    sim = ps.Simulation(scene, settings, device="cpu")
    energy = sim.diagnostics().energy[0]
    before, work = sim.force(piston)[0], 0.0
    constant = before / width
    assert constant == pytest.approx((GAMMA - 1) * 2.0, rel=0.01)
    for _ in range(frames):
        sim.step()
        now = sim.force(piston)[0]
        work += 0.5 * (before + now) * speed * settings.dt
        before = now
        s = 1 / (1 - speed * sim.time)
        # W smooths the density of a lattice by some 1e-3, the more the flatter that is.
        assert now / width == pytest.approx(constant * s**GAMMA, rel=0.01)
    # Trapezes of some 2 % of the work.
    assert work == pytest.approx(sim.diagnostics().energy[0] - energy, rel=0.01)


def test_a_shock_before_a_piston_and_from_the_end_of_its_tube():
    """Rankine and Hugoniot at Mach 2: 4.5 times the pressure, and 15 at its echo."""
    count, mach, c = 200, 2.0, 1.0
    speed = 2 / (GAMMA + 1) * (mach - 1 / mach) * c
    scene = ps.Scene()
    x = (np.arange(count) + 0.5)[:, None] / count * NORMAL
    p = c * c / GAMMA
    gas = scene.add_particles(
        x, mass=1 / count, radius=1e-9, internal_energy=p / (GAMMA - 1)
    )  # rho = 1
    scene.add_interaction(
        ps.SPH(gas, smoothing_length=2 / count, dimension=1, equation_of_state=ps.IdealGas(GAMMA),
               viscosity=ps.ArtificialViscosity(1.0, 2.0))
    )  # fmt: skip
    piston = scene.add_constraint(ps.PlaneBoundary((0, 0, 0), (1, 0, 0), velocity=(speed, 0, 0)))
    end = scene.add_constraint(ps.PlaneBoundary((1, 0, 0), (-1, 0, 0)))
    settings = ps.Settings(dt=0.01, substeps=40, precision="float64")
    sim = ps.Simulation(scene, settings, device="cpu")
    start = sim.diagnostics().energy[0]
    assert pressure(sim, end)[0] == pytest.approx(p, rel=0.01)
    found = []
    for _ in range(58):
        sim.step()
        found.append(pressure(sim, piston, end) / p)
    on_piston, on_end = np.transpose(found)
    # The shock is at the end at t = 0.5, and its reflection at the piston at 0.62.
    assert np.mean(on_piston[20:45]) == pytest.approx(4.5, rel=0.03)
    assert np.mean(on_end[54:]) == pytest.approx(15.0, rel=0.03)
    rho = sim.get("density")
    fresh = (sim.position[:, 0] > 0.76) & (sim.position[:, 0] < 0.84)  # behind the first alone
    assert rho[fresh].mean() == pytest.approx(8 / 3, rel=0.03)
    work = 4.5 * p * speed * sim.time
    assert sim.diagnostics().energy[0] - start == pytest.approx(work, rel=0.01)


def test_a_wall_that_drags_a_gas_along_heats_it():
    """Couette: nu rho V^2 / d an area and a time, which is the work of the wall that moves."""
    count, speed, nu, time = 12, 0.3, 0.1, 0.4
    spacing = 1 / count
    width = 8 * spacing
    scene = ps.Scene(periodic=((0, None, None), (width, None, None)))
    x = ps.sample.box((0, 0, 0), (width, 1, 0), spacing)
    gas = scene.add_particles(
        x, velocity=speed * x[:, 1:2] * NORMAL, mass=spacing**2, radius=1e-6, internal_energy=2.0
    )
    scene.add_interaction(
        ps.SPH(gas, smoothing_length=2 * spacing, dimension=2, viscosity=ps.LaminarViscosity(nu),
               equation_of_state=ps.IdealGas(GAMMA))
    )  # fmt: skip
    scene.add_constraint(ps.PlaneBoundary((0, 0, 0), (0, 1, 0), slip=False))
    upper = (np.inf, 1, np.inf)  # a side that moves along itself
    wall = scene.add_constraint(
        ps.BoxBoundary((-np.inf,) * 3, upper, velocity=speed * NORMAL, slip=False)
    )
    settings = ps.Settings(dt=0.01, substeps=8, precision="float64")
    sim = ps.Simulation(scene, settings, device="cpu")
    start, force = sim.diagnostics().energy[0], [sim.force(wall)[0]]
    for _ in range(round(time / settings.dt)):
        sim.step()
        force.append(sim.force(wall)[0])
    gained = sim.diagnostics().energy[0] - start
    assert gained == pytest.approx(nu * speed**2 * width * time, rel=0.01)
    # The sum of trapezes of a force that stays within 1 %, and is sampled 40 times.
    assert gained == pytest.approx(-speed * np.trapezoid(force, dx=settings.dt), rel=1e-3)
