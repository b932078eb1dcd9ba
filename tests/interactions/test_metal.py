"""Sums over pairs: a metal in two passes, written against public names only."""

import numpy as np
import pytest
import warp as wp

import particlesim as ps
from particlesim.engine.model import Model

LATTICE = 3.1652  # of tungsten [Angstrom]
TUNGSTEN = {
    "A": 1.896373, "c": 3.25, "c0": 47.1346499, "c1": -33.7665655, "c2": 6.2541999, "d": 4.400224,
}  # fmt: skip


@ps.law
def bond(r: float, c: float, c0: float, c1: float, c2: float):
    s = wp.min(r - c, 0.0)
    return s * s * (c0 + c1 * r + c2 * r * r)


@ps.law
def overlap(r: float, d: float):
    s = wp.min(r - d, 0.0)
    return s * s


@ps.law
def embedding(rho: float, A: float):
    return -A * wp.sqrt(rho)


@ps.law
def slope_of(total: float, A: float):
    slope, _ = wp.grad(embedding)(total, A)
    return slope


@ps.law
def pull(
    r: float, x_ij: wp.vec3, slope_i: float, slope_j: float, c: float, c0: float, c1: float,
    c2: float, d: float,
) -> wp.vec3:  # fmt: skip
    of_bond, _c, _c0, _c1, _c2 = wp.grad(bond)(r, c, c0, c1, c2)
    of_overlap, _d = wp.grad(overlap)(r, d)
    return -(of_bond + (slope_i + slope_j) * of_overlap) / r * x_ij


@ps.law
def site(total: float, rho: float, A: float):
    return 0.5 * total + embedding(rho, A)


@ps.law
def half_virial(
    r: float, x_ij: wp.vec3, slope_i: float, slope_j: float, c: float, c0: float, c1: float,
    c2: float, d: float,
):  # fmt: skip
    return 0.5 * wp.dot(x_ij, pull(r, x_ij, slope_i, slope_j, c, c0, c1, c2, d))


class FinnisSinclair(ps.Interaction):
    """u = sum_i (sum_j V(r_ij) / 2 - A sqrt(rho_i)), rho_i = sum_j phi(r_ij)."""

    def __init__(self, group=None, **parameters):
        self.group, self.parameters = group, TUNGSTEN | parameters
        self.cutoff = max(self.parameters["c"], self.parameters["d"])

    def prepare(self, model, neighbors):
        def made(law, **options):
            return ps.PairSum(self, model, neighbors, law, **options)

        self.rho, self.slope = made(overlap), made(overlap, then=slope_of)
        self.force = made(pull, slope=self.slope)
        self.energy = made(bond, then=site, rho=self.rho)
        self.virial = made(half_virial, slope=self.slope)

    def apply(self, state, neighbors, dt):
        self.slope.keep()
        self.force.add_to(state.force)

    def measure(self, state, energy, virial):
        self.rho.keep()
        self.energy.add_to(energy)
        self.slope.keep()
        self.virial.add_to(virial)


def metal(
    cells=4, lattice=LATTICE, shake=0.0, periodic=True, interaction=FinnisSinclair, **options
):
    scene = ps.Scene(periodic=((0, 0, 0), (cells * lattice,) * 3) if periodic else None)
    x = ps.sample.lattice("bcc", (cells,) * 3, lattice)
    random = np.random.default_rng(0)
    atoms = scene.add_particles(
        x + shake * random.normal(size=x.shape), velocity=shake / 2 * random.normal(size=x.shape)
    )
    scene.add_interaction(interaction(atoms, **options))
    return scene


def test_tungsten_is_what_it_was_fitted_to(precision, device):
    """Finnis and Sinclair 1984, table 2: 8.90 eV an atom, no pressure, 310.4 GPa."""
    energies, virials = [], []
    spread = 1e-3
    for stretch in (1 - spread, 1.0, 1 + spread):
        scene = metal(lattice=stretch * LATTICE)
        sim = ps.Simulation(scene, ps.Settings(precision=precision), device=device)
        measured = sim.diagnostics()
        energies.append(measured.potential[0] / len(scene.position))
        virials.append(measured.virial[0] / len(scene.position))
    assert energies[1] == pytest.approx(-8.90, abs=0.005)
    # W = -3 V dU/dV; the constants are given to 8 digits, of terms up to 50 eV.
    assert abs(virials[1]) < 1e-4
    volume = LATTICE**3 / 2  # of an atom
    bulk = -(virials[2] - virials[0]) / (3 * 3 * 2 * spread * volume) * 160.21766  # eV/A^3 in GPa
    assert bulk == pytest.approx(310.4, rel=2e-3)


