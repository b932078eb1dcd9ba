"""Faults of steps: too large for each kind of force, at the start or only later."""

from functools import partial

import numpy as np

import particlesim as ps

from . import laws
from .judge import (
    EULER,
    VERLET,
    Row,
    energy_kept,
    equal,
    scene,
    slower_than,
    within,
)

# A table, laid out by hand.
# fmt: off

PAIR = [(0, 0, 0), (1, 0, 0)]
METHODS = {"Euler": EULER, "Verlet": VERLET}


def once(dt, **more):
    """A frame of one substep."""
    return {"dt": dt, "substeps": 1, **more}


# At the start ------------------------------------------------------------------------------------


def spring(damping=0.0, count=2):
    """A pinned end, and a chain stretched by a tenth; omega of one spring is 1."""
    x = [(1.1 * k, 0, 0) for k in range(count)]
    links = ps.Springs([(k, k + 1) for k in range(count - 1)], 1.0, 1.0, damping)
    return scene(x, links, pinned=np.arange(count) == 0)


def of_springs():
    for name, method in METHODS.items():
        for phase in (1.99, 2.02, 2.5, 20.0):
            yield Row(f"spring, omega dt = {phase}, {name}", spring, within(0.1, center=[[(0, 0, 0),
                (1, 0, 0)]]), 100, once(phase, **method))
    # Of a long chain the highest frequency is twice that of one spring.
    for phase in (1.05, 3.0):
        yield Row(f"chain of springs, omega dt = {2 * phase}", partial(spring, count=30),
            energy_kept(1.0), 100, once(phase, **VERLET))
    for damping in (2.2, 10.0):
        yield Row(f"damped spring, gamma dt = {damping}", partial(spring, damping), within(1.2), 60,
            once(1.0))
    stiff = partial(scene, [(0, 0, 0), (1.1, 0, 0)], ps.Distance([(0, 1)], 1.0,
        compliance=1e-4).as_force())
    yield Row("penalty, omega dt = 3", stiff, energy_kept(10.0, 0.5), 60, once(0.021))


def of_drag():
    def drag(velocity=1.0, **rates):
        return scene([(0, 0, 0)], ps.Drag(**rates), velocity=(velocity, 0, 0))

    def cubic():
        force = ps.ParticleForce(laws.cubic_drag, rate=1.0)
        return scene([(0, 0, 0)], force, velocity=(100, 0, 0))

    for rate in (2.1, 5.0, 100.0):
        yield Row(f"linear drag, gamma dt = {rate}", partial(drag, linear=rate), slower_than(1.0),
            100, once(1.0))
    yield Row("quadratic drag, 2 b v dt = 20", partial(drag, 1000.0, quadratic=0.01),
        slower_than(1000.0), 30, once(1.0))
    yield Row("cubic drag, 3 v^2 dt = 300", cubic, slower_than(100.0), 30, once(0.01))


def turning(omega=1.0):
    """A charge of speed 1 in a magnetic field; it goes round clockwise, omega = 1."""
    field = ps.ParticleForce(laws.lorentz, field=(0, 0, omega))
    return scene([(1 / omega, 0, 0)], field, velocity=(0, -1, 0))


def of_fields():
    for name, method in METHODS.items():
        for phase in (0.02, 0.1, 0.5, 2.0, 10.0):
            frames = 60 if phase > 0.3 else 30
            substeps = 1 if phase > 0.3 else round(6 / phase)
            yield Row(f"magnetic field, omega h = {phase}, {name}", turning, slower_than(1.0, 1.05),
                frames, {"dt": phase * substeps, "substeps": substeps, **method})

    def turntable():
        force = ps.ParticleForce(laws.coriolis, spin=(0, 0, 1.0))
        return scene([(0, 0, 0)], force, velocity=(1, 0, 0), mass=3.0)

    yield Row("Coriolis, 2 omega h = 0.2", turntable, slower_than(1.0, 1.05), 100, {"dt": 2.0,
        "substeps": 20})


