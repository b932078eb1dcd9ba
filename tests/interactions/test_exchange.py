"""Newton's third law: laws of pairs that are another with i and j exchanged."""

import warnings

import numpy as np
import pytest
import warp as wp

import particlesim as ps


@ps.law
def attract(r: float, charge_i: float, mass_j: float):
    return -charge_i * mass_j / r


@ps.law
def one_sided(r: float, mass_i: float):
    return mass_i / r


@ps.law
def ordered(r: float, kind_i: float, kind_j: float):
    return wp.where(kind_i < kind_j, 1.0, 2.0) * r


@ps.law
def directed(r: float, velocity_i: wp.vec3, velocity_j: wp.vec3):
    return (velocity_i[0] - velocity_j[0]) * r


@ps.law
def mixed(r: float, charge_i: float, mass_j: float, charge_j: float, mass_i: float):
    return -(charge_i * mass_j + charge_j * mass_i) / r


@ps.law
def table(r: float, kind_i: float, kind_j: float, radius_i: float, radius_j: float):
    # Of kinds that are none there is nothing to say.
    known = wp.where(kind_i * kind_j == float(int(kind_i * kind_j)), kind_i * kind_j, wp.nan)
    return known * wp.sqrt(wp.max(radius_i + radius_j - r, 0.0))


@ps.law
def relative(r: float, velocity_i: wp.vec3, velocity_j: wp.vec3):
    return wp.length(velocity_i - velocity_j) * r


@ps.law
def alone(r: float, strength: float):
    return strength / r


def scene_of(part, count=2):
    scene = ps.Scene()
    x = np.random.default_rng(0).uniform(0, 1, (count, 3))
    k = np.arange(count)
    scene.add_particles(x, charge=1.0 - k % 2, kind=k % 3, velocity=(0, 0, 1))
    scene.add_interaction(part)
    return scene


@pytest.mark.parametrize(
    ("law", "names"),
    [
        (attract, "charge_i, mass_j"), (one_sided, "mass_i"), (ordered, "kind_i, kind_j"),
        (directed, "velocity_i, velocity_j"),
    ],
)  # fmt: skip
@pytest.mark.parametrize("cutoff", [None, 2.0])
def test_a_potential_is_refused(law, names, cutoff, refused):
    with refused(f"law {law.name} must be the same with i and j exchanged, got '{names}'"):
        ps.Simulation(scene_of(ps.PairPotential(law, cutoff=cutoff)), device="cpu")


@pytest.mark.parametrize(
    ("law", "given"), [(mixed, {}), (table, {}), (relative, {}), (alone, {"strength": 1.0})]
)
@pytest.mark.parametrize("count", [0, 1, 2, 30])
def test_a_law_of_both_alike_is_taken(law, given, count):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for part in (ps.PairPotential(law, cutoff=2.0, **given),
                     ps.PairForce(law, cutoff=None, **given)):  # fmt: skip
            ps.Simulation(scene_of(part, count), device="cpu")


def test_one_value_for_one_side_is_refused(refused):
    with refused("law mixed must be the same"):
        ps.Simulation(scene_of(ps.PairPotential(mixed, cutoff=1.0, mass_i=2.0)), device="cpu")
    # Both sides' are given.
    ps.Simulation(scene_of(ps.PairPotential(attract, cutoff=1.0, charge_i=2.0, mass_j=1.0)))


def test_one_charged_particle_among_many_is_found(refused):
    @ps.law
    def onto_the_charged(r: float, charge_i: float, charge_j: float):
        return charge_i * (1.0 - charge_j) / r

    scene = ps.Scene()
    x = np.random.default_rng(0).uniform(0, 1, (500, 3))
    scene.add_particles(x, charge=(np.arange(500) == 77).astype(float))
    scene.add_interaction(ps.PairPotential(onto_the_charged, cutoff=0.2))
    with refused("onto_the_charged must be the same"):
        ps.Simulation(scene, device="cpu")


def test_a_force_is_warned_of_once():
    @ps.law
    def chases(r: float, charge_i: float, mass_j: float):
        return -2.0 * charge_i * mass_j / r

    with pytest.warns(UserWarning, match=r"PairForce: law chases .*charge_i, mass_j.*momentum"):
        ps.Simulation(scene_of(ps.PairForce(chases, cutoff=None)), device="cpu")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        ps.Simulation(scene_of(ps.PairForce(chases, cutoff=None)), device="cpu")
