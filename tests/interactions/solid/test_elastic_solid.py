"""Elastic solids: exact strains, forces from the energy, and what is conserved."""

import numpy as np
import pytest
import warp as wp

import particlesim as ps
from cases.frames import rotation
from cases.solids import DENSITY, NU, SPACING, VERLET, Y, block, body, simulation
from cases.worlds import equal_alone
from particlesim.kernels.tensor import Tensor, matrices

LAME, SHEAR = Y * NU / ((1 + NU) * (1 - 2 * NU)), Y / (2 * (1 + NU))
EPS = float(np.finfo(np.float64).eps)
TURN = {2: rotation((0, 0, 1), 0.7), 3: rotation((1, 2, 3), 2.1)}


def force_at(sim, x):
    sim.position = x
    sim.forces(0.0)
    return sim.get("force").copy()


def virial_of(sim):
    """The sum of r F^T over the particles, (3, 3): -V times the mean of Cauchy's stress."""
    energy = wp.zeros(sim.particle_count, dtype=wp.float64, device="cpu")
    stress = wp.zeros(sim.particle_count, dtype=Tensor, device="cpu")
    assert sim.interactions[0].measure_stress(sim.state, energy, stress)
    return matrices(stress.numpy()).sum(axis=0)


def deformed(F):
    """Energy over volume, and Piola and Kirchhoff's first stress, of F (written out in NumPy)."""
    E = 0.5 * (F.T @ F - np.eye(3))
    S = LAME * np.trace(E) * np.eye(3) + 2 * SHEAR * E
    return 0.5 * LAME * np.trace(E) ** 2 + SHEAR * (E * E).sum(), F @ S


@pytest.mark.parametrize("dimension", [2, 3])
class TestStatics:
    def test_no_force_at_rest_nor_where_it_was_moved_and_turned(self, dimension):
        x = block(dimension)
        sim = simulation(body(x, dimension))
        assert not force_at(sim, x).any()  # not by a bit
        f = force_at(sim, x @ TURN[dimension].T + [1, 2, 0])
        # Positions of about 2 are known to 2 eps, strains to that over the spacing, and a force is
        # about the modulus times the area of a cell times the strain, of some tens of links.
        unit = (LAME + 2 * SHEAR) * SPACING ** (dimension - 1)
        assert np.abs(f).max() < 100 * 2 * EPS / SPACING * unit

    def test_uniform_strain_is_exact(self, dimension):
        x = block(dimension)
        A = np.random.default_rng(1).uniform(-0.2, 0.2, (3, 3))
        if dimension == 2:  # plane strain
            A[2] = A[:, 2] = 0.0
        F = TURN[dimension] @ (np.eye(3) + A)
        sim = simulation(body(x, dimension))
        sim.position = x @ F.T
        energy, P = deformed(F)
        volume = len(x) * SPACING**dimension
        assert sim.diagnostics().potential[0] == pytest.approx(energy * volume, rel=1e-12)
        # The sum of x f^T is that of -V P F^T, as dU = -sum f.dx = V P:dF where dx = dF X.
        there = matrices_of_plane(-volume * P @ F.T, dimension)
        np.testing.assert_allclose(
            matrices_of_plane(virial_of(sim), dimension), there, atol=1e-12 * np.abs(there).max()
        )

    def test_force_is_the_gradient_of_the_energy(self, dimension):
        x, rng = block(dimension), np.random.default_rng(2)
        moved = (x + 0.1 * SPACING * rng.uniform(-1, 1, x.shape)) @ TURN[dimension].T
        sim = simulation(body(x, dimension, hourglass=0.4))
        f = force_at(sim, moved)
        # A central difference of step h is off by h^2 / 6 of a third derivative, 1e-10 of the force
        # for strains of 1e-5, and by eps U / h, U / f being about a spacing times the particles.
        h = 1e-5 * SPACING
        for k in (0, 7, len(x) - 1):
            for axis in range(3):
                energy = []
                for way in (1, -1):
                    there = moved.copy()
                    there[k, axis] += way * h
                    sim.position = there
                    energy.append(sim.diagnostics().potential[0])
                slope = -(energy[0] - energy[1]) / (2 * h)
                assert slope == pytest.approx(f[k, axis], abs=1e-6 * np.abs(f).max())
        assert np.abs(f.sum(axis=0)).max() < 1e-13 * np.abs(f).sum()
        torque = np.cross(moved, f).sum(axis=0)
        # A plane stands for what is endless along z: it can be turned about z only.
        assert np.abs(torque[0 if dimension == 3 else 2 :]).max() < 1e-13 * np.abs(f).sum()