# Later -------------------------------------------------------------------------------------------


def couple(law, apart, speed=0.0, across=0.0, **parameters):
    v = 0.5 * np.array([(speed, -across, 0), (-speed, across, 0)])
    force = ps.PairPotential(law, cutoff=None, **parameters)
    return scene([(0, 0, 0), (apart, 0, 0)], force, velocity=v)


def atoms(apart, speed=0.0, cutoff=None):
    return scene([(0, 0, 0), (apart, 0, 0)], ps.LennardJones(cutoff=cutoff or 4.0),
        velocity=[(speed / 2, 0, 0), (-speed / 2, 0, 0)])


def of_pairs():
    for dt in (0.05, 0.1, 0.3):
        yield Row(f"atoms at rest at 1.3, step {dt}", partial(atoms, 1.3), energy_kept(0.3, 1.0),
            100, once(dt, **VERLET))
    for dt in (0.01, 0.05):
        yield Row(f"atoms that meet at 30, step {dt}", partial(atoms, 3.9, 30.0), energy_kept(0.1),
            40, once(dt, **VERLET))
    yield Row("atoms at half a diameter", partial(atoms, 0.5), energy_kept(0.1, 1e4), 20,
        {"dt": 0.005, "substeps": 1, **VERLET})
    well = {"depth": 1.0, "width": 6.0, "rest": 1.0}
    for dt in (0.3, 1.0):
        yield Row(f"Morse, at rest at 1.8, step {dt}", partial(couple, laws.morse, 1.8, **well),
            energy_kept(0.3, 1.0), 200, once(dt, **VERLET))
    pull = {"strength": -1.0, "screening": 1.0}
    for name, method in METHODS.items():
        yield Row(f"attracting Yukawa, {name}", partial(couple, laws.yukawa, 3.0, across=0.02,
            **pull), energy_kept(0.3, 1.0), 400, once(0.05, **method))
    repel = {"strength": 1.0, "screening": 1.0}
    yield Row("repelling Yukawa at speed 20", partial(couple, laws.yukawa, 4.0, 20.0, **repel),
        energy_kept(0.1), 40, once(0.1, **VERLET))

    def dem(speed):
        push = ps.PairForce(laws.grains, cutoff=0.025, stiffness=1e5, diameter=0.02)
        return scene([(0, 0, 0), (0.022, 0, 0)], push, mass=1e-3, velocity=[(speed, 0, 0), (-speed,
            0, 0)])

    for speed in (0.1, 10.0):
        yield Row(f"grains that collide at {speed}", partial(dem, speed), slower_than(speed, 1.1),
            40, {"dt": 1e-3, "substeps": 5})

    def cold():
        x = ps.sample.lattice("fcc", (3, 3, 3), 1.7)
        v = ps.sample.maxwell_boltzmann(len(x), 1e-4, 1.0, seed=0)
        force = ps.PairPotential(laws.wca, cutoff=2 ** (1 / 6), radius=2 ** (1 / 6))
        return scene(x, force, box=((0, 0, 0), (5.1,) * 3), velocity=v)

    for dt in (0.1, 0.2):
        yield Row(f"cold soft spheres, step {dt}", cold, energy_kept(0.5), 100, once(dt, **VERLET))


def comet(e, law=None, G=1.0):
    """At aphelion 1 + e of an orbit of semi-axis 1, period 2 pi."""
    force = ps.PairForce(law, cutoff=None, constant=G) if law else ps.Gravity(G=G)
    v = np.sqrt((1 - e) / (1 + e))
    return scene([(0, 0, 0), (1 + e, 0, 0)], force, pinned=[True, False], mass=[1.0, 1e-6],
        velocity=[(0, 0, 0), (0, v, 0)])


