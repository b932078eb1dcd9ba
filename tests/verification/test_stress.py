"""The stress as a tensor: derivatives of the energy by strain, lattices, gases, rotations."""

import numpy as np
import pytest
import warp as wp

import particlesim as ps
from particlesim.kernels.tensor import AXES, Tensor

SIDE = 40.0
STRAIN = 1e-5


@ps.law
def hill(r: float):
    """Of range 2.3, where it ends smoothly."""
    x = wp.where(r < 2.3, r / 2.3, 1.0)
    y = 1.0 - x * x
    return 20.0 * y * y * y


@ps.law
def turn(angle: float):
    return 1.0 + wp.cos(2.0 * angle)


def chain():
    """Twelve atoms, a random walk with steps of about 1, centred on the box."""
    steps = np.random.default_rng(3).normal(size=(12, 3))
    steps /= np.linalg.norm(steps, axis=1)[:, None]
    x = np.cumsum(steps * np.linspace(0.9, 1.3, 12)[:, None], axis=0)
    return x - x.mean(axis=0) + SIDE / 2


def molecule(x, velocity=(0, 0, 0)):
    """Pairs, tuples and penalties; the laws of pairs are in tests/kernels/test_loops.py."""
    n = np.arange(len(x))
    angles = np.stack([n[:-2], n[1:-1], n[2:]], axis=1)
    scene = ps.Scene(periodic=((0, 0, 0), (SIDE,) * 3))
    scene.add_particles(x, velocity=velocity, mass=1.0 + 0.1 * n)
    scene.add_interaction(ps.PairPotential(hill, cutoff=None))
    scene.add_interaction(ps.Dihedrals(np.stack([n[:-3], n[1:-2], n[2:-1], n[3:]], axis=1), turn))
    rods = ps.Distance(angles[:, ::2], rest_length=1.5, compliance=0.02)
    scene.add_interaction(rods.as_force())
    return scene


def strained(x, k, size):
    """About the middle of the box, by a symmetric strain of one component."""
    strain = np.zeros((3, 3))
    a, b = AXES[k]
    strain[a, b] += 0.5 * size
    strain[b, a] += 0.5 * size
    return x + (x - SIDE / 2) @ strain


def test_stress_is_the_derivative_of_the_energy_by_strain(device):
    x = chain()
    moved = [strained(x, k, sign * STRAIN) for k in range(6) for sign in (1, -1)]
    scenes = [molecule(each) for each in [x, *moved]]
    sim = ps.Simulation(scenes, ps.Settings(precision="float64"), device=device)
    found = sim.diagnostics()
    stress = found.stress[0] * SIDE**3
    up, down = found.potential[1:].reshape(6, 2).T
    # dU = -V P_ab deps_ab, of which a shear has both, P_ab and P_ba, by a half each. The error of
    # the difference is h^2 / 6 U''', with U''' of the order of 1000 U at most, and eps U / h:
    # both below 1e-7 of the stiffest terms.
    six = np.array([stress[a, b] for a, b in AXES])
    assert np.abs(six + (up - down) / (2 * STRAIN)).max() < 1e-6 * np.abs(six).max()
    np.testing.assert_array_equal(stress, stress.T)
    assert np.trace(stress) == pytest.approx(found.virial[0], rel=1e-12)

    # As a number, which a barostat takes, the virial is the trace of the tensor.
    n, (*_, dihedrals, _penalties) = sim.model.particle_count, sim.interactions
    tensor = wp.zeros(n, dtype=Tensor, device=device)
    one, other, virial = (wp.zeros(n, dtype=wp.float64, device=device) for _ in range(3))
    assert dihedrals.measure_stress(sim.state, one, tensor)
    dihedrals.measure(sim.state, other, virial)
    six = tensor.numpy()
    assert abs(six[:, :3].sum() - virial.numpy().sum()) < 1e-12 * np.abs(six).sum()
    assert one.numpy().sum() == pytest.approx(other.numpy().sum(), rel=1e-12)


