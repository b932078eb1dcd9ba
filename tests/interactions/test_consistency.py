"""Laws that do not fit what they are used for are told when a run begins."""

import warnings

import numpy as np
import pytest
import warp as wp

import particlesim as ps


@ps.law
def pull(position: wp.vec3, center: wp.vec3, charge: float):
    return -charge * (position - center)


@ps.law
def well(position: wp.vec3, center: wp.vec3, charge: float):
    d = position - center
    return 0.5 * charge * wp.dot(d, d)


@ps.law
def twisted(position: wp.vec3, center: wp.vec3, charge: float):
    d = position - center
    return 0.5 * charge * (d[0] * d[0] + d[1] * d[1] + 1.01 * d[2] * d[2])


@ps.law
def driven(position: wp.vec3, time: float):
    return wp.vec3(wp.cos(time), 0.0, 0.0) - position


@ps.law
def level(position: wp.vec3):
    return 0.5 * wp.dot(position, position)


@ps.law
def decaying(r: float, length: float):
    return wp.exp(-r / length) / r


@ps.law
def pulling(r: float, mass_i: float, mass_j: float):
    return -mass_i * mass_j / (r * r)


@ps.law
def growing(r: float, charge_i: float, charge_j: float):
    return -charge_i * charge_j * r


def told(part, box=None):
    """What a run of eight particles warns of."""
    scene = ps.Scene(periodic=box)
    x = np.random.default_rng(0).uniform(1, 9, (8, 3))
    scene.add_particles(x, charge=np.arange(8.0) + 1)
    scene.add_interaction(part)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        ps.Simulation(scene, ps.Settings(dt=1e-6), device="cpu").run(1)
    return [str(each.message) for each in caught]


@pytest.mark.parametrize(
    ("force", "potential", "fits"),
    [
        (pull, well, True),
        (pull, twisted, False),
        (driven, level, True),  # what time does beside it is its own work
        (None, twisted, True),  # derived
    ],
)
def test_a_potential_belongs_to_its_force(force, potential, fits):
    given = {} if potential is level else {"center": (5, 5, 5)}
    said = told(ps.ParticleForce(force, potential=potential, **given))
    assert len(said) == (not fits)
    assert fits or "potential twisted must be that of the force pull, f = -dU/dx" in said[0]


@pytest.mark.parametrize(
    ("part", "left"),
    [
        # 1 / r^2 at 5 and at 5 / 8^(1/3): a quarter.
        (lambda: ps.PairForce(pulling, cutoff=None), 0.25),
        pytest.param(lambda: ps.PairForce(growing, cutoff=None), 2.0, marks=pytest.mark.slow),
        (lambda: ps.PairPotential(decaying, cutoff=None, length=0.3), None),
        (lambda: ps.PairForce(growing, cutoff=2.0), None),
    ],
    ids=["pulling", "growing", "decaying", "cut"],
)
def test_a_force_fades_within_half_a_periodic_box(part, left):
    said = told(part(), box=((0, 0, 0), (10, 10, 10)))
    assert len(said) == (left is not None)
    if left is not None:
        assert f"got {left:.2g} of the force at 2.5 left at 5;" in said[0]
    assert told(part()) == []


@ps.law
def of_products(r: float, mass_i: float, mass_j: float, strength: float):
    return -strength * mass_i * mass_j / (mass_i + mass_j) / (r * r)


@ps.law
def in_order(r: float, mass_i: float, mass_j: float, strength: float):
    return -strength * mass_i * (mass_j / (mass_i + mass_j)) / (r * r)


@ps.law
def lift(position: wp.vec3, mass: float, rate: float):
    return mass * mass * rate * (rate / mass) * position


@pytest.mark.parametrize(
    ("law", "mass", "precision", "left"),
    [
        # 6.6e-26^2 is 0 in single precision, (2e30)^2 is infinite; the force is neither.
        (of_products, 6.6e-26, "float32", "0"),
        (of_products, 2e30, "float32", "-inf"),
        (of_products, 6.6e-26, "float64", None),
        (in_order, 6.6e-26, "float32", None),
        (in_order, 2e30, "float32", None),
        (of_products, 1.0, "float32", None),
        (lift, 6.6e-26, "float32", "0"),
        (lift, 1.0, "float32", None),
    ],
)
def test_products_of_a_law_are_held_against_the_precision(law, mass, precision, left):
    scene = ps.Scene()
    scene.add_particles([(1, 1, 1), (2, 0, 0), (0, 2, 1)], mass=mass, pinned=True)
    scene.add_interaction(
        ps.ParticleForce(law, rate=1.0)
        if law is lift
        else ps.PairForce(law, cutoff=None, strength=1e-3)
    )
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        ps.Simulation(scene, ps.Settings(precision=precision), device="cpu").run(0)
    said = [str(each.message) for each in caught]
    assert len(said) == (left is not None), said
    if left is not None:
        assert f"law {law.name} must stay within float32, products of it too, got" in said[0]
        assert f"got {left} for " in said[0].replace("got -0 ", "got 0 ")