def of_gravity():
    for e, dt in ((0.6, 0.3), (0.95, 0.3), (0.95, 0.05), (0.999, 0.02)):
        for name, method in METHODS.items():
            yield Row(f"comet of e = {e}, step {dt}, {name}", partial(comet, e), within(1 + e, 1.1),
                int(13 / dt / 10), {"dt": 10 * dt, "substeps": 10, **method})
    yield Row("comet of e = 0.9 by a law", partial(comet, 0.9, laws.inverse_square), within(1.9,
        1.1), 40, {"dt": 1.0, "substeps": 5, **VERLET})
    cluster = np.random.default_rng(1).normal(size=(12, 3))
    yield Row("a cluster that falls in", partial(scene, cluster, ps.Gravity(), mass=1.0 / 12),
        energy_kept(0.5), 60, once(0.1, **VERLET))
    spiral = ps.PairForce(laws.inverse_cube, cutoff=None, strength=1.2)
    yield Row("a fall into the centre", partial(scene, [(0, 0, 0), (1, 0, 0)], spiral, pinned=[True,
        False], velocity=[(0, 0, 0), (0, 1, 0)]), slower_than(30.0), 60, once(0.05, **VERLET))
    charges = partial(scene, [(0, 0, 0), (1, 0, 0)], ps.PairPotential(laws.coulomb, cutoff=None),
        charge=[1.0, -1.0], mass=[1e3, 1.0])
    yield Row("opposite charges that fall together", charges, energy_kept(0.5, 1.0), 60, once(0.05,
        **VERLET))


def of_stiffening():
    def hits(stiffness):
        force = ps.ParticleForce(potential=laws.wall, stiffness=stiffness, place=10.0)
        return scene([(0, 0, 0)], force, velocity=(1, 0, 0))

    for phase in (1.9, 3.0, 30.0):
        yield Row(f"a free flight into a wall, omega dt = {phase}", partial(hits, phase**2),
            energy_kept(0.1), 30, once(1.0, **VERLET))
    for start in (0.0, 0.01, 5.0):
        force = ps.ParticleForce(potential=laws.quartic, strength=1.0)
        yield Row(f"quartic trap from {start}", partial(scene, [(start, 0, 0)], force, velocity=(0,
            10, 0)), energy_kept(0.1), 100, once(0.4, **VERLET))
    stiff = ps.ParticleForce(laws.stiffening, rate=0.2)
    yield Row("a trap that stiffens in time", partial(scene, [(1, 0, 0)], stiff), within(1.0), 60,
        once(0.5, **VERLET))
    k = np.ones(29)
    k[20] = 400.0

    def one_stiff():
        x = np.array([(1.01 * j, 0, 0) for j in range(30)])
        links = ps.Springs([(j, j + 1) for j in range(29)], k, 1.0)
        return scene(x, links, velocity=0.1 * np.cos(x[:, ::-1]))

    yield Row("a chain with one stiff spring at 0.998 of its limit", one_stiff, energy_kept(1.0),
        400, once(0.998 * 2 / np.sqrt(801), **EULER))


def of_time():
    for length in (1e-5, 1e-3):
        force = ps.ParticleForce(laws.pulse, start=0.50501, length=length, push=10 / length)
        yield Row(f"a pulse of {length} s", partial(scene, [(0, 0, 0)], force),
            equal(lambda done: done.v[-1, 0, 0], 10.0), 100, {"dt": 0.01, "substeps": 2,
            "precision": "float64"})
    shaken = ps.ParticleForce(laws.shaking, omega=2 * np.pi * 100, strength=1.0)
    yield Row("shaken at the frequency of the substeps", partial(scene, [(0, 0, 0)], shaken),
        within(1e-5, 10.0), 100, {"dt": 0.1, "substeps": 10})
    force = ps.ParticleForce(laws.negative_drag, rate=1.0)
    yield Row("a push along the velocity", partial(scene, [(0, 0, 0)], force, velocity=(1, 0, 0)),
        lambda done: abs(np.log(done.v[-1, 0, 0]) - 8.0) / np.log(3.0), 8, once(1.0))


def rows():
    for family in (of_springs, of_drag, of_fields, of_pairs, of_gravity, of_stiffening, of_time):
        yield from family()
