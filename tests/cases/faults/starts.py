"""Faults of starts and values: overlaps, numbers that are none, numbers that are not resolved."""

from functools import partial

import numpy as np

import particlesim as ps

from . import laws
from .judge import VERLET, Row, as_fine, energy_kept, equal, never, path, scene, slower_than, within

# A table, laid out by hand.
# fmt: off

FINE = {"dt": 0.005, "substeps": 1, **VERLET}
STEP = {"dt": 0.01, "substeps": 10}
TWO = [(0, 0, 0), (1, 0, 0)]


def of_overlaps():
    for apart in (0.0, 1e-9, 0.3, 0.6):
        yield Row(f"atoms at {apart} of a diameter", partial(scene, [(0, 0, 0), (apart, 0, 0)],
            ps.LennardJones(cutoff=2.5)), energy_kept(0.1, 4 * max(apart, 0.1) ** -12), 20, FINE,
            names="LennardJones")
    anywhere = np.random.default_rng(0).uniform(0, 7, (300, 3))
    yield Row("atoms at random", partial(scene, anywhere, ps.LennardJones(cutoff=2.5), box=((0, 0,
        0), (7, 7, 7))), never, 20, FINE, names="LennardJones")
    yield Row("atoms at random, frames done again", partial(scene, anywhere,
        ps.LennardJones(cutoff=2.5), box=((0, 0, 0), (7, 7, 7))), never, 5, {**FINE,
        "on_failure": "retry", "retries": 2}, names="LennardJones")
    yield Row("charges that nearly coincide", partial(scene, [(0, 0, 0), (1e-6, 0, 0)],
        ps.PairPotential(laws.coulomb, cutoff=None), charge=1.0), slower_than(2e3, 1.1), 20, FINE)
    yield Row("two stars in one place", partial(scene, [(0, 0, 0), (0, 0, 0), (1, 0, 0)],
        ps.Gravity()), energy_kept(0.5, 2.0), 20, FINE)
    yield Row("two stars almost in one place", partial(scene, [(0, 0, 0), (1e-5, 0, 0)],
        ps.Gravity()), energy_kept(0.5, 1e5), 20, FINE)
    yield Row("a spring without length between two in one place", partial(scene, [(0, 0, 0), (0, 0,
        0)], ps.Springs([(0, 1)], 10.0, 0.0)), within(1e-6), 20, FINE)
    yield Row("a spring of length 1 between two in one place", partial(scene, [(0, 0, 0), (0, 0,
        0)], ps.Springs([(0, 1)], 10.0, 1.0)), energy_kept(0.1, 5.0), 50, {"dt": 0.01,
        "substeps": 1, **VERLET})


def of_numbers():
    def particles(**values):
        return scene(TWO, ps.Springs([(0, 1)], 1.0), **values)

    for name, value in (
        ("position", np.nan),
        ("velocity", np.inf),
        ("mass", np.nan),
        ("mass", 0.0),
        ("mass", -1.0),
        ("radius", -1.0),
        ("charge", np.nan),
        ("pinned", 3.0),
    ):
        given = {name: value}
        if name in ("position", "velocity"):
            given[name] = [(0, 0, 0), (value, 0, 0)]
        x = given.pop("position", TWO)
        yield Row(f"{name} of {value}", partial(scene, x, **given), never, names=name)
    parts = {"stiffness": lambda: ps.Springs([(0, 1)], np.nan),
        "rest_length": lambda: ps.Springs([(0, 1)], 1.0, -1.0), "damping": lambda: ps.Springs([(0,
        1)], 1.0, damping=-1.0), "softening": lambda: ps.Gravity(softening=np.inf),
        "sigma": lambda: ps.LennardJones(sigma=0.0), "cutoff": lambda: ps.LennardJones(cutoff=-1.0),
        "compliance": lambda: ps.Distance([(0, 1)], compliance=-1.0),
        "restitution": lambda: ps.Contact(restitution=1.5),
        "friction": lambda: ps.Contact(friction=-0.1), "pairs": lambda: ps.Springs([(0, 0)], 1.0),
        "row": lambda: ps.Springs([(0, 1), (1, 0)], 1.0), "indices": lambda: ps.Springs([(0, 7)],
        1.0, 1.0)}
    for name, make in parts.items():
        yield Row(f"a part with a wrong {name}", lambda make=make: scene(TWO, make()), never,
            names="" if name == "row" else name)

    def spoil(sim, frame):
        if frame == 2:
            sim.velocity = np.full((2, 3), np.nan)

    def lighten(sim, frame):
        if frame == 2:
            sim.set("mass", 0.0)

    yield Row("velocities that are set to NaN", particles, never, 4, act=spoil, names="velocity")
    yield Row("masses that are set to 0", particles, never, 4, act=lighten, names="mass")
    for dt in (np.nan, -1.0, 1e-300, 1e300):
        yield Row(f"a step of {dt}", particles, never, 2, {"dt": dt}, names="dt")
    # Laws that are not numbers everywhere.
    yield Row("a root of what becomes negative", partial(scene, [(0.9, 0, 0)],
        ps.ParticleForce(laws.root, level=1.0), velocity=(1, 0, 0)), never, 60,
        names="ParticleForce")
    yield Row("a root of what is negative", partial(scene, [(2, 0, 0)], ps.ParticleForce(laws.root,
        level=1.0)), never, names="ParticleForce")
    yield Row("a logarithm of what is negative", partial(scene, TWO, ps.PairForce(laws.logarithm,
        cutoff=3.0, scale=2.0)), never, names="PairForce")
    yield Row("a division by 0", partial(scene, [(1, 0, 0)], ps.ParticleForce(laws.pole,
        place=1.0)), never, names="ParticleForce")
    yield Row("a law that leaves single precision", partial(scene, [(0, 0, 0), (1.5e11, 0, 0)],
        ps.PairForce(laws.inverse_square, cutoff=None, constant=6.674e-11), mass=[2e30, 6e24]),
        never, 10, {"dt": 1e5}, names="PairForce.*(float64|units)")


