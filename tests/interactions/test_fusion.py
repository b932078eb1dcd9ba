"""Pair forces that share a list, in one pass."""

import numpy as np
import pytest
import warp as wp

import particlesim as ps


@ps.law
def yukawa(r: float, strength: float, screening: float):
    return strength * wp.exp(-r / screening) / r


@ps.law
def soft(r: float, reach: float, stiffness: float):
    # Not defined beyond its reach: in a shared pass it must not be asked there.
    return stiffness * wp.sqrt(reach - r)


def liquid(*interactions):
    """A jittered crystal with some interactions."""
    scene = ps.Scene(periodic=((0, 0, 0), (12, 12, 12)))
    rng = np.random.default_rng(1)
    x = ps.sample.lattice("fcc", (7, 7, 7), 12 / 7)
    scene.add_particles(x + rng.normal(0, 0.05, x.shape), charge=rng.normal(size=len(x)))
    for make in interactions:
        scene.add_interaction(make())
    return scene


def lennard_jones():
    return ps.LennardJones(cutoff=2.5)


def screened():
    return ps.PairPotential(yukawa, cutoff=2.2, strength=1.0, screening=0.7)


def pushing():
    return ps.PairForce(soft, cutoff=2.1, reach=2.1, stiffness=0.3)


def forces(scene, precision, device):
    sim = ps.Simulation(scene, ps.Settings(precision=precision), device=device)
    sim.forces(0.01)
    return sim.get("force"), sim


def test_one_pass_gives_the_sum_of_the_forces(precision, device):
    parts = [forces(liquid(make), precision, device)[0] for make in
             (lennard_jones, screened, pushing)]  # fmt: skip
    together, sim = forces(liquid(lennard_jones, screened, pushing), precision, device)
    assert [each.name for each in sim.loop.passes] == ["LennardJones + PairPotential + PairForce"]
    # About 80 neighbours with forces up to 1e2 each: their sum in another order.
    tolerance = 80 * 1e2 * np.finfo(together.dtype).eps
    np.testing.assert_allclose(together, sum(parts), rtol=0, atol=tolerance)


def test_each_still_reports_its_own_energy(device):
    settings = ps.Settings(precision="float64")

    def potential(*makes):
        return ps.Simulation(liquid(*makes), settings, device=device).diagnostics().potential[0]

    both = potential(lennard_jones, screened)
    assert both == pytest.approx(potential(lennard_jones) + potential(screened), rel=1e-13)


def test_other_groups_and_other_cutoffs_are_passes_of_their_own():
    scene = liquid(lennard_jones)
    scene.add_interaction(ps.LennardJones(np.arange(700), cutoff=2.5))
    scene.add_interaction(ps.LennardJones(cutoff=5.0))
    scene.add_interaction(ps.UniformGravity())
    sim = ps.Simulation(scene, device="cpu")
    assert len(sim.loop.passes) == 4


def test_parameters_are_per_world(device):
    def scene(strength):
        result = liquid(lennard_jones)
        result.add_interaction(
            ps.PairPotential(yukawa, cutoff=2.2, strength=strength, screening=0.7)
        )
        return result

    settings = ps.Settings(precision="float64")
    batch = ps.Simulation([scene(1.0), scene(3.0)], settings, device=device)
    batch.forces(0.01)
    for w, strength in enumerate((1.0, 3.0)):
        alone, _ = forces(scene(strength), "float64", device)
        np.testing.assert_array_equal(batch.world(w).get("force"), alone)


def test_one_law_twice(precision, device):
    # The same laws with other parameters, given as laws or as plain functions.
    def plain(r: float, strength: float):
        return strength / r

    def weak():
        return ps.LennardJones(epsilon=0.1, cutoff=2.4)

    def repelling():
        return ps.PairPotential(plain, cutoff=2.3, strength=0.3)

    makes = (lennard_jones, weak, repelling, repelling)
    parts = [forces(liquid(make), precision, device)[0] for make in makes]
    together, sim = forces(liquid(*makes), precision, device)
    assert len(sim.loop.passes) == 1
    tolerance = 80 * 1e2 * np.finfo(together.dtype).eps  # as above
    np.testing.assert_allclose(together, sum(parts), rtol=0, atol=tolerance)
