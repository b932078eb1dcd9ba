"""Bonds, angles and dihedrals: closed forms, lines, conventions and limits."""

import math

import numpy as np
import pytest
import warp as wp

import particlesim as ps
from cases.parts import bending
from cases.stability import limit, simulation


@ps.law
def turning(dihedral: float, torque: float):
    return torque * dihedral


def forces(x, part, precision="float64", device="cpu"):
    """Forces, potential energy and virial of a part at some places."""
    scene = ps.Scene()
    scene.add_particles(x)
    scene.add_interaction(part)
    sim = ps.Simulation(scene, ps.Settings(precision=precision), device=device)
    sim.forces(0.0)
    return sim.get("force").astype(float), sim.diagnostics().potential[0]


# Lengths ------------------------------------------------------------------------------------------


def test_a_fene_bond_pulls_as_kremer_and_grest_have_it(device):
    r = np.linspace(0.1, 1.4, 14)
    x = np.zeros((28, 3))
    x[1::2, 0] = r
    force, energy = forces(x, ps.FENEBonds(np.arange(28).reshape(14, 2)), device=device)
    s = 1 - (r / 1.5) ** 2
    # The logarithm is that of a number right to an eps over 1 - (r/R)^2, at least 0.13.
    np.testing.assert_allclose(force[::2, 0], 30.0 * r / s, rtol=1e-14)
    assert energy == pytest.approx(-0.5 * 30 * 1.5**2 * np.log(s).sum(), rel=1e-14)


def test_fene_and_repulsion_rest_where_their_forces_cancel(device):
    # 30 r / (1 - (r/1.5)^2) = 24 (2 r^-13 - r^-7): by bisection in NumPy, 0.9609.
    low, high = 0.9, 1.0
    for _ in range(60):
        r = 0.5 * (low + high)
        pull = 30 * r / (1 - (r / 1.5) ** 2) - 24 * (2 * r**-13 - r**-7)
        low, high = (r, high) if pull < 0 else (low, r)
    assert r == pytest.approx(0.9609, abs=1e-4)
    x = np.array([(0, 0, 0), (r, 0, 0)])
    bond, _ = forces(x, ps.FENEBonds([(0, 1)]), device=device)
    core, _ = forces(x, ps.LennardJones(cutoff=2 ** (1 / 6), truncation="shift"), device=device)
    # The root is right to an eps times a slope of 1e3 of forces of 49.
    assert np.abs(bond + core).max() < 1e-11 < np.abs(bond).max()


def test_limits_of_bonds():
    # omega^2 = u'' / mu with mu = m / 2, u'' = k (1 + s^2) / (1 - s^2)^2, s = r / R.
    r = 1.2
    s2 = (r / 1.5) ** 2
    omega = math.sqrt(2 * 30 * (1 + s2) / (1 - s2) ** 2)
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0), (r, 0, 0)])
    scene.add_interaction(ps.FENEBonds([(0, 1)]))
    # The estimate stops within 0.25 % of dt; differences of float64 are right to 1e-9.
    limits = simulation(scene, precision="float64").stability().limits
    (now,) = [each.dt for each in limits if each.kind == "frequency"]
    assert now == pytest.approx(2 / omega, rel=0.01)
    # A free chain of five: omega = 2 sqrt(k/m) sin(4 pi / 10).
    scene = ps.Scene()
    scene.add_particles([(k, 0, 0) for k in range(5)], mass=0.3)
    scene.add_interaction(ps.HarmonicBonds([(k, k + 1) for k in range(4)], 50.0))
    omega = 2 * math.sqrt(50.0 / 0.3) * math.sin(math.pi * 4 / 10)
    assert limit(scene, precision="float64") == pytest.approx(2 / omega, rel=0.01)


# Kernels of single precision are compiled for the long run.
PRECISIONS = pytest.mark.parametrize(
    "precision", ["float64", pytest.param("float32", marks=pytest.mark.slow)]
)

# Angles -------------------------------------------------------------------------------------------


def bent(angle, first=1.3, second=0.7):
    """Two legs of these lengths, turned away from the axes."""
    x = np.array([
        (first, 0, 0), (0, 0, 0), (second * math.cos(angle), second * math.sin(angle), 0)
    ])  # fmt: skip
    return ps.sample.rotate(x, (1, 2, 3), 0.7)


@pytest.mark.parametrize("bend", [1e-7, 1e-3, 1.0])
def test_an_angle_near_the_straight_has_all_its_digits(bend, device):
    # |f| = k (pi - theta) / leg. Places are right to an eps, and so is the bend: in parts of it,
    # eps / bend, some times over.
    part = ps.HarmonicAngles([(0, 1, 2)], 2.0, np.pi)
    force, energy = forces(bent(np.pi - bend), part, device=device)
    size = np.linalg.norm(force, axis=1)
    rounding = 20 * np.finfo(float).eps / bend + 1e-14
    np.testing.assert_allclose(size[[0, 2]], 2.0 * bend / np.array([1.3, 0.7]), rtol=rounding)
    assert energy == pytest.approx(bend**2, rel=2 * rounding)


