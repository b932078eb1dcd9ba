"""Limits of fluids: sound and viscosity; and of collisions."""

import importlib

import numpy as np
import pytest
import warp as wp

import particlesim as ps
from cases.stability import limit, simulation
from particlesim.engine.probe import Probe
from particlesim.interactions.fluid.limits import steepest
from particlesim.interactions.fluid.smoothing import SMOOTHING

# SPH


def fluid(
    spacing=0.1, ratio=1.3, smoothing="wendland_c2", viscosity=None, dense=1.0, **kwargs
):  # fmt: skip
    """A liquid that fills a periodic box of unit size."""
    scene = ps.Scene(periodic=((0, 0, 0), (1, 1, 1)))
    x = ps.sample.box((0, 0, 0), (1, 1, 1), spacing)
    water = scene.add_particles(x, mass=dense * spacing**3, **kwargs)
    scene.add_interaction(
        ps.SPH(
            water, smoothing_length=ratio * spacing, rest_density=1.0, smoothing=smoothing,
            equation_of_state=ps.Tait(10.0, negative_pressure=True), viscosity=viscosity,
        )
    )  # fmt: skip
    return scene


OFTEN = ("wendland_c2",)


@pytest.mark.parametrize(
    "smoothing",
    [
        *OFTEN,
        *(pytest.param(each, marks=pytest.mark.slow) for each in sorted({*SMOOTHING} - {*OFTEN})),
    ],
)
def test_sound_limit_is_that_of_the_fluid_itself(smoothing):
    # What is narrow has as many neighbours that count at a larger h.
    ratio = 1.6 if smoothing in ("wendland_c6", "spiky") else 1.3
    sim = simulation(fluid(ratio=ratio, smoothing=smoothing), precision="float64")
    sph = sim.interactions[0]
    sound = sim.stability().binding
    assert sound.kind == "sound"
    with Probe(sim.loop) as probe:
        (true,) = probe.response(sph)
        c = sph.sound_speeds(probe)
    # The continuum's wave of largest omega against the lattice's: 74 neighbours, within 5 %.
    assert sound.dt == pytest.approx(true.dt, rel=0.05)
    assert sound.dt == pytest.approx(
        2 * 0.1 * ratio / (c.max() * steepest(SMOOTHING[smoothing].in_dimension(3), 3)), rel=1e-6
    )


def test_sound_speed_follows_the_density():
    sim = simulation(fluid(dense=1.01), precision="float64")
    with Probe(sim.loop) as probe:
        c = sim.interactions[0].sound_speeds(probe)
        rho = probe.state.density.numpy().copy()  # that of before comes back
    # Tait with gamma = 7: c = c0 s^3.
    np.testing.assert_allclose(c, 10 * rho**3, rtol=1e-12)


def schoenberg():
    """Largest k (sin(k/2) / (k/2))^4."""
    k = np.linspace(1e-3, 6, 60001)
    return (k * (np.sin(k / 2) / (k / 2)) ** 4).max()


def in_space():
    """Largest k W_hat of the cubic spline in space, by the sine transform on a fine grid."""
    q = (np.arange(20000) + 0.5) / 10000
    w = (np.maximum(2 - q, 0) ** 3 / 4 - np.maximum(1 - q, 0) ** 3) / np.pi
    return max(4 * np.pi * (w * q * np.sin(k * q)).sum() / 10000 for k in np.linspace(1, 3, 201))


@pytest.mark.parametrize(("dimension", "expected"), [(1, schoenberg), (3, in_space)])
def test_steepest_of_the_cubic_spline(dimension, expected):
    # On a line the transform is (sin(k/2) / (k/2))^4 (Schoenberg 1946).
    smoothing = SMOOTHING["cubic_spline"].in_dimension(dimension)
    assert steepest(smoothing, dimension) == pytest.approx(expected(), rel=1e-3)


@pytest.mark.slow
def test_viscosity_shortens_the_step():
    free = limit(fluid())
    viscous = limit(fluid(viscosity=ps.ArtificialViscosity(1.0)))
    assert viscous < 0.7 * free


def test_fluid_is_bounded_below_and_diverges_above():
    scene = fluid(dense=1.01, velocity=1e-3 * np.random.default_rng(0).normal(size=(1000, 3)))
    dt = limit(scene, precision="float64")
    gain = {}
    for factor in (0.95, 1.1):
        sim = simulation(
            scene, dt=100 * factor * dt, substeps=100, precision="float64", watchdog=False
        )
        start = sim.diagnostics().energy[0]
        for _ in range(2):
            sim.step()
        gain[factor] = sim.diagnostics().energy[0] / start - 1
    # The lattice's own limit is 1.02 of the estimate: below it the energy only fluctuates by
    # (omega dt)^2 parts of what sound holds of it; above, 1.1 grows by 1.8 a substep.
    assert abs(gain[0.95]) < 0.05
    assert gain[1.1] > 1000


# Collisions


def test_collisions_gain_no_energy_within_the_limit():
    def beam(phase, dt, speed=8.0):
        scene = ps.Scene()
        gap = 2.6 + phase * speed * dt
        scene.add_particles(
            [(0, 0, 0), (gap, 0, 0)], velocity=[(speed / 2, 0, 0), (-speed / 2, 0, 0)]
        )
        scene.add_interaction(ps.LennardJones(cutoff=2.5, truncation="force_shift"))
        return scene

    dt = limit(beam(0.5, 0.01), precision="float64")
    gain = {}
    for factor in (1.0, 1.6):
        phases = (np.arange(32) + 0.5) / 32
        scenes = [beam(phase, factor * dt) for phase in phases]
        sim = simulation(
            scenes, dt=2.0, substeps=round(2.0 / (factor * dt)), precision="float64",
            watchdog=False,
        )  # fmt: skip
        start = sim.diagnostics().kinetic
        sim.step()
        gain[factor] = float((sim.diagnostics().kinetic / start).mean() - 1)
    # The limit's own condition is 0.1 % on average, found within a tenth of dt.
    assert abs(gain[1.0]) < 1.5e-3
    assert gain[1.6] > 1e-2


def test_a_gas_without_contact_knows_its_collisions():
    module = importlib.import_module("particlesim.scenes.gas_in_a_box")
    report = simulation(module.build(count=20)).stability()
    assert report.binding.kind == "collision"
    # omega^2 = k / mu = 500 / 0.0005; a tenth to all of 2 / omega.
    assert 0.1 < report.dt / (2 / 1000) < 1.0


def test_slow_grains_are_followed_where_they_touch(monkeypatch):
    """Not while they fly freely; and a soft touch of linear springs knows no speed."""

    @ps.law
    def spring(r: float, k: float, d: float):
        return k * wp.max(d - r, 0.0)

    asked, looked = [], np.interp
    monkeypatch.setattr(np, "interp", lambda *args, **kw: asked.append(1) or looked(*args, **kw))
    found = []
    for speed in (1e-6, 1e-4, 1e-2):
        scene = ps.Scene()
        scene.add_particles(
            [(0, 0, 0), (0.022, 0, 0)], mass=1e-3, velocity=[(speed, 0, 0), (-speed, 0, 0)]
        )
        scene.add_interaction(ps.PairForce(spring, cutoff=0.025, k=1e5, d=0.02))
        found.append(limit(scene, precision="float64") * np.sqrt(1e5 / 0.5e-3))
        assert len(asked) < 1000
        asked.clear()
    # In 1 / omega, omega^2 = k / (m / 2): below the linear limit, 2; steps tried are 0.9 apart.
    assert 0.2 < found[0] < 2
    assert found == pytest.approx([found[0]] * 3, rel=0.11)
