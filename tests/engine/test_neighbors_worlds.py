"""Lists in a batch: each world has the rows, the passes and the sums that it has alone."""

import functools

import numpy as np
import pytest
import warp as wp

import particlesim as ps
from cases.worlds import equal_alone


@ps.law
def yukawa(r: float, charge_i: float, charge_j: float, screening: float):
    return charge_i * charge_j * wp.exp(-r / screening) / r


@ps.law
def soft(r: float, reach: float, stiffness: float):
    overlap = wp.max(reach - r, 0.0)
    return 0.5 * stiffness * overlap * overlap


SIDE = 12.0
SETTINGS = {"dt": 0.02, "substeps": 6}


def crowd(count, seed=0, *, others=0, radius=0.0):
    """A periodic box of particles on a jittered lattice, and some of another group."""
    rng = np.random.default_rng(seed)
    edge = max(1, int(np.ceil((count + others) ** (1 / 3))))
    x = ps.sample.lattice("sc", (edge,) * 3, SIDE / edge)[rng.permutation(edge**3)]
    x = x + rng.uniform(-0.05, 0.05, x.shape)
    scene = ps.Scene(periodic=((0, 0, 0), (SIDE,) * 3))
    for rows, name in ((slice(count), "main"), (slice(count, count + others), "other")):
        v = rng.normal(0, 1, x[rows].shape)
        scene.add_particles(x[rows], velocity=v, charge=0.5, radius=radius, group=name)
    return scene


def two_cutoffs(count, second, first=1.5):
    """Two pair forces, whose cutoffs are or are not alike, with another force in between."""
    scene = crowd(count)
    scene.add_interaction(ps.PairPotential(soft, cutoff=first, reach=first, stiffness=20.0))
    scene.add_interaction(ps.UniformGravity((0, -0.3, 0)))
    scene.add_interaction(ps.PairPotential(yukawa, cutoff=second, screening=0.7))
    return scene


def three_cutoffs(count, *cutoffs):
    """Three pair forces: which of them go together differs."""
    scene = crowd(count, 1)
    for k, cutoff in enumerate(cutoffs):
        scene.add_interaction(
            ps.PairPotential(soft, cutoff=cutoff, reach=cutoff, stiffness=5.0 + k)
        )
    return scene


def touching(count, cutoff, radius):
    """Contacts, which renew their list after the integration, and a force, which does it before."""
    scene = crowd(count, 2, radius=radius)
    scene.add_interaction(ps.PairPotential(soft, cutoff=cutoff, reach=cutoff, stiffness=5.0))
    scene.add_constraint(ps.Contact(friction=0.3, restitution=0.5))
    return scene


def fluid(count, cutoff):
    """SPH and a pair force beside it."""
    scene = crowd(count, 3)
    scene.add_interaction(ps.SPH(smoothing_length=1.2, rest_density=1.0,
                                 equation_of_state=ps.Tait(sound_speed=5.0),
                                 viscosity=ps.ArtificialViscosity(0.1)))  # fmt: skip
    scene.add_interaction(ps.PairPotential(yukawa, cutoff=cutoff, screening=0.5))
    return scene


def groups(others):
    """A force on a group that is all there is only where ``others`` is 0."""
    scene = crowd(200, 4, others=others)
    main = scene.groups[0]
    scene.add_interaction(ps.PairPotential(soft, main, cutoff=2.0, reach=2.0, stiffness=9.0))
    scene.add_interaction(ps.PairPotential(yukawa, cutoff=2.1, screening=0.7))
    scene.add_interaction(ps.PairPotential(yukawa, main, cutoff=None, screening=0.1))
    scene.add_interaction(ps.PairPotential(yukawa, cutoff=None, screening=0.2))
    return scene


CASES = {
    "two cutoffs, small worlds": (two_cutoffs, [(90, 1.6), (90, 4.0), (90, 1.5)]),
    "two cutoffs, large worlds": (two_cutoffs, [(700, 3.5), (700, 1.6)]),
    "the first wider than the second": (two_cutoffs, [(90, 1.6, 1.7), (90, 1.6, 5.0)]),
    "three cutoffs": (
        three_cutoffs,
        [(120, 1.5, 1.6, 1.7), (120, 1.5, 4, 1.6), (120, 1.5, 4, 4.1), (120, 1.5, 2.5, 4.5)],
    ),
    "contacts and a force": (touching, [(150, 1.5, 0.7), (150, 4.0, 0.7)]),
    "contacts of points": (touching, [(150, 1.5, 0.7), (150, 1.5, 0.0)]),
    "fluid and a force": (fluid, [(150, 2.2), (150, 4.5)]),
    "groups": (groups, [(0,), (60,)]),
    "an empty world": (two_cutoffs, [(90, 1.6), (0, 4.0)]),
}


ALIKE = {
    "groups", "the first wider than the second", "two cutoffs, large worlds",
    "two cutoffs, small worlds", "fluid and a force", "three cutoffs", "an empty world",
}  # fmt: skip


@pytest.mark.parametrize("precision", ["float64", pytest.param("float32", marks=pytest.mark.slow)])
@pytest.mark.parametrize("backwards", [True, pytest.param(False, marks=pytest.mark.slow)])
@pytest.mark.parametrize(
    "case", [pytest.param(k, marks=[pytest.mark.slow] * (k in ALIKE)) for k in CASES]
)
def test_a_world_goes_as_it_goes_alone(case, backwards, precision, device):
    """Bit for bit, whatever the other worlds' cutoffs, in either order."""
    build, worlds = CASES[case]
    worlds = worlds[::-1] if backwards else worlds
    settings = ps.Settings(**SETTINGS, precision=precision)
    simulate = functools.partial(ps.Simulation, settings=settings)
    equal_alone(simulate, [build(*each) for each in worlds], device, 15)


def test_worlds_that_agree_have_no_more_than_one_world(device):
    """The same lists and passes as one of them, and no parameters masked."""
    alone = ps.Simulation(two_cutoffs(90, 1.6), device=device)
    batch = ps.Simulation([two_cutoffs(90, c) for c in (1.5, 1.6, 1.8)], device=device)
    assert [each.users for each in batch.neighbors.lists] == [
        each.users for each in alone.neighbors.lists
    ]
    assert [each.name for each in batch.loop.passes] == [each.name for each in alone.loop.passes]
    assert len(alone.loop.passes) == 2


def test_worlds_that_differ_each_have_their_passes(device):
    """One pass for both forces where they share, one each where they do not."""
    batch = ps.Simulation([two_cutoffs(90, c) for c in (1.6, 4.0)], device=device)
    assert len(batch.neighbors.lists) == 2
    assert sorted(each.name for each in batch.loop.passes) == [
        "PairPotential", "PairPotential", "PairPotential + PairPotential", "UniformGravity",
    ]  # fmt: skip


def test_a_checkpoint_of_worlds_that_differ(tmp_path, device):
    """Goes on bit for bit, and so does a world that is reset."""
    build, worlds = CASES["contacts and a force"]
    scenes = [build(*each) for each in worlds]
    sim = ps.Simulation(scenes, ps.Settings(**SETTINGS), device=device)
    sim.run(10)
    sim.save(tmp_path / "half.npz")
    loaded = ps.Simulation.load(tmp_path / "half.npz", scenes, device=device)
    for each in (sim, loaded):
        each.run(10)
    np.testing.assert_array_equal(sim.position, loaded.position)
    first = sim.world(1).position
    sim.reset([1])
    sim.run(20)
    np.testing.assert_array_equal(sim.world(1).position, first)
