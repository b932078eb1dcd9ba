"""Surface tension between fluids against known answers: drops, and a bubble that rises."""

import importlib

import numpy as np
import pytest

import particlesim as ps

pytestmark = pytest.mark.slow
SIGMA, SIDE = 1.0, 2.0


def drop(shape, across, dimension=2, ratio=1.0, viscosity=None, sound=10.0, reach=2.0):
    """A drop of the volume of the unit circle or ball, in a periodic box of fluid under pressure.

    Args:
        shape: How far inside a point is, as a part of the drop, from its place.
        across: Spacings in the radius.
        ratio: How much lighter what is around it is.
    """
    spacing, flat = 1 / across, dimension == 2
    corner = np.array([SIDE, SIDE, 0 if flat else SIDE])
    x = ps.sample.box(-corner, corner, spacing)
    inside, open_axis = shape(x) < 1, None if flat else SIDE
    scene = ps.Scene(
        periodic=((-SIDE, -SIDE, open_axis and -SIDE), (SIDE, SIDE, open_axis)),
    )
    for name, own, density in (("drop", inside, 1.0), ("air", ~inside, 1 / ratio)):
        # 5 % more than at rest: the pressure is 1.22 times 5 % of c^2, several sigma / h.
        scene.add_particles(x[own], mass=1.05 * density * spacing**dimension, group=name)
    fluids = scene.add_interaction(
        ps.SPH(["drop", "air"], smoothing_length=reach * spacing, rest_density=[1.0, 1 / ratio],
               equation_of_state=[ps.Tait(sound), ps.Tait(sound * ratio**0.5)],
               viscosity=viscosity, dimension=dimension)
    )  # fmt: skip
    scene.add_interaction(ps.SurfaceTension(fluids, SIGMA))
    dt = 0.05
    substeps = int(np.ceil(dt / (0.25 * reach * spacing / (sound * ratio**0.5))))
    settings = ps.Settings(dt=dt, substeps=substeps, integrator="velocity_verlet")
    return ps.Simulation(scene, settings, device="cpu")


def round_drop(x):
    return np.linalg.norm(x, axis=1)


def square_drop(x):
    return np.abs(x).max(axis=1) / (0.5 * np.pi**0.5)


def stretched_drop(x):
    return np.linalg.norm(x / [1.1, 1 / 1.1, 1.0], axis=1)


def excess(dimension, across, reach, ratio=1.0):
    """By how much the pressure in a round drop is above (d - 1) sigma / R, as a part of that."""
    thick = ps.ArtificialViscosity(0.5)
    sim = drop(round_drop, across, dimension, ratio, thick, reach=reach)
    sim.run(20)
    found, h = [], reach / across
    for _ in range(20):  # over the sound of the start, whose period is about 2 SIDE / c = 0.4
        sim.step()
        r, p = round_drop(sim.position), sim.get("pressure")
        inside = np.arange(len(r)) < len(sim.scenes[0]["drop"])
        deep, outside = inside & (r < 1 - 2 * h), ~inside & (r > 1 + 2 * h)
        found.append(p[deep].mean() - p[outside].mean())
    volume = (sim.scenes[0].mass / sim.get("density"))[inside].sum()
    radius = (volume / (np.pi if dimension == 2 else 4 / 3 * np.pi)) ** (1 / dimension)
    # Floating, it stays where it is: forces sum to round-off.
    assert np.abs(sim.position[inside].mean(axis=0)).max() < 1e-5
    assert np.abs(sim.diagnostics().momentum).max() < 1e-5
    return np.mean(found) / ((dimension - 1) * SIGMA / radius) - 1


def test_pressure_in_a_drop():
    """Laplace's law: sigma / R in the plane, and the error falls with the spacing.

    The surface is some 2 h thick, and half of that next to a radius is h / R: 33 % at 6 spacings,
    8 % at 24, of which a tenth was found. What is left of sound leaves some 0.5 % open.
    """
    found = [excess(2, across, 2.0) for across in (6, 12)]
    assert abs(found[0]) < 0.06 and abs(found[1]) < 0.03
    assert abs(found[1]) < 0.7 * abs(found[0])
    assert abs(excess(2, 8, 2.0, ratio=100.0)) < 0.04


def test_pressure_in_a_ball():
    """2 sigma / R: twice as much curved, twice as far off."""
    assert abs(excess(3, 6, 1.6)) < 0.08


def test_a_square_drop_becomes_round():
    sim = drop(square_drop, 16, viscosity=ps.LaminarViscosity(0.2))
    own = sim.scenes[0]["drop"].slice
    assert round_drop(sim.position[own]).max() > 1.15
    sim.run(100)
    x = sim.position[own] - sim.position[own].mean(axis=0)
    far = np.linalg.norm(x, axis=1)
    angle = (np.arctan2(x[:, 1], x[:, 0]) + np.pi) / (2 * np.pi)
    edge = np.array([far[(angle * 16).astype(int) % 16 == k].max() for k in range(16)])
    # From 1.19 at the corners and 0.86 at the sides to the same all around, within a spacing.
    assert np.ptp(edge) < 1 / 16
    assert sim.diagnostics().kinetic[0] < 1e-2


def test_a_drop_swings_at_rayleighs_frequency():
    """omega^2 = 6 sigma / ((rho + rho') R^3) in the plane, of two fluids (Lamb 1932)."""
    sim = drop(stretched_drop, 10, ratio=10.0, viscosity=ps.LaminarViscosity(0.005), sound=15.0)
    own, time, moment = sim.scenes[0]["drop"].slice, [], []
    energy = sim.diagnostics().energy[0]
    for _ in range(80):
        sim.step()
        x = sim.position[own] - sim.position[own].mean(axis=0)
        time.append(sim.time)
        moment.append((x[:, 0] ** 2 - x[:, 1] ** 2).mean())
    moment, time = np.array(moment), np.array(time)
    (k,) = np.nonzero(moment[:-1] * moment[1:] < 0)
    zeros = time[k] - moment[k] * (time[k + 1] - time[k]) / (moment[k + 1] - moment[k])
    half = np.diff(zeros).mean()
    # A surface 2 h = 0.4 thick is pulled less by waves of k h = 0.4: (k h)^2 / 2 = 8 %. At 20
    # spacings to the radius the period was 2 % long.
    assert half == pytest.approx(np.pi / np.sqrt(6 * SIGMA / 1.1), rel=0.1)
    # The force is no gradient: energy goes astray by some of the surface's.
    assert abs(sim.diagnostics().energy[0] - energy) < 0.02 * 2 * np.pi * SIGMA


def test_a_bubble_rises_as_in_the_benchmark():
    scene = importlib.import_module("particlesim.scenes.rising_bubble")
    sim = ps.Simulation(scene.build(), scene.settings, device="cpu")
    speed = []
    for _ in range(scene.frames):
        sim.step()
        speed.append(scene.middle(sim)[1])
    # 16 particles across the bubble: a surface of 2 h = 0.125 on a radius of 0.25.
    assert max(speed) == pytest.approx(scene.FASTEST, rel=0.05)
    assert (1 + np.argmax(speed)) * sim.settings.dt == pytest.approx(scene.WHEN, abs=0.3)
    assert scene.error(sim) < 0.03
