"""Several fluids in one SPH against known answers."""

import numpy as np
import pytest

import particlesim as ps

pytestmark = pytest.mark.slow

ACROSS, G, HEAVY = 20, 1.0, 1000.0


@pytest.mark.parametrize(
    "ratio, stiffness",
    [(2, 1.0), (10, 1.0), (1000, 0.1)],
)
def test_a_light_fluid_rests_on_a_heavy_one(ratio, stiffness):
    """p = rho g depth in both, continuous where they meet, and nothing mixes.

    A plane of fluid in a box, half a metre of each; ``stiffness`` is rho c^2 of the light one, of
    that of the heavy one.
    """
    spacing = 1 / ACROSS
    rho, c = [HEAVY, HEAVY / ratio], [10.0, 10.0 * np.sqrt(ratio * stiffness)]
    x = ps.sample.box((0, 0, 0), (0.5, 1, 0), spacing)
    x[:, :2] += 0.1 * spacing * np.random.default_rng(0).uniform(-1, 1, (len(x), 2))
    scene = ps.Scene()
    groups = [
        scene.add_particles(x[own], mass=each * spacing**2, radius=0.3 * spacing)
        for own, each in zip((x[:, 1] < 0.5, x[:, 1] > 0.5), rho, strict=True)
    ]
    scene.add_interaction(ps.UniformGravity((0, -G, 0)))
    fluid = scene.add_interaction(
        ps.SPH(groups, smoothing_length=2 * spacing, rest_density=rho,
               equation_of_state=[ps.Tait(each) for each in c], dimension=2,
               viscosity=ps.ArtificialViscosity(0.3))
    )  # fmt: skip
    tank = scene.add_constraint(ps.BoxBoundary((0, 0, -1), (0.5, 1.2, 1)))
    substeps = int(np.ceil(0.05 / (0.2 * 2 * spacing / max(c))))
    sim = ps.Simulation(scene, ps.Settings(dt=0.05, substeps=substeps), device="cpu")
    sim.run(100)
    y = np.linspace(0.1, 0.8, 29)
    points = [(a, b, 0) for b in y for a in np.linspace(0.1, 0.4, 7)]
    p, force = np.zeros(len(y)), []
    for _ in range(20):  # over the sound that is left
        sim.step()
        found = sim.interpolate(fluid, points, "pressure", normalized=True)
        p += found.reshape(len(y), -1).mean(axis=1) / 20
        force.append(sim.force(tank)[1])
    at = [sim.position[each.slice, 1] for each in groups]
    # Heavy below light: their particles do not pass each other, but for waves of a spacing.
    assert at[0].max() < at[1].min() + 0.5 * spacing
    meets = 0.5 * (at[0].max() + at[1].min())
    below, above = (y < meets - 4 * spacing), (y > meets + 2 * spacing)
    whole = HEAVY * G * 0.5
    lines = [np.polyfit(y[own] - meets, p[own], 1) for own in (below, above)]
    # Densities are summed over 50 particles, and 3e-4 of one is 3 % of the pressure at the floor;
    # a line through ten rows of the light fluid is 1e-3 of that off. At a ratio of 1000 the gap of
    # two spacings between them leaves it open by 1 % of the whole where the fluids meet.
    assert lines[0][0] == pytest.approx(-HEAVY * G, rel=0.03)
    assert lines[1][0] == pytest.approx(-rho[1] * G, rel=0.03, abs=1e-3 * HEAVY * G)
    for line in lines:  # continuous, and what the light fluid weighs
        open_by = 0.01 if ratio > 100 else 0.0
        assert line[1] == pytest.approx(0.5 * rho[1] * G, abs=(0.02 + open_by) * whole)
    assert np.mean(force) == pytest.approx(-0.25 * G * sum(rho), rel=0.02)
    assert np.linalg.norm(sim.velocity, axis=1).max() < 0.1 * np.sqrt(G)


def test_an_internal_wave_has_its_period():
    """omega^2 = g k (rho - rho') / (rho coth k H + rho' coth k H'), between floor and lid (Lamb).

    A standing wave where a fluid of half the density lies on another, half a metre of each.
    """
    spacing, height, c, k, start = 1 / ACROSS, 0.08, 5.0, 2 * np.pi, 0.1
    rho, stiffness = np.array([1.0, 0.5]), 25.0
    x, y = ps.sample.box((0, 0, 0), (1, 1, 0), spacing), np.linspace(0.0, 1.0, 401)
    # Under its own weight, and under 0.1 at the lid.
    p = start + G * np.where(y > 0.5, rho[1] * (1 - y), 0.5 * rho[1] + rho[0] * (0.5 - y))
    dense = (1 + 7 * p / stiffness) ** (1 / 7)
    below = np.concatenate([[0.0], np.cumsum(0.5 * (dense[1:] + dense[:-1]) * np.diff(y))])
    x[:, 1] = np.interp(x[:, 1] * below[-1], below, y)
    low = x[:, 1] < 0.5 + height * np.cos(k * x[:, 0])
    scene = ps.Scene(periodic=((0, None, None), (1, None, None)))
    groups = [
        scene.add_particles(x[own], mass=each * spacing**2 * below[-1], radius=spacing / 2)
        for own, each in zip((low, ~low), rho, strict=True)
    ]
    scene.add_interaction(ps.UniformGravity((0, -G, 0)))
    scene.add_interaction(
        ps.SPH(groups, smoothing_length=2 * spacing, rest_density=rho, dimension=2,
               equation_of_state=[ps.Tait(c), ps.Tait(c * 2**0.5)],
               viscosity=ps.LaminarViscosity(0.001))
    )  # fmt: skip
    for point, normal in (((0, 0, 0), (0, 1, 0)), ((0, 1, 0), (0, -1, 0))):
        scene.add_constraint(ps.PlaneBoundary(point, normal))
    sim = ps.Simulation(scene, ps.Settings(dt=0.05, substeps=12), device="cpu")
    period = 2 * np.pi / np.sqrt(G * k * (rho[0] - rho[1]) * np.tanh(k / 2) / rho.sum())
    energy, side, wave = sim.diagnostics().energy[0], np.sort(np.where(low, -1, 1)), []
    for _ in range(int(1.05 * period / 0.05)):
        sim.step()
        wave.append((side * np.cos(k * sim.position[:, 0])).mean())
    wave = np.array(wave)
    (n,) = np.nonzero(wave[:-1] * wave[1:] < 0)
    zeros = 0.05 * (1 + n + wave[n] / (wave[n] - wave[n + 1]))
    # Viscous layers of sqrt(2 nu / omega) = 0.04 on both sides take about half of k times that in
    # parts of the frequency; a surface that is 2 h = 0.2 thick takes as much.
    assert np.diff(zeros).mean() == pytest.approx(period / 2, rel=0.05)
    # Of what the wave has, rho g height^2 / 8, viscosity takes most, and nothing else does.
    whole = 0.5 * G * (rho[0] - rho[1]) * height**2 / 2
    assert -whole < sim.diagnostics().energy[0] - energy < 0
