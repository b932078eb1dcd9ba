"""Many particles or many starts whose numbers are known: each case is another of its kind."""

import math

import numpy as np
import warp as wp

import particlesim as ps

from .measured import (
    VERLET,
    Case,
    aside,
    balls,
    oscillators,
    pendulums,
    planets,
    spring,
    strings,
)  # fmt: skip

LIQUID = -4.7826
DAM = 0.5353

# Chance


def shaken(damping=1.5, stiffness=40.0, seed=0):
    return spring(stiffness, np.random.default_rng(seed).normal(0.3, 0.1), damping)


def shaken_springs(k):
    # x = 1 + a e^(-g t) (cos w t + g / w sin w t), linear in a, whose mean is 0.3.
    c, stiffness, time = 0.5 + 0.05 * k, 30.0 + k, 1.2
    g = c / 2
    w = math.sqrt(stiffness - g * g)
    wave = math.exp(-g * time) * (math.cos(w * time) + g / w * math.sin(w * time))
    settings = ps.Settings(dt=time / 12, integrator=VERLET)
    options = {"damping": c, "stiffness": stiffness}
    arguments = dict(frames=12, settings=settings, options=options)
    error = max(0.01 * abs(wave), 5e-4)  # some 400 starts
    return Case(make_seeded(shaken, 1000 * k), aside, 1 + 0.3 * wave, error, arguments)


def gas(count=30, temperature=2.0, seed=0):
    rng = np.random.default_rng(seed)
    scene = ps.Scene(periodic=((0, 0, 0), (2, 2, 2)))
    velocity = rng.normal(0, math.sqrt(temperature), (count, 3))
    scene.add_particles(rng.uniform(0, 2, (count, 3)), velocity=velocity)
    return scene


def crossings(sim):
    """Pressure by what crosses the sides of the box: m |v| each time, over area and time."""
    flow = (
        (np.abs(sim.velocity) * np.abs(sim.get("image"))).sum(axis=1).reshape(sim.world_count, -1)
    )
    return flow.sum(axis=1) / (3 * 4.0 * sim.time)


def gases(k):
    count, temperature = 30, 1.0 + 0.1 * k
    truth = count * temperature / 8.0
    settings = ps.Settings(dt=2.0)
    options = {"temperature": temperature}
    arguments = dict(frames=2, settings=settings, options=options)
    return Case(make_seeded(gas, 1000 * k), crossings, truth, 0.02 * truth, arguments)


@ps.law
def soft(r: float, diameter: float):
    overlap = wp.max(diameter - r, 0.0)
    return 500.0 * overlap * overlap


def jets(count=32, seed=0):
    """Soft spheres that all fly along x, half to either side: they forget it."""
    rng = np.random.default_rng(seed)
    scene = ps.Scene(periodic=((0, 0, 0), (4, 4, 4)))
    x = 4.0 * (np.indices((4, 4, 2)).reshape(3, -1).T + 0.5) / (4, 4, 2) + rng.normal(
        0, 0.1, (32, 3)
    )
    velocity = np.zeros((count, 3))
    velocity[:, 0] = np.where(rng.permutation(count) % 2, 1.0, -1.0)
    scene.add_particles(x, velocity=velocity)
    scene.add_interaction(ps.PairPotential(soft, cutoff=1.0, diameter=1.0))
    return scene


def along(sim):
    """The share of the kinetic energy that is along x."""
    squares = (sim.velocity.astype(float) ** 2).reshape(sim.world_count, -1, 3).sum(axis=1)
    return squares[:, 0] / squares.sum(axis=1)


def jet_gases(k):
    # No axis is any different when all is forgotten: a third.
    settings = ps.Settings(dt=0.25, integrator=VERLET)
    arguments = dict(over="mean", frames=60, settings=settings)
    if k % 2:  # one long run of one start
        arguments["options"] = {"seed": k}
    return Case(make_seeded(jets, 1000 * k), along, 1 / 3, 0.006, arguments)


def liquid(cells=3, density=0.8, seed=0):
    """108 Lennard-Jones atoms of one energy: a lattice, at 1.6 epsilon of kinetic temperature."""
    count = 4 * cells**3
    side = (count / density) ** (1 / 3)
    velocity = np.random.default_rng(seed).normal(size=(count, 3))
    velocity -= velocity.mean(axis=0)
    velocity *= np.sqrt(3 * 1.6 * count / (velocity**2).sum())
    scene = ps.Scene(periodic=((0, 0, 0), (side, side, side)))
    lattice = ps.sample.lattice("fcc", (cells, cells, cells), side / cells)
    scene.add_particles(lattice, velocity=velocity)
    scene.add_interaction(ps.LennardJones(cutoff=2.0))
    return scene


def depth(sim):
    """U / N."""
    return sim.diagnostics().potential / (sim.particle_count / sim.world_count)


def liquids(k):
    # Truth: 64 starts (seeds from 10^6 on), 80 time units each after 10, in float64: -4.78277 with
    # substeps of 0.0025, -4.78188 with 0.005, each to 2.6e-4. So LIQUID, to 5e-4.
    settings = ps.Settings(dt=0.05, integrator=VERLET)
    arguments = dict(over="mean", frames=100, settings=settings)
    return Case(make_seeded(liquid, 1000 * k), depth, LIQUID, 0.004, arguments)


# Space


def dam(spacing=0.1, width=0.5):
    """A column of water in the plane, twice as high as wide, as Froude's numbers have it."""
    count = round(width / spacing)
    spacing = width / count
    grid = np.meshgrid(np.arange(count) + 0.5, np.arange(2 * count) + 0.5, [0.0], indexing="ij")
    x = spacing * np.stack(grid, axis=-1).reshape(-1, 3)
    scene = ps.Scene()
    water = scene.add_particles(x, mass=1000 * spacing**2, radius=spacing / 2)
    scene.add_interaction(ps.UniformGravity((0, -9.81, 0)))
    sound = ps.Tait(sound_speed=45.0 * math.sqrt(width / 0.5))
    scene.add_interaction(
        ps.SPH(
            water, smoothing_length=1.3 * spacing, rest_density=1000.0, dimension=2,
            equation_of_state=sound, smoothing="wendland_c2",
            viscosity=ps.ArtificialViscosity(0.1),
        )
    )  # fmt: skip
    scene.add_constraint(ps.BoxBoundary((0, 0, -1), (10 * width, 10 * width, 1)))
    return scene


def front(sim):
    """Mean place of the foremost twentieth of the drops."""
    x = np.sort(sim.position[:, 0])
    return float(x[-max(1, len(x) // 20) :].mean())


def dams(k):
    # Truth: with 57, 80, 113 and 160 drops across 0.5345, 0.5350, 0.5354 and 0.5353; so DAM, to
    # 5e-4, and all lengths go with the width, all times with its root.
    width = 0.3 + 0.05 * k
    settings = ps.Settings(dt=0.02 * math.sqrt(width / 0.5))
    options = {"width": width, "spacing": width / (5 + k % 4)}
    arguments = dict(frames=4, settings=settings, options=options)
    return Case(dam, front, DAM * width / 0.5, 0.02 * width, arguments)


def make_seeded(build, first):
    """The same scene with other seeds: those of ``build`` from ``first`` on."""

    def seeded(seed: int = first, **options):
        return build(seed=seed, **options)

    return seeded


CASES = {
    "pendulum": pendulums, "oscillator": oscillators, "planet": planets, "string": strings,
    "ball": balls, "shaken spring": shaken_springs, "gas": gases, "jets": jet_gases,
    "liquid": liquids, "dam": dams,
}  # fmt: skip
