"""Batches: rows that grow, and which scenes are of one kind."""

import numpy as np
import pytest
import warp as wp

import particlesim as ps
from cases.worlds import same, screened


def test_rows_grow_for_one_world_only_in_cost(device):
    # One world contracts until rows overflow and the frame is done again; the other is the same.
    def build(shrink, count=600):
        rng = np.random.default_rng(7)
        x = rng.uniform(-8, 8, (count, 3))
        scene = ps.Scene()
        scene.add_particles(x, velocity=-shrink * x)
        scene.add_interaction(ps.LennardJones(epsilon=1e-3, sigma=0.3, cutoff=2.0))
        return scene

    # Random points overlap, and some pairs part at nonsensical speeds: not the subject here.
    settings = ps.Settings(dt=0.02, substeps=2, skin=0.24, watchdog=False)
    batch = ps.Simulation([build(0.01), build(1.5)], settings, device=device)
    before = batch.neighbors.lists[0].capacity
    batch.run(20)
    assert batch.neighbors.lists[0].capacity > before
    alone = ps.Simulation(build(0.01), settings, device=device)
    alone.run(20)
    assert alone.neighbors.lists[0].capacity == before
    same(batch.world(0), alone)


# Scenes of different kinds ----------------------------------------------------------------------


def plain(group="a", interactions=(), periodic=None, **attributes):
    scene = ps.Scene(periodic=periodic)
    scene.add_particles([(0, 0, 0), (1, 0, 0)], group=group, **attributes)
    for interaction in interactions:
        scene.add_interaction(interaction)
    return scene


@pytest.mark.parametrize(
    ("other", "says"),
    [
        (lambda: plain(interactions=[ps.Gravity()]), r"scenes\[1\].interactions must be of the"),
        (lambda: plain(group="b"), r"scenes\[1\].groups must have the names"),
        (lambda: plain(periodic=((0, 0, 0), (1, 1, 1))), "periodic along the same axes"),
        (lambda: plain(charge=[(0, 0, 1)] * 2), r"scenes\[1\].charge must be numbers"),
    ],
)
def test_scenes_of_different_kinds(other, says, refused):
    with refused(says):
        ps.Simulation([plain(charge=1.0), other()], device="cpu")


@pytest.mark.parametrize(
    ("one", "two"),
    [
        (ps.LennardJones(), ps.Mie(exponents=(9, 6))),
        (ps.Gravity(), ps.UniformGravity()),
        (ps.PairPotential(screened, cutoff=1.0, screening=1.0),
         ps.PairPotential(screened, cutoff=None, screening=1.0)),
        (ps.PairPotential(screened, cutoff=1.0, screening=1.0),
         ps.PairPotential(screened, cutoff=1.0, screening=1.0, charge_i=1.0)),
    ],
)  # fmt: skip
def test_interactions_of_different_kinds(one, two, refused):
    with refused("make a batch of scenes of one kind"):
        ps.Simulation([plain(interactions=[one]), plain(interactions=[two])], device="cpu")


def test_laws_made_anew_for_each_scene_are_of_one_kind(device):
    def build(k):
        @ps.law
        def pull(position: wp.vec3, stiffness: float):
            return -stiffness * position

        @ps.law
        def repel(r: float, strength: float):
            return strength / r

        return plain(interactions=[
            ps.ParticleForce(pull, stiffness=k), ps.PairPotential(repel, cutoff=2.0, strength=k)
        ])  # fmt: skip

    sim = ps.Simulation([build(1.0), build(2.0)], device=device)
    sim.forces(0.0)
    force = sim.get("force")[:, 0]
    np.testing.assert_allclose(force, [-1, 0, -2, 0], atol=1e-6)


def test_worlds_of_no_particles(device):
    empty = ps.Scene()
    empty.add_particles([], group="a")
    empty.add_interaction(ps.LennardJones())
    one = plain(interactions=[ps.LennardJones()])
    sim = ps.Simulation([empty, one, empty], ps.Settings(dt=0.01), device=device)
    sim.run(2)
    np.testing.assert_array_equal(sim.diagnostics().mass, [0, 2, 0])
    assert sim.world(0).position.shape == (0, 3)
    sim.reset([0, 2])
    assert str(sim.explain())
