"""The loops over pairs: vectorised and plain, against sums in NumPy."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
import warp as wp

import particlesim as ps
from particlesim.engine.model import Model
from particlesim.kernels.tensor import Tensor, matrices

SIDE = 7.0
CUTOFF = 2.5
COUNT = 320


@pytest.fixture(params=[True, False], ids=["vectorised", "plain"])
def vectorised(request, monkeypatch, device):
    """Loops for vector units, and Warp's own, which CUDA runs."""
    if request.param and device != "cpu":
        pytest.skip("vectorised loops are for the CPU")
    monkeypatch.setattr(Model, "vectorised", request.param)
    return request.param


@dataclass
class Case:
    """An interaction, and its u(r) and F(r) in NumPy for matrices of pairs."""

    make: Any
    energy: Any
    force: Any
    cutoff: float | None = CUTOFF


def mie(n, m, truncation):
    strength = n / (n - m) * (n / m) ** (m / (n - m))

    def plain(r):
        return strength * (r**-n - r**-m)

    def slope(r):
        return -strength * (n * r ** -(n + 1) - m * r ** -(m + 1))

    u_cut = plain(CUTOFF) if truncation != "cut" else 0.0
    f_cut = -slope(CUTOFF) if truncation == "force_shift" else 0.0
    return Case(
        lambda: ps.Mie(cutoff=CUTOFF, exponents=(n, m), truncation=truncation),
        lambda r, c: plain(r) - u_cut + (r - CUTOFF) * f_cut,
        lambda r, c: -slope(r) - f_cut,
    )


@ps.law
def yukawa(r: float, charge_i: float, charge_j: float, screening: float):
    return charge_i * charge_j * wp.exp(-r / screening) / r


def yukawa_case(cutoff):
    return Case(
        lambda: ps.PairPotential(yukawa, cutoff=cutoff, screening=0.7),
        lambda r, c: c["charge"] * np.exp(-r / 0.7) / r,
        lambda r, c: c["charge"] * np.exp(-r / 0.7) * (1 / r**2 + 1 / (0.7 * r)),
        cutoff,
    )


@ps.law
def attraction(r: float, mass_j: float, radius_i: float):
    return -mass_j * radius_i / (r * r)


CASES = {
    "lennard_jones": mie(12, 6, "cut"),
    "shift": mie(12, 6, "shift"),
    "force_shift": mie(12, 6, "force_shift"),
    "mie_9_5": mie(9, 5, "cut"),
    "gravity": Case(
        lambda: ps.Gravity(G=2.0, softening=0.1),
        lambda r, c: -2 * c["mass"] / np.sqrt(r**2 + 0.01),
        lambda r, c: -2 * c["mass"] * r / (r**2 + 0.01) ** 1.5,
        None,
    ),
    "derived": yukawa_case(CUTOFF),
    "derived_all_pairs": yukawa_case(None),
    "force_only": Case(
        lambda: ps.PairForce(attraction, cutoff=CUTOFF),
        None,  # reports no energy
        lambda r, c: -c["mass_j"] * c["radius_i"] / r**2,
    ),
}
PERIODIC = {"lennard_jones", "derived_all_pairs", "derived"}


def scene_of(make, periodic):
    """Atoms some way off a lattice, with numbers that float32 holds exactly."""
    rng = np.random.default_rng(2)
    x = ps.sample.lattice("sc", (7, 7, 7), 1.0)[rng.permutation(343)[:COUNT]] + 0.5
    x = (x + rng.uniform(-0.08, 0.08, x.shape)).astype(np.float32).astype(float)
    scene = ps.Scene(periodic=((0, 0, 0), (SIDE,) * 3) if periodic else None)
    scene.add_particles(
        x,
        mass=rng.integers(1, 4, COUNT), radius=rng.integers(1, 3, COUNT),
        charge=rng.choice([-1.0, 1.0], COUNT),
    )  # fmt: skip
    scene.add_interaction(make())
    return scene