def matrices_of_plane(tensor, dimension):
    """The part of a tensor that particles of a plane feel."""
    return tensor[:dimension, :dimension]


def test_what_the_gradient_does_not_see_is_held():
    x, moved = block(3, (6, 6, 6), jitter=0.0), 0.01 * SPACING
    places = np.round(x / SPACING - 0.5).astype(int)
    zigzag = moved * (1.0 - 2.0 * (places.sum(axis=1) % 2))[:, None] * [1, 0, 0]
    energy, box = {}, (np.zeros(3), np.full(3, 6 * SPACING))
    for alpha in (0.0, 1.0):
        sim = simulation(body(x, periodic=box, hourglass=alpha))  # a solid without a surface
        sim.position = x + zigzag
        energy[alpha] = sim.diagnostics().potential[0]
    # mu sum c |u|^2 with sum c X^2 = V in each direction and |u| = 2 a or 0 of neighbours: half of
    # them, nearer than two spacings as a rule: above mu V (2 a)^2 3 / 2 / (2 s)^2.
    volume = len(x) * SPACING**3
    assert energy[1.0] > SHEAR * volume * 1.5 * (moved / SPACING) ** 2
    assert abs(energy[0.0]) < 1e-12 * energy[1.0]


def test_stress_answers_to_the_rate_of_strain_after_kelvin_and_voigt():
    # At rest and with v = G x the stress is tau times Hooke's of the symmetric part of G.
    x, tau = block(3), 1e-3
    G = np.random.default_rng(3).uniform(-1, 1, (3, 3))
    sim = simulation(body(x, velocity=x @ G.T, dissipation=tau))
    sim.forces(0.0)
    rate = 0.5 * (G + G.T)
    stress = tau * (LAME * np.trace(rate) * np.eye(3) + 2 * SHEAR * rate)
    volume = len(x) * SPACING**3
    np.testing.assert_allclose(virial_of(sim), -volume * stress, atol=1e-12 * volume * 1e4 * tau)
    assert not interaction_of(sim).conservative


def interaction_of(sim):
    (found,) = sim.interactions
    return found


def spinning(x, **options):
    """A solid that spins and rings."""
    middle, rng = x.mean(axis=0), np.random.default_rng(4)
    v = np.cross([3.0, 1.0, 2.0], x - middle) + rng.normal(0, 0.3, x.shape)
    return body(x, velocity=v, **options)


def test_what_a_solid_keeps():
    x = block(3)
    drift = []
    for substeps in (10, 20):
        sim = simulation(spinning(x), dt=0.01, substeps=substeps)
        before, off = sim.diagnostics(), 0.0
        for _ in range(10):
            sim.step()
            now = sim.diagnostics()
            off = max(off, abs(now.energy[0] / before.energy[0] - 1))
        drift.append(off)
        # Sums of 60 particles over 200 substeps, each rounded by eps of a momentum of about 60.
        for name in ("momentum", "angular_momentum"):
            kept = getattr(now, name) - getattr(before, name)
            assert np.abs(kept).max() < 200 * 60 * EPS
    # The energy is off by what velocity Verlet leaves, of second order: a quarter at half the step.
    # Where in its swing the energy is looked at is chance, which leaves 2 to 8.
    assert 1e-5 < drift[0] < 1e-2 and 2 < drift[0] / drift[1] < 8
    assert np.abs(sim.position - x).max() > 0.5 * SPACING


def test_dissipation_takes_energy_and_no_momentum():
    x = block(3)
    sim = simulation(spinning(x, dissipation=2e-3), dt=0.01, substeps=20)
    before = sim.diagnostics()
    energy = [before.energy[0]]
    for _ in range(5):
        sim.step()
        energy.append(sim.diagnostics().energy[0])
    now = sim.diagnostics()
    assert (np.diff(energy) < 0).all()
    for name in ("momentum", "angular_momentum"):
        assert np.abs(getattr(now, name) - getattr(before, name)).max() < 100 * 60 * EPS


