"""What interactions refuse, and that they may have nobody to act on."""

import numpy as np
import pytest
import warp as wp

import particlesim as ps


@ps.law
def bond(r: float, stiffness: float):
    return 0.5 * stiffness * r * r


@ps.law
def clash(r: float, cutoff_squared: float):
    return r * cutoff_squared


@ps.law
def nothing():
    return 1.0


@ps.law
def screened(r: float, charge_i: float, charge_j: float, screening: float = 0.7):
    return charge_i * charge_j * wp.exp(-r / screening) / r


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda: ps.LennardJones(epsilon=-1.0), r"epsilon must be at least 0 \[energy\]"),
        (lambda: ps.LennardJones(sigma=0.0), r"sigma must be above 0 \[length\]"),
        (lambda: ps.LennardJones(sigma=np.nan), "sigma must be finite"),
        (lambda: ps.LennardJones(cutoff=np.inf), "cutoff must be finite"),
        (lambda: ps.Mie(exponents=12), "exponents must be two, got 12"),
        (lambda: ps.Mie(exponents=(6, 12)), "exponents must fall"),
        (lambda: ps.Mie(exponents=(12.5, 6)), "whole number"),
        (lambda: ps.LennardJones(truncation="shifted"), "did you mean 'shift'"),
        (lambda: ps.Mie(exponents=(9, 3)).tail(0.8), "exponents must be above 3"),
        (lambda: ps.Gravity(G=np.nan), "G must be finite"),
        (lambda: ps.Gravity(softening=-0.1), "softening must be at least 0"),
        (lambda: ps.UniformGravity(9.81), r"shape \(3,\)"),
        (lambda: ps.UniformGravity((0, np.nan, 0)), "finite"),
        (lambda: ps.ConstantForce((0, 1)), r"shape \(3,\)"),
        (lambda: ps.Drag(linear=-1.0), r"linear must be at least 0 \[mass/time\]"),
        (lambda: ps.Drag(flow=3.0), "flow"),
        (lambda: ps.Springs([(0, 0)], 1.0), r"pairs\[0\] must name different particles"),
        (lambda: ps.Springs([(0, 1, 2)], 1.0), r"shape \(m, 2\)"),
        (lambda: ps.Springs([(0, 1.5)], 1.0), "of indices"),
        (lambda: ps.Springs([(-1, 1)], 1.0), "from 0 up"),
        (lambda: ps.Springs([(0, 1)], -1.0), r"stiffness\[0\] must be at least 0"),
        (lambda: ps.Springs([(0, 1)], np.nan), r"stiffness\[0\] must be finite"),
        (lambda: ps.Springs([(0, 1)], [1, 2]), r"shape \(\) or \(1,\)"),
        (lambda: ps.Springs([(0, 1)], 1.0, -1.0), r"rest_length\[0\] must be at least 0"),
        (lambda: ps.PairPotential(bond, cutoff=-1.0, stiffness=1.0), "cutoff must be above 0"),
        (lambda: ps.PairPotential(bond, cutoff=1.0), "stiffness must be given, as bond"),
        (lambda: ps.PairPotential(bond, cutoff=1.0, stiffness="k"), "must be a number"),
        (lambda: ps.PairPotential(bond, cutoff=1.0, stiffness=np.nan), "must be finite"),
        (lambda: ps.PairPotential(clash, cutoff=1.0, cutoff_squared=1.0), "a name of its own"),
        (lambda: ps.PairPotential(nothing, cutoff=1.0), "take the distance r"),
    ],
)
def test_bad_parameters(make, says, refused):
    with refused(says):
        make()


@pytest.mark.parametrize(
    "make",
    [
        lambda: ps.PairPotential(bond, cutoff=1.0, stifness=1.0),
        lambda: ps.PairForce(bond, cutoff=1.0, stifness=1.0),
        lambda: ps.ParticleForce(bond, r=1.0, stifness=1.0),
    ],
)
def test_unknown_parameters(make, refused):
    with refused("got 'stifness'; did you mean 'stiffness'", kind=TypeError):
        make()


@pytest.mark.parametrize(
    ("group", "says"),
    [
        ("wader", "one of .*, got 'wader'"),
        ([0.5], "groups, their names or indices"),
        ([0, 99], "from 0 to 3, got 99"),
        ([-1], "from 0 to 3, got -1"),
        (np.array([True, False]), r"have shape \(4,\) where it is True and False"),
    ],
)
def test_bad_groups(group, says, refused, cluster):
    scene = cluster(4)
    scene.add_interaction(ps.Gravity(group))
    with refused(f"Gravity: group must .*{says}"):
        ps.Simulation(scene, device="cpu")


def test_a_group_of_another_scene(refused, cluster):
    scene = cluster(4)
    scene.add_interaction(ps.Gravity(cluster(4).groups[0]))
    with refused("group must belong to the scene"):
        ps.Simulation(scene, device="cpu")


def test_an_attribute_that_is_not_there(refused, cluster):
    scene = cluster(4)
    scene.add_interaction(ps.PairPotential(screened, cutoff=1.0))
    with refused("charge must be given or be one of the particles' density, mass"):
        ps.Simulation(scene, device="cpu")


def test_springs_to_a_particle_that_is_not_there(refused, cluster):
    scene = cluster(4)
    scene.add_interaction(ps.Springs([(0, 4)], 1.0))
    with refused("pairs must hold indices from 0 to 3, got 4"):
        ps.Simulation(scene, device="cpu")


EMPTY = [
    lambda none: ps.LennardJones(none),
    lambda none: ps.Gravity(none),
    lambda none: ps.UniformGravity(group=none),
    lambda none: ps.Drag(1.0, group=none),
    lambda none: ps.Springs([], 1.0),
]


@pytest.mark.parametrize("make", EMPTY)
@pytest.mark.parametrize("count", [0, 1])
def test_nobody_to_act_on(make, count, device, simulate):
    scene = ps.Scene()
    scene.add_particles(np.zeros((count, 3)), velocity=(1, 0, 0))
    none = scene.add_particles([], group="none")
    scene.add_interaction(make(none))
    sim = simulate(scene, device, dt=0.1)
    sim.step()
    assert str(sim.explain())
    assert sim.diagnostics().potential[0] == 0
    np.testing.assert_allclose(sim.position, np.array([[0.1, 0, 0]] * count).reshape(-1, 3), 1e-6)