@pytest.mark.parametrize(
    ("name", "periodic"),
    [(name, periodic) for name in CASES for periodic in (False, True)
     if not periodic or name in PERIODIC],
)  # fmt: skip
def test_forces_energy_and_virial_are_the_sums(name, periodic, vectorised, precision, device):
    case = CASES[name]
    scene = scene_of(case.make, periodic)
    sim = ps.Simulation(scene, ps.Settings(precision=precision), device=device)
    sim.forces(0.0)

    x = scene.position
    d = x[:, None] - x[None]
    d -= SIDE * np.round(d / SIDE) if periodic else 0.0
    r = np.linalg.norm(d, axis=2)
    np.fill_diagonal(r, np.inf)
    m, q = scene.mass, scene.column("charge")
    columns = {
        "mass": m[:, None] * m, "mass_j": np.broadcast_to(m, r.shape),
        "charge": q[:, None] * q, "radius_i": np.broadcast_to(scene.radius[:, None], r.shape),
    }  # fmt: skip
    inside = r < (np.inf if case.cutoff is None else case.cutoff)
    near = np.where(inside, r, 1.0)
    size = np.where(inside, case.force(near, columns), 0.0)
    energy = np.where(inside, case.energy(near, columns), 0.0) if case.energy else np.zeros(1)
    virial = size * near
    force = (size[..., None] * d / near[..., None]).sum(axis=1)

    # A sum of n terms in any order is right to n eps of the sum of their sizes; a term r^-13 to
    # 13 times the few roundings that r comes from.
    steps = (inside.sum(axis=1).max() + 13 * 8) * np.finfo(precision).eps
    allowed = steps * np.abs(size).sum(axis=1)
    assert (np.linalg.norm(sim.get("force") - force, axis=1) <= allowed).all()
    measured = sim.diagnostics()
    assert abs(measured.potential[0] - energy.sum() / 2) <= steps * np.abs(energy).sum()
    assert abs(measured.virial[0] - virial.sum() / 2) <= steps * np.abs(virial).sum()
    found = wp.zeros(COUNT, dtype=Tensor, device=device)
    unused = wp.zeros(COUNT, dtype=wp.float64, device=device)
    part = sim.interactions[0]
    if part.measure_stress(sim.state, unused, found):  # gravity may have more than pairs
        tensor = np.einsum("ij,ija,ijb->iab", size / near, d, d) / 2
        error = np.abs(matrices(found.numpy()) - tensor).max(axis=(1, 2))
        assert (error <= steps * np.abs(virial).sum(axis=1)).all()


@pytest.mark.parametrize("periodic", [False, True])
@pytest.mark.parametrize("count", [200, 900])  # looked through directly, and by grid
def test_the_same_are_listed(count, periodic, precision, monkeypatch):
    def rows(vectorised):
        monkeypatch.setattr(Model, "vectorised", vectorised)
        scene = ps.Scene(periodic=((0, 0, 0), (SIDE,) * 3) if periodic else None)
        scene.add_particles(np.random.default_rng(4).uniform(0, SIDE, (count, 3)))
        scene.add_interaction(ps.LennardJones(sigma=0.1, cutoff=1.1))
        sim = ps.Simulation(scene, ps.Settings(precision=precision), device="cpu")
        (listed,) = sim.neighbors.lists
        return [sorted(listed.neighbors_of(k).tolist()) for k in range(count)]

    fast, plain = rows(True), rows(False)
    assert sum(map(len, fast)) > count
    assert fast == plain


def test_a_whole_run_on_plain_loops(monkeypatch, liquid):
    # What CUDA runs, run on the CPU: interleaved rows, Warp's loops. Round-off grows by chaos;
    # over 20 steps of a liquid by a factor of a few.
    def run(vectorised):
        monkeypatch.setattr(Model, "vectorised", vectorised)
        settings = ps.Settings(dt=0.02, substeps=5, precision="float64")
        sim = ps.Simulation(liquid(cells=6), settings, device="cpu")
        for _ in range(4):
            sim.step()
        return sim

    fast, plain = run(True), run(False)
    assert fast.neighbors.lists[0].pairs.entry_stride == 1
    assert plain.neighbors.lists[0].pairs.entry_stride == plain.particle_count
    np.testing.assert_allclose(fast.position, plain.position, rtol=0, atol=1e-10)
