"""Sweeps over tuples: that of the CPU's vector units against Warp's own, which is the reference."""

import numpy as np
import pytest

import particlesim as ps
from particlesim.engine.model import Model

COUNT = 151  # particles: colours fill some groups of tuples, and some tuples are left over


def tuples(size):
    """Neighbours along a line, every second of them the other way round, and some far ones."""
    near = np.arange(COUNT - size + 1)[:, None] + np.arange(size)
    near[::2] = near[::2, ::-1]
    return near if size == 1 else np.concatenate([near, np.sort(near * 7 % COUNT, axis=1)[:9]])


def places():
    """A line of particles, two of them in one place."""
    x = np.arange(COUNT)[:, None] * (0.9, 0.1, 0.0)
    x += np.random.default_rng(3).uniform(-0.2, 0.2, (COUNT, 3))
    x[40] = x[41]
    return x


def solid():
    """Those of four particles that are no flat ones."""
    return tuples(4)[np.isfinite(ps.Volume.quantity(places()[tuples(4)]))]


def distance(**options):
    return lambda laws: ps.Distance(tuples(2), rest_length=0.9, compliance=1e-4, **options)


CASES = {
    "soft": distance(),
    "rigid": lambda laws: ps.Distance(tuples(2)),
    "rope": distance(tension_only=True),
    "strut": distance(inequality=True),
    "damped in part": distance(damping=np.arange(len(tuples(2))) % 3 * 0.1),
    "breakable": distance(break_force=800.0),
    "one": lambda laws: ps.Constraint(laws.reach, tuples(1), anchor=(9, 9, 0), length=8.0),
    "two": lambda laws: ps.Constraint(
        laws.distance, tuples(2), rest_length=0.9, compliance=1e-4, damping=0.1
    ),
    "three": lambda laws: ps.Constraint(laws.angle, tuples(3), rest_angle=2.9, inequality=True),
    "four": lambda laws: ps.Constraint(laws.volume, tuples(4), rest_volume=0.05, compliance=1e-5),
}
KINDS = {
    "Angle": lambda laws: ps.Angle(tuples(3), 2.9, compliance=1e-3),
    "Area": lambda laws: ps.Area(tuples(3), 0.1, compliance=1e-4),
    "Attachment": lambda laws: ps.Attachment(tuples(1), (9, 9, 0), compliance=1e-2),
    "Bending": lambda laws: ps.Bending(tuples(4), 0.3, compliance=1e-3, yield_angle=0.1),
    "IsometricBending": lambda laws: ps.IsometricBending(solid(), compliance=1e-3),
    "NeoHookean": lambda laws: ps.NeoHookean(solid(), 1e3, 0.3),
    "Volume": lambda laws: ps.Volume(tuples(4), 0.05, compliance=1e-4),
}
PERIODIC = {"breakable", "three", "Bending", "NeoHookean"}
PLAIN = {"rope", "two"}  # without compensated sums


def moved(constraint, periodic, **knobs):
    """The line of particles after a few substeps, some of them held."""
    rng, x = np.random.default_rng(5), places()
    scene = ps.Scene(periodic=((-5.0,) * 3, (140.0,) * 3) if periodic else None)
    scene.add_particles(
        x, velocity=rng.normal(size=x.shape), mass=rng.uniform(1.0, 2.0, COUNT),
        pinned=np.arange(COUNT) % 29 == 0,
    )  # fmt: skip
    scene.add_constraint(constraint)
    settings = ps.Settings(dt=0.02, substeps=4, iterations=2, watchdog=False, **knobs)
    sim = ps.Simulation(scene, settings, device="cpu")
    for _ in range(3):
        sim.step()
    return sim


@pytest.mark.parametrize("precision", ["float32", "float64"])
@pytest.mark.parametrize(
    "name", [*CASES, *(pytest.param(n, marks=pytest.mark.slow) for n in KINDS)]
)
def test_lanes_make_the_bits_of_one_after_the_other(name, precision, laws, monkeypatch):
    """Nothing is summed across tuples, so that not one bit may differ."""
    results = []
    for vectorised in (True, False):
        monkeypatch.setattr(Model, "vectorised", vectorised)
        knobs = {"precision": precision, "compensated": name not in PLAIN}
        sim = moved((CASES | KINDS)[name](laws), name in PERIODIC, **knobs)
        part = sim.constraints[0]
        arrays = {key: each.numpy() for key, each in sim.state.arrays.items()}
        results.append({**arrays, "lam": sim.force(part), "broken": sim.broken(part)})
    fast, plain = results
    assert {key: each.tobytes() for key, each in fast.items()} == {
        key: each.tobytes() for key, each in plain.items()
    }
    assert fast["broken"].any() == (name == "breakable")
    assert not fast["broken"].all()