def simulate(scenes, device, **knobs):
    return ps.Simulation(scenes, ps.Settings(**{"dt": 0.01, "substeps": 10, **VERLET, **knobs}),
                         device=device)  # fmt: skip


def test_worlds_of_their_own_solids_threads_and_graphs(device):
    sizes = [(4, 5, 3), (3, 3, 3)]
    scenes = [
        spinning(block(3, cells), youngs_modulus=Y * (1 + k), poissons_ratio=0.1 * k)
        for k, cells in enumerate(sizes)
    ]
    together = equal_alone(simulate, scenes, device, 3)
    many = spinning(block(3, (12, 10, 9)))  # more than two chunks of rows
    runs = []
    for knobs in ({"execution": "graph"}, {"execution": "threads", "threads": 2}):
        sim = simulate(many, "cpu", **knobs)
        sim.run(2)
        runs.append(sim.position)
    assert np.array_equal(*runs) and np.isfinite(together.position).all()


def test_across_a_periodic_box():
    x, side = block(3), 8 * SPACING
    box = (np.zeros(3), np.full(3, side))
    moved = x + 0.05 * SPACING * np.random.default_rng(5).uniform(-1, 1, x.shape)
    inside, across = (
        force_at(simulation(body(x + shift, periodic=box)), moved + shift)
        for shift in (2 * SPACING * np.ones(3), 5.5 * SPACING * np.ones(3))
    )
    # Places of the box are known to eps of it, over the spacing and of some tens of links.
    unit = (LAME + 2 * SHEAR) * SPACING**2
    assert np.abs(across - inside).max() < 100 * EPS * side / SPACING * unit
    assert np.abs(inside).max() > 1e-3 * unit


def test_a_neighbourhood_turned_inside_out_is_told():
    x = block(3)
    v = np.zeros_like(x)
    v[7] = [400.0, 0.0, 0.0]
    sim = simulation(body(x, velocity=v), dt=0.01, substeps=20)
    with pytest.raises(ps.SimulationError, match=r"ElasticSolid: the neighbourhood of particle \d"):
        sim.run(5)


def test_the_step_is_limited_where_it_says():
    x = block(3, (3, 3, 3))
    v = 1e-6 * np.random.default_rng(6).normal(size=x.shape)
    scene = body(x, velocity=v)
    limit = simulation(scene).stability().limits[0].dt
    rings = simulation(scene, dt=97 * limit, substeps=100)
    rings.run(2)
    assert np.abs(rings.velocity).max() < 100e-6
    # At 3 % more than 2 / omega a step is 1.6 times as far: in 40 of them the noise is the solid.
    with pytest.raises(ps.SimulationError, match="turned inside out"):
        simulation(scene, dt=103 * limit, substeps=100).run(2)


def test_density_of_a_lattice_is_its_own():
    x = block(3, jitter=0.0)
    (given, found) = (
        force_at(simulation(body(x, rest_density=density)), 1.1 * x) for density in (DENSITY, None)
    )
    # Spacings of the lattice are known to some eps of places up to five of them.
    np.testing.assert_allclose(found, given, atol=1e-12 * np.abs(given).max())


@pytest.mark.slow
def test_blocks_that_touch_stay_two_and_keep_momentum():
    x, scene = block(3, jitter=0.0), ps.Scene()
    for shift, speed in ((0.0, 1.0), (0.5, -0.5)):
        mass = DENSITY * SPACING**3
        group = scene.add_particles(
            x + np.array([shift, 0, 0]), velocity=(speed, 0, 0), mass=mass, radius=0.4 * SPACING
        )
        scene.add_interaction(ps.ElasticSolid(group, Y, NU, smoothing_length=1.5 * SPACING))
    scene.add_constraint(ps.Contact())
    sim = simulate(scene, "cpu", integrator="symplectic_euler")
    before = sim.diagnostics().momentum
    sim.run(30)
    # 120 particles over 300 substeps, each rounded by eps of a momentum of 60.
    assert np.abs(sim.diagnostics().momentum - before).max() < 300 * 60 * EPS
    first, second = (sim.position[group.slice, 0] for group in scene.groups)
    assert second.min() > first.max() and sim.velocity[: len(x), 0].mean() < 0