def of_units():
    sun = {"x": [(0, 0, 0), (1.496e11, 0, 0)], "mass": [1.989e30, 5.97e24], "velocity": [(0, 0, 0),
        (0, 29780.0, 0)]}
    yield Row("Sun and Earth in SI, with G = 1", partial(scene, sun["x"], ps.Gravity(),
        mass=sun["mass"], velocity=sun["velocity"]), within(1.496e11, 1.1), 30, {"dt": 86400.0})
    yield Row("Sun and Earth in SI, in steps of a year", partial(scene, sun["x"],
        ps.Gravity(G=6.674e-11), mass=sun["mass"], velocity=sun["velocity"]), within(1.496e11, 1.1),
        30, {"dt": 3.15e7, "substeps": 1}, names="Gravity")
    argon = ps.LennardJones(epsilon=1.65e-21, sigma=3.4e-10, cutoff=1e-9)
    yield Row("argon in SI, in steps of a second", partial(scene, [(0, 0, 0), (4e-10, 0, 0)], argon,
        mass=6.6e-26), within(4e-10, 2.0), 10, {"dt": 1.0}, names="LennardJones")
    yield Row("argon in SI, with masses of 1", partial(scene, [(0, 0, 0), (4e-10, 0, 0)], argon),
        path(lambda t: np.tile([(0, 0, 0), (4e-10, 0, 0)], (len(t), 1, 1))), 10, {"dt": 1e-12})


def of_resolution():
    for far in (1e6, 1e7, 1e8):
        yield Row(f"a spring at {far:g}", partial(scene, [(far, 0, 0), (far + 1.2, 0, 0)],
            ps.Springs([(0, 1)], 100.0, 1.0)), equal(lambda done: done.energy[0, 0], 2.0, 0.01), 5,
            STEP, names="Springs")
    hit = [(0, 0, 0), (0.5, 0, 0)]
    for far in (1e6, 1e7):
        yield Row(f"grains that collide at {far:g}", partial(scene, np.array(hit) + far,
            ps.Contact(restitution=1.0), radius=0.1, velocity=[(1, 0, 0), (-1, 0, 0)]),
            slower_than(1.0, 1.1), 40, STEP, names="Contact")
    yield Row("a rod at 1e7", partial(scene, [(1e7, 0, 0), (1e7 + 1.2, 0, 0)], ps.Distance([(0, 1)],
        1.2)), slower_than(0.1), 20, STEP, names="Distance")
    yield Row("a double star at 1e8", partial(scene, [(1e8, 0, 0), (1e8 + 1, 0, 0)], ps.Gravity(),
        mass=0.5, velocity=[(0, 0.5, 0), (0, -0.5, 0)]), energy_kept(0.1), 60, {"dt": 0.1,
        "substeps": 10}, names="Gravity")
    yield Row("a drift to where grains are no longer told apart", partial(scene, hit, ps.Contact(),
        radius=0.1, velocity=(1e7, 0, 0)), never, 20, {"dt": 1.0, "substeps": 10},
        names="Contact|within the bounds")
    for name, part, of in (
        ("k = 1e-46", ps.Springs([(0, 1)], 1e-46, 0.5), "stiffness"),
        ("G = 1e-60", ps.Gravity(G=1e-60), "constant"),
        ("a compliance of 1e-50", ps.Distance([(0, 1)], 1.0, compliance=1e-50), "compliance"),
        ("a gravity of 1e40", ps.UniformGravity((0, 1e40, 0)), "acceleration"),
        ("a drag of 1e39", ps.Drag(1e39), "linear"),
        ("a cutoff of 1e-25", ps.LennardJones(sigma=1e-25, cutoff=1e-25), "cutoff"),
    ):
        yield Row(f"in single precision, {name}", partial(scene, TWO, part), never, names=of)
    for mass in (1e-42, 1e39):
        yield Row(f"in single precision, a mass of {mass}", partial(scene, TWO, mass=mass), never,
            names="mass")
    small = np.array(TWO) * 1e-25
    yield Row("in single precision, lengths of 1e-25", partial(scene, small, ps.Springs([(0, 1)],
        1.0, 0.5e-25)), never, names="distances")
    yield Row("a clock of 1e5 periods", partial(scene, [(0, 0, 0)], ps.ParticleForce(laws.shaking,
        omega=2 * np.pi, strength=1.0)), within(0.06, 1.5), 60, {"dt": 0.1, "substeps": 20},
        act=lambda sim, frame: sim.state.time.assign(np.array([1e5 + 0.1 * frame])))


def of_masses():
    for ratio in (1e4, 1e6):
        x = [(0, 0, 0), (1.1, 0, 0), (2.3, 0, 0)]
        yield Row(f"springs between masses of {ratio:g} : 1", partial(scene, x, ps.Springs([(0, 1),
            (1, 2)], 1.0, 1.0), mass=[ratio, 1.0, 1.0]), as_fine(), 40, {"dt": 0.3, "substeps": 3,
            **VERLET})
        yield Row(f"springs between masses of {ratio:g} : 1, steps for the heavy one",
            partial(scene, x, ps.Springs([(0, 1), (1, 2)], ratio, 1.0), mass=[ratio, ratio, 1.0]),
            as_fine(), 40, {"dt": 0.3, "substeps": 3, **VERLET}, names="Springs|beyond")


def rows():
    for family in (of_overlaps, of_numbers, of_units, of_resolution, of_masses):
        yield from family()
