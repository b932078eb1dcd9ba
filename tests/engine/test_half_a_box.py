"""Pairs just half a periodic box apart, for which two images are equally near."""

import numpy as np
import pytest
import warp as wp

import particlesim as ps
from particlesim.engine.model import Model

SIDE = 4


@ps.law
def attraction(r: float, softening: float):
    return -1.0 / wp.sqrt(r * r + softening * softening)


def _forces(scene, precision, device):
    sim = ps.Simulation(scene, ps.Settings(precision=precision), device=device)
    sim.forces(1.0)
    return sim.get("force").astype(np.float64)


@pytest.mark.parametrize("vectorised", [True, False])
@pytest.mark.parametrize("axes", [(0, 1, 2), (1,)])
def test_forces_over_a_lattice_sum_to_zero(axes, vectorised, precision, device, monkeypatch):
    if vectorised and device != "cpu":
        pytest.skip("vectorised loops are for the CPU")
    monkeypatch.setattr(Model, "vectorised", vectorised)
    upper = [SIDE if axis in axes else None for axis in range(3)]
    scene = ps.Scene(periodic=([0 if side else None for side in upper], upper))
    scene.add_particles(ps.sample.lattice("sc", (SIDE,) * 3, 1.0))
    scene.add_interaction(ps.PairPotential(attraction, cutoff=None, softening=0.1))
    force = _forces(scene, precision, device)
    # 64 sums of 63 forces of at most 1, each with the rounding of its size.
    assert np.abs(force.sum(axis=0)).max() <= 64 * 63 * np.finfo(precision).eps
    assert np.abs(force).max() > 1


@pytest.mark.parametrize("lower", [0.0, -3.0])
def test_a_spring_of_half_a_box_pulls_its_ends_oppositely(lower, precision, device):
    scene = ps.Scene(periodic=((lower,) * 3, (lower + 2.0,) * 3))
    scene.add_particles(lower + np.array([(0.5, 1, 1), (1.5, 1, 1), (1.5, 0, 1)]))
    scene.add_interaction(ps.Springs([(0, 1), (1, 2)], stiffness=10.0, rest_length=0.5))
    force = _forces(scene, precision, device)
    np.testing.assert_array_equal(np.abs(force), [(5, 0, 0), (5, 5, 0), (0, 5, 0)])
    np.testing.assert_array_equal(force.sum(axis=0), 0.0)


def test_a_rod_of_half_a_box_shortens_about_its_middle(precision, device):
    scene = ps.Scene(periodic=((0, None, None), (2, None, None)))
    scene.add_particles([(0.5, 0, 0), (1.5, 0, 0)])
    scene.add_constraint(ps.Distance([(0, 1)], rest_length=0.5))
    sim = ps.Simulation(scene, ps.Settings(substeps=1, precision=precision), device=device)
    sim.step()
    moved = sim.position[:, 0] - (0.5, 1.5)
    np.testing.assert_array_equal(np.abs(moved), 0.25)
    assert moved.sum() == 0
