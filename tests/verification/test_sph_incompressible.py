"""DFSPH against known answers: a tank at rest, and how well a dam's break keeps its density."""

import numpy as np
import pytest

import particlesim as ps
from particlesim.scenes import dam_break, sloshing_tank

G = 9.81


def over(sim, fluid):
    """By how much densities exceed that of rest, on average, in parts of it."""
    rest = float(fluid.params.numpy()["rest_density"][0])
    return float(np.maximum(sim.get("density") - rest, 0.0).mean() / rest)


@pytest.mark.slow
@pytest.mark.parametrize("across", [10, 20])
def test_tank_at_rest_in_a_box(across):
    """Ten seconds: it stands as high as it was, weighs as much, and is all but at rest.

    Its step is six to three times that of a weakly compressible fluid of the same speeds.
    """
    spacing = 1 / across
    scene = ps.Scene()
    x = ps.sample.box((0, 0, 0), (0.5, 1, 0.5), spacing)
    scene.add_particles(x, mass=1000 * spacing**3, radius=spacing / 2)
    scene.add_interaction(ps.UniformGravity((0, -G, 0)))
    fluid = ps.DFSPH(
        smoothing_length=1.3 * spacing, rest_density=1000.0, viscosity=ps.LaminarViscosity(0.02)
    )
    scene.add_interaction(fluid)
    tank = scene.add_constraint(ps.BoxBoundary((0, 0, 0), (0.5, 2, 0.5)))
    settings = ps.Settings(dt=1 / 150, substeps=across // 10)
    sim = ps.Simulation(scene, settings, device="cpu")
    sim.run(1350)
    force = []
    for _ in range(150):
        sim.step()
        force.append(sim.force(tank))
        assert sim.diagnostics().density_error[0] <= settings.density_tolerance
    assert abs(2 * sim.position[:, 1].mean() - 1) < 0.01
    # Up to what the tolerances leave: 1e-4 H in a step is 0.015 to 0.03 length/s, of which speeds
    # of 0.01 sqrt(g H) = 0.03 are the round number.
    assert sim.diagnostics().kinetic[0] < 0.5 * 250 * G * 0.01**2
    assert np.mean(force, axis=0) == pytest.approx([0, -250 * G, 0], abs=0.02 * 250 * G)


@pytest.mark.slow
def test_a_dam_break_keeps_its_density():
    """Under 0.1 % too dense on average in every frame, at five times the step of its Tait's."""
    like, spacing = dam_break.settings, 0.026
    scene = ps.Scene()
    given = dam_break.build(spacing=spacing)
    scene.add_particles(
        given.position, velocity=given.column("velocity"), mass=given.column("mass"),
        radius=spacing / 2,
    )  # fmt: skip
    scene.add_interaction(ps.UniformGravity((0, -G, 0)))
    scene.add_interaction(ps.DFSPH(smoothing_length=1.3 * spacing, rest_density=1000.0))
    scene.add_constraint(ps.BoxBoundary((0, 0, 0), (2.5, 1.3, 0.3), slip=False))
    settings = like.replace(dt=25 * like.substep, substeps=5)
    sim = ps.Simulation(scene, settings, device="cpu")
    fluid = next(each for each in sim.interactions if isinstance(each, ps.DFSPH))
    for _ in range(86):  # one and a half seconds
        sim.step()
        assert over(sim, fluid) < 1e-3
    assert all(each.missed[0] == 0 for each in fluid.iterated())


def sloshing_error(spacing):
    """Root mean square over a period, with steps as long as the particles' spacing allows."""
    settings = sloshing_tank.settings.replace(substeps=round(0.1 / spacing))
    sim = ps.Simulation(sloshing_tank.build(spacing=spacing), settings, device="cpu")
    errors = []
    for _ in range(71):
        sim.step()
        errors.append(sloshing_tank.error(sim))
    return float(np.sqrt(np.mean(np.square(errors))))


@pytest.mark.slow
def test_water_sloshes_at_the_frequency_of_linear_waves():
    """And the better the finer it is, by the first order at least.

    What is left of a wave whose height is 0.1 / k is nonlinear by its square, 1 % or less.
    """
    coarse, fine = sloshing_error(0.025), sloshing_error(0.0125)
    assert fine < 0.05
    assert coarse / fine > 2.0
