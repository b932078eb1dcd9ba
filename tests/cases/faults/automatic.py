"""Steps that are chosen by the program: right over the run, or stopped."""

from functools import partial

import particlesim as ps

from . import laws
from .judge import EULER, VERLET, Row, scene, slower_than, trend_kept, within
from .steps import atoms, comet, couple, spring, turning

# A table, laid out by hand.
# fmt: off

METHODS = {"Euler": EULER, "Verlet": VERLET}
WELL = {"depth": 1.0, "width": 6.0, "rest": 1.0}
PULL = {"strength": -1.0, "screening": 1.0}


def trapped(law, x, v=(0, 0, 0), **parameters):
    return scene([x], ps.ParticleForce(potential=law, **parameters), velocity=v)


def liquid():
    x = ps.sample.lattice("fcc", (3, 3, 3), 1.7)
    v = ps.sample.maxwell_boltzmann(len(x), 1.0, 1.0, seed=0)
    return scene(x, ps.LennardJones(cutoff=2.5, truncation="force_shift"),
        box=((0, 0, 0), (5.1,) * 3), velocity=v)


def dragged():
    return scene([(0, 0, 0)], ps.ConstantForce((1e4, 0, 0)), ps.Drag(quadratic=1.0))


def stiffened():
    return scene([(1, 0, 0)], ps.ParticleForce(laws.stiffening, rate=0.2))


def braked():
    return scene([(0, 0, 0)], ps.Drag(100.0), velocity=(1, 0, 0))


# By name: the scene, what is held against it, frames.
SCENES = {
    "a spring": (spring, trend_kept(), 200),
    "a chain of springs": (partial(spring, count=20), trend_kept(), 200),
    "a liquid": (liquid, trend_kept(), 100),
    "atoms at rest at 1.3": (partial(atoms, 1.3), trend_kept(least=1.0), 300),
    "atoms that meet at 30": (partial(atoms, 3.9, 30.0), trend_kept(), 100),
    "Morse, at rest at 1.8": (partial(couple, laws.morse, 1.8, **WELL), trend_kept(least=1.0), 300),
    "attracting Yukawa": (partial(couple, laws.yukawa, 3.0, across=0.3, **PULL),
        trend_kept(least=1.0), 300),
    "quartic trap from 5": (partial(trapped, laws.quartic, (5, 0, 0), strength=1.0), trend_kept(),
        300),
    "quartic trap from 0.01": (partial(trapped, laws.quartic, (0.01, 0, 0), (0, 10, 0),
        strength=1.0), trend_kept(), 300),
    "a free flight into a wall": (partial(trapped, laws.wall, (0, 0, 0), (1, 0, 0),
        stiffness=1e4, place=10.0), trend_kept(), 100),
    "a comet of e = 0.6": (partial(comet, 0.6), within(1.6, 1.1), 200),
    "a comet of e = 0.95": (partial(comet, 0.95), within(1.95, 1.1), 200),
    "a comet of e = 0.9 by a law": (partial(comet, 0.9, laws.inverse_square), within(1.9, 1.1),
        200),
    "a magnetic field": (turning, slower_than(1.0, 1.05), 200),
    "drag": (braked, slower_than(1.0, 1.0), 50),
    "a drag race": (dragged, slower_than(100.0, 1.05), 100),
    "a trap that stiffens in time": (stiffened, within(1.0, 1.1), 100),
}


def rows():
    for name, (build, miss, frames) in SCENES.items():
        for method, knobs in METHODS.items():
            for substeps in (1, 10):
                few = substeps == 1 and method == "Verlet"
                yield Row(f"{name}, {method}, dt automatic, {substeps} substeps", build, miss,
                    frames, {"dt": "auto", "substeps": substeps, **knobs}, slow=not few)
            yield Row(f"{name}, {method}, substeps automatic", build, miss, frames,
                {"dt": 0.1, "substeps": "auto", **knobs}, slow=True)
