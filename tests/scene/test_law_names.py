"""What a law names is read when a simulation is made, and is part of what the law is."""

from types import SimpleNamespace

import numpy as np
import pytest
import warp as wp

import particlesim as ps

K = 1.0
AXIS = wp.vec3(1.0, 0.0, 0.0)
UNITS = SimpleNamespace(axis=wp.vec3(1.0, 0.0, 0.0), scale=1.0, unrelated=object())


@ps.law
def push(position: wp.vec3):
    return wp.vec3(K, 0.0, 0.0)


@ps.law
def along(position: wp.vec3):
    return AXIS


@ps.law
def along_of_units(position: wp.vec3):
    return UNITS.axis * UNITS.scale


@ps.law
def twice(s: float):
    return 2.0 * s


@ps.law
def helped(position: wp.vec3):
    return wp.vec3(twice(1.0), 0.0, 0.0)


TOOLS = SimpleNamespace(twice=twice)


@ps.law
def helped_by_tools(position: wp.vec3):
    return wp.vec3(TOOLS.twice(1.0), 0.0, 0.0)


@wp.func
def warp_twice(s: float):
    return s * 2.0


@ps.law
def helped_by_warp(position: wp.vec3):
    return wp.vec3(warp_twice(1.0), 0.0, 0.0)


def simulated(law, precision):
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0)])
    scene.add_interaction(ps.ParticleForce(law))
    return ps.Simulation(scene, ps.Settings(precision=precision), device="cpu")


def force(sim):
    sim.forces(0.0)
    return sim.get("force")[0, 0]


def redefine(monkeypatch, case):
    """Make what a law of the case names three times what it was; the law."""
    here = globals()

    @ps.law
    def twice(s: float):
        return 6.0 * s

    @wp.func
    def warp_twice(s: float):
        return s * 6.0

    if case == "number":
        monkeypatch.setitem(here, "K", 3.0)
        return push
    if case == "vector":
        monkeypatch.setitem(here, "AXIS", wp.vec3(3.0, 0.0, 0.0))
        return along
    if case in ("vector of an object", "number of an object"):
        name, value = ("axis", wp.vec3(3.0, 0.0, 0.0)) if "vector" in case else ("scale", 3.0)
        monkeypatch.setattr(UNITS, name, value)
        return along_of_units
    if case == "law":
        monkeypatch.setitem(here, "twice", twice)
        return helped
    if case == "law of an object":
        monkeypatch.setattr(TOOLS, "twice", twice)
        return helped_by_tools
    monkeypatch.setitem(here, "warp_twice", warp_twice)
    return helped_by_warp


CASES = [
    ("number", push), ("vector", along), ("vector of an object", along_of_units),
    ("number of an object", along_of_units), ("law", helped), ("law of an object", helped_by_tools),
    ("warp function", helped_by_warp),
]  # fmt: skip


@pytest.mark.parametrize(("case", "law"), CASES, ids=[case for case, _ in CASES])
def test_a_change_is_seen_by_the_next_simulation(case, law, monkeypatch):
    first = simulated(law, "float32")
    before = force(first)
    content = law.content
    assert redefine(monkeypatch, case) is law
    assert law.content != content
    for precision in ("float32", "float64"):  # one used before, one not
        assert force(simulated(law, precision)) == 3 * before
    assert force(first) == before  # it is read once
    monkeypatch.undo()
    assert law.content == content
    assert force(simulated(law, "float32")) == before


def test_what_diagnostics_measure_is_read_with_the_force(monkeypatch):
    @ps.law
    def lift(position: wp.vec3):
        return -K * position[0]

    @ps.law
    def pull(r: float):
        return K * r

    scene = ps.Scene()
    scene.add_particles([(1, 0, 0), (3, 0, 0)])
    scene.add_interaction(ps.ParticleForce(potential=lift))
    scene.add_interaction(ps.PairPotential(pull, cutoff=None))
    sim = ps.Simulation(scene, device="cpu")
    monkeypatch.setitem(globals(), "K", 5.0)
    assert sim.diagnostics().potential == pytest.approx(-4.0 + 2.0)


def test_a_closure_may_change():
    weight = 1.0

    @ps.law
    def weighted(position: wp.vec3):
        return wp.vec3(weight, 0.0, 0.0)

    before = force(simulated(weighted, "float32"))
    weight = 3.0
    forces = [force(simulated(weighted, precision)) for precision in ("float32", "float64")]
    assert np.array_equal(forces, [3 * before] * 2)


def test_nothing_is_made_anew_where_nothing_changed(monkeypatch):
    first, kernel = push.content, simulated(push, "float32").interactions[0].kernel
    monkeypatch.setattr(UNITS, "unrelated", object())
    assert simulated(push, "float32").interactions[0].kernel is kernel
    monkeypatch.setitem(globals(), "K", 2.0)
    assert simulated(push, "float32").interactions[0].kernel is not kernel
    monkeypatch.undo()
    assert push.content == first
    assert simulated(push, "float32").interactions[0].kernel is kernel