@PRECISIONS
@pytest.mark.parametrize("angle", [0.0, np.pi], ids=["folded", "straight"])
def test_on_a_line_forces_are_bounded_and_balanced(angle, precision, device):
    """A law with a slope there bends it, in a direction across; others leave it alone."""
    x = np.array([(0, 0, 1.5), (0, 0, 0), (0, 0, 0.5 * math.cos(angle))])
    slope = 2.0 * abs(angle - 1.9)
    force, _ = forces(x, ps.HarmonicAngles([(0, 1, 2)], 2.0, 1.9), precision, device)
    rounding = 8 * np.finfo(precision).eps * slope / 0.5
    size = np.linalg.norm(force, axis=1)
    np.testing.assert_allclose(size[[0, 2]], [slope / 1.5, slope / 0.5], atol=rounding)
    assert np.abs(force[:, 2]).max() == 0.0
    assert np.abs(force.sum(axis=0)).max() < rounding
    assert np.abs(np.cross(x, force).sum(axis=0)).max() < rounding
    for part in (
        ps.HarmonicAngles([(0, 1, 2)], 2.0, angle),
        ps.Angles([(0, 1, 2)], bending, epsilon=1.0),
    ):
        force, _ = forces(x, part, precision, device)
        assert np.abs(force).max() <= rounding


# Dihedrals ----------------------------------------------------------------------------------------


def twisted(dihedral, legs=(1.1, 0.8, 1.4), angle=1.9):
    """Four on a zigzag whose far bond is turned clockwise, seen from the second to the third."""
    d = np.asarray(dihedral, dtype=float)
    zero, across, along = np.zeros_like(d), math.sin(angle), math.cos(angle)
    first = [zero, zero + legs[0] * across, zero + legs[0] * along]
    # Seen along z with y upwards, x is to the left.
    last = [
        -legs[2] * across * np.sin(d), legs[2] * across * np.cos(d),
        zero + legs[1] - legs[2] * along,
    ]  # fmt: skip
    middle = [[zero, zero, zero], [zero, zero, zero + legs[1]]]
    x = np.stack([np.stack(each, axis=-1) for each in (first, *middle, last)], axis=-2)
    return ps.sample.rotate(x.reshape(-1, 3), (3, 1, 2), 0.6).reshape(x.shape)


@pytest.mark.parametrize("dihedral", [0.0, 1e-9, 1.0, -1.0, 3.0, -3.0, np.pi])
def test_dihedrals_are_those_of_iupac(dihedral, device):
    force, energy = forces(
        twisted(dihedral), ps.Dihedrals([(0, 1, 2, 3)], turning, torque=2.0), device=device
    )
    found = 0.5 * energy
    # Trans is pi or -pi; places are right to an eps.
    assert abs(np.angle(np.exp(1j * (found - dihedral)))) < 1e-14
    # |f| = torque / (leg sin(angle)), whatever the dihedral: it divides by no sine of that.
    size = np.linalg.norm(force[[0, 3]], axis=1)
    np.testing.assert_allclose(size, 2.0 / np.array([1.1, 1.4]) / math.sin(1.9), rtol=1e-14)


@PRECISIONS
@pytest.mark.parametrize("sine", [0.0, 1e-12, 1e-5, 1e-3, 1e-2])
def test_dihedrals_near_a_line_are_bounded_and_balanced(sine, precision, device):
    part = ps.Dihedrals([(0, 1, 2, 3)], turning, torque=2.0)
    x = twisted(1.0)
    x[0] = x[1] + (x[1] - x[2]) + sine * (x[0] - x[1])  # almost on the line of the middle bond
    force, _ = forces(x, part, precision, device)
    # At most the torque over LINE and over the legs beside it, 1.1 and 0.8 long.
    assert np.linalg.norm(force, axis=1).max() < 1.01 * 2.0 / 1e-3 * (1 / 1.1 + 1 / 0.8)
    rounding = 64 * np.finfo(precision).eps * max(np.abs(force).max(), 1.0)
    assert np.abs(force.sum(axis=0)).max() < rounding
    # Places are within 3, and here they are as they were given; forces are opposite along
    # lines as far apart as places are rounded.
    assert np.abs(np.cross(x, force).sum(axis=0)).max() < 2 * 3 * rounding
    if sine == 0.0:
        assert np.abs(force).max() < rounding


BUTANE = (1.116, 1.462, -1.578, -0.368, 3.156, -3.788)  # 1000 K: Ryckaert and Bellemans 1975


@ps.law
def ryckaert_bellemans(dihedral: float):
    c = -wp.cos(dihedral)  # they count from trans
    return 1.116 + c * (1.462 + c * (-1.578 + c * (-0.368 + c * (3.156 + c * -3.788))))


def test_butane_rests_where_ryckaert_and_bellemans_say(device):
    phi = np.radians(np.arange(-179.0, 181.0, 2.0))
    count = len(phi)
    x = twisted(phi).reshape(-1, 3)
    part = ps.Dihedrals(np.arange(4 * count).reshape(count, 4), ryckaert_bellemans)
    force, energy = forces(x, part, device=device)
    c = -np.cos(phi)
    series = np.polynomial.Polynomial(BUTANE)
    assert energy == pytest.approx(series(c).sum(), rel=1e-13)
    slope = series.deriv()(c) * np.sin(phi)
    ends = force.reshape(count, 4, 3)[:, 0]
    np.testing.assert_allclose(
        np.linalg.norm(ends, axis=1), np.abs(slope) / 1.1 / math.sin(1.9), atol=1e-12
    )
    # Wells where the slope rises through zero: at the gauche angles, and at trans.
    wells = phi[:-1][(slope[:-1] < 0) & (slope[1:] > 0)]
    np.testing.assert_allclose(np.degrees(wells) + 1.0, [-60, 60], atol=1.0)
    assert slope[0] > 0 > slope[-1]