def test_force_is_minus_the_slope_of_the_energy(device):
    sim = ps.Simulation(metal(3, shake=0.1), ps.Settings(precision="float64"), device=device)
    sim.forces(0.0)
    force, x, h = sim.get("force"), sim.position, 1e-5
    assert np.abs(force).max() > 1.0
    for i, axis in [(0, 0), (7, 1), (33, 2), (53, 0)]:
        energy = []
        for step in (-h, h):
            moved = x.copy()
            moved[i, axis] += step
            sim.position = moved
            energy.append(sim.diagnostics().potential[0])
        # h^2/6 u''' is 1e-9 for u''' of 50 eV/A^3; round-off 500 eV * 1e-16 / h is 5e-9.
        assert force[i, axis] == pytest.approx(-(energy[1] - energy[0]) / (2 * h), abs=1e-6)


def test_energy_is_conserved_to_second_order_and_momentum_to_round_off(precision):
    def run(substeps):
        settings = ps.Settings(
            dt=0.1, substeps=substeps, precision=precision, integrator="velocity_verlet"
        )
        sim = ps.Simulation(metal(3, shake=0.1), settings, device="cpu")
        start, off, impulse = sim.diagnostics(), [], 0.0
        for _ in range(20):
            sim.step()
            off.append(sim.diagnostics().energy[0] - start.energy[0])
            impulse += np.abs(sim.get("force")).sum() * settings.dt
        drift = np.abs(sim.diagnostics().momentum - start.momentum).max()
        # Sums over some 20 partners, right to an eps each, and kicks as rounded.
        assert drift < 100 * np.finfo(precision).eps * impulse
        return np.abs(off).max()

    coarse, fine = run(5), run(10)
    # The energy swings by (omega dt)^2 / 8 of that of a vibration: 13 eV here, omega dt of 0.16.
    assert coarse < 0.16**2 / 8 * 13
    if precision == "float64":
        assert 3.5 < coarse / fine < 4.5


def test_the_same_bits_on_graph_and_threads_and_in_a_batch():
    def scenes():
        return [metal(9, shake=0.1, A=1.8), metal(9, shake=0.1)]  # 1458 atoms, by a grid

    def run(scene, **knobs):
        settings = ps.Settings(dt=0.01, substeps=4, **knobs)
        sim = ps.Simulation(scene, settings, device="cpu")
        sim.run(3)
        return sim

    alone = [run(scene, execution="graph") for scene in scenes()]
    for knobs in (
        {"execution": "graph"},
        *({"execution": "threads", "threads": n} for n in (1, 2)),
    ):
        batch = run(scenes(), **knobs)
        for w, sim in enumerate(alone):
            np.testing.assert_array_equal(batch.world(w).position, sim.position)
            np.testing.assert_array_equal(batch.world(w).velocity, sim.velocity)
    assert (alone[0].position != alone[1].position).any()


@pytest.mark.parametrize("precision", ["float64", pytest.param("float32", marks=pytest.mark.slow)])
@pytest.mark.parametrize("periodic", [pytest.param(False, marks=pytest.mark.slow), True])
def test_plain_loops_give_the_same(periodic, precision, monkeypatch):
    results = []
    for vectorised in (True, False):
        monkeypatch.setattr(Model, "vectorised", vectorised)
        scene = metal(4, shake=0.1, periodic=periodic)
        sim = ps.Simulation(scene, ps.Settings(precision=precision), device="cpu")
        sim.forces(0.0)
        measured = sim.diagnostics()
        results.append((sim.get("force"), measured.potential, measured.virial))
    # Sums over some 20 partners of up to 20 eV/A in another order; 128 atoms of some 50 eV each.
    eps = np.finfo(precision).eps
    for fast, plain, scale in zip(*results, (20, 128 * 50, 128 * 50 * 4), strict=True):
        np.testing.assert_allclose(fast, plain, rtol=0, atol=20 * eps * scale)
