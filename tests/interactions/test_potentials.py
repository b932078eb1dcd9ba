"""Ready potentials against their formulas, and how they end at their cutoff."""

import math

import numpy as np
import pytest

import particlesim as ps

CUT = 2.2
SWITCH = 0.7
ON, OFF = (SWITCH * CUT) ** 2, CUT**2


def lennard_jones(r):
    return 4 * 1.3 * ((0.9 / r) ** 12 - (0.9 / r) ** 6)


def yukawa(r):
    return 1.7 * np.exp(-r / 0.8) / r


def morse(r):
    return 0.6 * (np.exp(-2 * 1.9 * (r - 1.1)) - 2 * np.exp(-1.9 * (r - 1.1)))


def soft(r):
    return 2.0 / 2.5 * np.maximum(1 - r / 1.6, 0.0) ** 2.5


def damped(r):
    return -0.5 * 3.0 * np.vectorize(math.erfc)(0.7 * r) / r


def coulomb(r):
    return -0.5 * 3.0 / r


def slope(u, r, h=1e-4):
    """Derivative by differences of sixth order: h^6 is 1e-24, the rounding of u / h 1e-12."""
    weights = {1: 45.0, 2: -9.0, 3: 1.0}
    return sum(w * (u(r + k * h) - u(r - k * h)) for k, w in weights.items()) / (60.0 * h)


def ended(u, truncation):
    """A potential as it ends at the cutoff."""
    if truncation == "cut":
        return u
    if truncation == "shift":
        return lambda r: u(r) - u(CUT)
    if truncation == "force_shift":
        return lambda r: u(r) - u(CUT) - (r - CUT) * slope(u, CUT)

    def smooth(r):
        x = np.clip(r * r, ON, OFF)
        return (OFF - x) ** 2 * (OFF + 2 * x - 3 * ON) / (OFF - ON) ** 3

    return lambda r: u(r) * smooth(r)


CASES = [
    *[
        (lambda t: ps.LennardJones(epsilon=1.3, sigma=0.9, cutoff=CUT, truncation=t, switch=SWITCH),
         lennard_jones, truncation)
        for truncation in ("shift", "force_shift", "xplor")
    ],
    (lambda t: ps.Yukawa(strength=1.7, screening=0.8, cutoff=CUT, truncation=t), yukawa,
     "force_shift"),
    (lambda t: ps.Yukawa(strength=1.7, screening=0.8, cutoff=CUT, truncation=t, switch=SWITCH),
     yukawa, "xplor"),
    (lambda t: ps.Morse(depth=0.6, steepness=1.9, distance=1.1, cutoff=CUT), morse, "cut"),
    (lambda t: ps.SoftSphere(epsilon=2.0, sigma=1.6, exponent=2.5), soft, "cut"),
    (lambda t: ps.Coulomb(constant=3.0, cutoff=CUT, damping=0.7), damped, "force_shift"),
    (lambda t: ps.Coulomb(constant=3.0), coulomb, "cut"),
]  # fmt: skip


@pytest.mark.parametrize(("make", "u", "truncation"), CASES)
def test_energies_forces_and_virials_are_those_of_the_formula(make, u, truncation, device):
    """Of pairs at distances up to the cutoff; rounding of some ten operations, and differences."""
    r = np.array([0.85, 1.0, 1.3, 1.55, 1.9, 2.15])
    part, u = make(truncation), ended(u, truncation)
    r = r[:2] if part.cutoff is None else r[r < part.cutoff]
    energy, virial, forces = [], [], []
    for each in r if part.cutoff is None else [r]:
        scene, each = ps.Scene(), np.atleast_1d(each)
        x = np.zeros((len(each), 2, 3))
        x[:, :, 1] = 50.0 * np.arange(len(each))[:, None]
        x[:, 1, 0] = each
        scene.add_particles(x.reshape(-1, 3), charge=np.tile([1.0, -0.5], len(each)))
        scene.add_interaction(make(truncation))
        sim = ps.Simulation(scene, ps.Settings(precision="float64"), device=device)
        found = sim.diagnostics()
        energy.append(found.potential[0])
        virial.append(found.virial[0])
        forces.append(sim.get("force").reshape(-1, 2, 3)[:, 1, 0])
    F = np.concatenate(forces)
    np.testing.assert_allclose(F, -slope(u, r), rtol=1e-10, atol=1e-11)
    assert sum(energy) == pytest.approx(u(r).sum(), rel=1e-11)
    assert sum(virial) == pytest.approx((F * r).sum(), rel=1e-12)


def test_a_smoothed_force_ends_without_a_jump():
    """Close to the cutoff it is 12 u r (c - x) / (c - a)^2, which is 1.5e-6 at 1e-6 from it."""
    part = ps.LennardJones(cutoff=CUT, truncation="xplor", switch=SWITCH)
    forces = []
    for r in (CUT * (1 - 1e-6), math.sqrt(ON) * (1 + 1e-9), math.sqrt(ON) * (1 - 1e-9)):
        scene = ps.Scene()
        scene.add_particles([(0, 0, 0), (r, 0, 0)])
        scene.add_interaction(part)
        sim = ps.Simulation(scene, ps.Settings(precision="float64"))
        forces.append(sim.get("force")[1, 0])
    assert forces[0] == pytest.approx(-1.47e-6, rel=0.01)
    assert forces[1] == pytest.approx(forces[2], rel=1e-7)