def test_stress_turns_with_the_scene(device):
    x, v = chain(), np.random.default_rng(5).normal(size=(12, 3))
    turned, _ = np.linalg.qr(np.random.default_rng(4).normal(size=(3, 3)))
    turned *= np.linalg.det(turned)
    seen = molecule((x - SIDE / 2) @ turned.T + SIDE / 2, v @ turned.T)
    scenes = [molecule(x, v), seen, *[molecule(x)] * 11]
    sim = ps.Simulation(scenes, ps.Settings(precision="float64"), device=device)
    found = sim.diagnostics()
    now, then = found.stress[1], turned @ found.stress[0] @ turned.T
    # Places are 40 eps apart, and distances of 1 are then right to 1e-14, a stiffness of 50 on.
    assert np.abs(now - then).max() < 1e-11 * np.abs(then).max()
    assert np.trace(now) / 3 == pytest.approx(found.pressure[1], rel=1e-12)
    # Motion adds m v v^T and nothing else.
    mass = 1.0 + 0.1 * np.arange(12)
    flow = np.einsum("i,ia,ib->ab", mass, v, v) / SIDE**3
    np.testing.assert_allclose(found.stress[0] - found.stress[2], flow, atol=1e-12 * flow.max())


@pytest.fixture(scope="module")
def crystals():
    """fcc, as it is and longer along x, in boxes that grow along one axis, in float64."""
    a, cells = 1.6, 3

    def crystal(stretch):
        scene = ps.Scene(periodic=((0, 0, 0), np.array(stretch) * a * cells))
        scene.add_particles(ps.sample.lattice("fcc", (cells,) * 3, a) * stretch)
        scene.add_interaction(ps.PairPotential(hill, cutoff=None))
        return scene

    start = np.array([1.02, 1.0, 1.0])
    axes = [start * (1 + s * STRAIN * np.eye(3)[k]) for k in range(3) for s in (1, -1)]
    stretches = [(1, 1, 1), start, *axes]
    return ps.Simulation(
        [crystal(each) for each in stretches], ps.Settings(precision="float64"), device="cpu"
    ).diagnostics()


def test_stress_of_a_crystal_in_a_box_that_is_strained(crystals):
    cubic, stretched = crystals.stress[:2]
    # A cube's own stress is a pressure, to the round-off of some twenty terms an atom of up to 100.
    assert np.abs(cubic - np.eye(3) * crystals.pressure[0]).max() < 1e-11
    up, down = crystals.potential[2:].reshape(3, 2).T
    known = -(up - down) / (2 * STRAIN) / crystals.volume[1]
    # As above; where the law ends it is smooth.
    np.testing.assert_allclose(np.diag(stretched), known, atol=1e-6 * np.abs(known).max())
    assert abs(stretched[0, 0] - stretched[1, 1]) > 0.01
    assert np.abs(stretched - np.diag(np.diag(stretched))).max() < 1e-11


def test_stress_of_an_ideal_gas(device):
    rng, sides = np.random.default_rng(0), np.array([2.0, 3.0, 4.0])
    v, m = rng.normal(size=(100, 3)) * (1, 2, 3), rng.uniform(1, 2, 100)
    scene = ps.Scene(periodic=((0, 0, 0), sides))
    scene.add_particles(rng.uniform(size=(100, 3)) * sides, velocity=v, mass=m)
    sim = ps.Simulation(scene, ps.Settings(precision="float64"), device=device)
    known = np.einsum("i,ia,ib->ab", m, v, v) / sides.prod()
    stress = sim.diagnostics().stress
    np.testing.assert_allclose(stress[0], known, rtol=0, atol=1e-13 * known.max())


class Tank(ps.Interaction):
    """Tells its virial as one number, in the first world."""

    def prepare(self, model, neighbors):
        pass

    def apply(self, state, neighbors, dt):
        pass

    def measure(self, state, energy, virial):
        host = virial.numpy()
        host[0] = 3.0
        virial.assign(host)


def test_stress_that_is_not_known_is_no_number(device):
    scene = ps.Scene(periodic=((0, 0, 0), (2, 2, 2)))
    scene.add_particles([(1, 1, 1)], mass=8.0, velocity=(1, 0, 0))
    scene.add_interaction(Tank())
    found = ps.Simulation([scene, scene], device=device).diagnostics()
    np.testing.assert_allclose(found.pressure, [11 / 24, 8 / 24], rtol=1e-6)
    assert np.isnan(found.stress[0]).all()
    np.testing.assert_array_equal(found.stress[1], np.diag([1.0, 0, 0]))
