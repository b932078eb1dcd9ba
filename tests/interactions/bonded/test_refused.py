"""Bonds, angles and dihedrals that cannot be."""

import numpy as np
import pytest
import warp as wp

import particlesim as ps
from cases.parts import bending, screened, torsion


@ps.law
def whole(r: float, power: int):
    return wp.pow(r, float(power))


@ps.law
def placed(r: float, position_i: wp.vec3):
    return r * position_i[0]


@ps.law
def of_a_vector(d: wp.vec3, strength: float):
    return strength * wp.length(d)


REFUSED = {
    "two for an angle": (lambda: ps.HarmonicAngles([(0, 1)], 1.0, 1.0), r"triples .*\(m, 3\)"),
    "three for a dihedral": (
        lambda: ps.Dihedrals([(0, 1, 2)], torsion, epsilon=1.0), r"quadruples .*\(m, 4\)"
    ),
    "one twice": (lambda: ps.Angles([(0, 1, 0)], bending, epsilon=1.0), r"triples\[0\] .* differ"),
    "one backwards": (
        lambda: ps.Angles([(0, 1, 2), (2, 1, 0)], bending, epsilon=1.0), r"each of its 1 different"
    ),
    "too many": (
        lambda: ps.Bonds([(0, 1)], screened, strength=[1.0, 2.0], reach=1.0), r"strength .*\(1,\)"
    ),
    "none": (lambda: ps.Bonds([(0, 1)], screened, strength=1.0), "reach must be given"),
    "not whole": (lambda: ps.Bonds([(0, 1)], whole, power=2.5), "power must be whole"),
    "a place": (lambda: ps.Bonds([(0, 1)], placed), "got 'position'"),
    "a vector": (
        lambda: ps.Bonds([(0, 1)], of_a_vector, strength=1.0),
        "take the length first, as a float, got 'd'",
    ),
    "stiffness": (lambda: ps.HarmonicBonds([(0, 1)], -1.0, 1.0), r"stiffness\[0\] .* at least 0"),
    "rest": (lambda: ps.HarmonicBonds([(0, 1)], 1.0, -1.0), r"rest_length\[0\] .* at least 0"),
    "length": (lambda: ps.FENEBonds([(0, 1)], length=0.0), r"length\[0\] must be above 0"),
    "degrees": (lambda: ps.HarmonicAngles([(0, 1, 2)], 1.0, 109.5), r"rest_angle\[0\] .* most pi"),
}  # fmt: skip


@pytest.mark.parametrize("name", REFUSED)
def test_what_cannot_be(name, refused):
    make, says = REFUSED[name]
    with refused(says):
        make()


def test_a_parameter_that_the_law_does_not_have(refused):
    with refused("parameter of screened must be one of strength, reach", TypeError):
        ps.Bonds([(0, 1)], screened, strength=1.0, reach=1.0, length=2.0)


def pair(distance, periodic=None, speed=0.0):
    scene = ps.Scene(periodic=periodic)
    scene.add_particles([(0, 0, 0), (distance, 0, 0)], velocity=[(0, 0, 0), (speed, 0, 0)])
    return scene


def refuse(scene, part, says, refused):
    scene.add_interaction(part)
    with refused(says):
        ps.Simulation(scene, device="cpu")


def test_what_the_scene_does_not_have(refused):
    refuse(pair(1.0), ps.HarmonicBonds([(0, 2)], 1.0), "pairs must hold indices .* got 2", refused)

    @ps.law
    def charged(r: float, charge_j: float):
        return charge_j / r

    refuse(pair(1.0), ps.Bonds([(0, 1)], charged), "charge must be given or be one", refused)


@pytest.mark.parametrize("distance", [1.5, 1.7])
def test_a_bond_that_starts_too_long(distance, refused):
    says = r"FENEBonds: length\[0\] must be above the distance of the ends .*, got 1.5; .* closer"
    refuse(pair(distance), ps.FENEBonds([(0, 1)]), says, refused)


def test_a_bond_of_more_than_half_a_box(refused):
    box = ((0, None, None), (2.5, None, None))
    refuse(pair(1.0, box), ps.FENEBonds([(0, 1)]), r"length\[0\] must be at most half", refused)


def test_a_bond_that_a_step_tears(device):
    """Past its length the slope of its energy would push its ends apart: it is told instead."""
    scene = pair(1.2, speed=30.0)
    scene.add_interaction(ps.FENEBonds([(0, 1)]))
    sim = ps.Simulation(scene, ps.Settings(dt=0.5, precision="float64"), device=device)
    with pytest.raises(ps.SimulationError, match=r"of particle \d in world 0 .* look at FENEBonds"):
        sim.run(4)
    assert np.isfinite(sim.position).all()
