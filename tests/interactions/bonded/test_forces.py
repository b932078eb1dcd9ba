"""Bonds, angles and dihedrals: forces from energies, momentum, virial, worlds, restarts."""

import numpy as np
import pytest
import warp as wp

import particlesim as ps
from cases.parts import bending, screened
from cases.worlds import equal_alone, goes_on_after_reset_and_save


@ps.law
def twisting(dihedral: float, barrier: float, multiplicity: int, charge_i: float, mass_l: float):
    turns = wp.cos(float(multiplicity) * dihedral) + 0.3 * wp.sin(dihedral)
    return barrier * charge_i * mass_l * turns


PAIRS, TRIPLES = [(0, 1), (2, 1), (0, 5), (7, 3)], [(0, 1, 2), (3, 1, 5), (6, 0, 7)]
PARTS = {
    "Bonds": lambda: ps.Bonds(PAIRS, screened, strength=[1.0, -2.0, 3.0, 4.0], reach=0.7),
    "HarmonicBonds": lambda: ps.HarmonicBonds(PAIRS, [1.0, 2.0, 3.0, 4.0], 0.7),
    "FENEBonds": lambda: ps.FENEBonds(PAIRS, length=[2.1, 3.0, 4.0, 5.0]),
    "Angles": lambda: ps.Angles(TRIPLES, bending, epsilon=[1.0, 2.0, -3.0]),
    "HarmonicAngles": lambda: ps.HarmonicAngles(TRIPLES, [9.0, 2.0, 3.0], [0.1, 2.0, np.pi]),
    "Dihedrals": lambda: ps.Dihedrals(
        [(0, 1, 2, 3), (5, 2, 1, 4)], twisting, barrier=2.0, multiplicity=[1, 3]
    ),
}


def molecule(*names, seed=3):
    """Particles about 1.2 apart, no three on a line, with these parts."""
    rng = np.random.default_rng(seed)
    x = 1.2 * ps.sample.lattice("sc", (2, 2, 2), 1.0) + rng.uniform(-0.2, 0.2, (8, 3))
    scene = ps.Scene()
    scene.add_particles(
        x, velocity=rng.normal(size=(8, 3)), mass=np.arange(1.0, 9.0),
        charge=np.linspace(-1, 1, 8),
    )  # fmt: skip
    for name in names or PARTS:
        scene.add_interaction(PARTS[name]())
    return scene


@pytest.mark.parametrize("name", PARTS)
def test_forces_are_minus_the_slope_of_the_energy(name, device, simulate):
    sim = simulate(molecule(name), device, precision="float64")
    sim.forces(0.0)
    force, x = sim.get("force"), sim.position
    slope, h = np.zeros_like(x), 1e-5
    for i, a in np.ndindex(x.shape):
        energy = []
        for step in (-h, h):
            moved = x.copy()
            moved[i, a] += step
            sim.position = moved
            energy.append(sim.diagnostics().potential[0])
        slope[i, a] = (energy[1] - energy[0]) / (2 * h)
    # Central differences leave h^2 u''' / 6, 2e-11 of u / r^3 with numbers up to 1e3, and the
    # rounding of an energy up to 1e2 over h, 2e-9.
    scale = np.abs(force).max()
    assert scale > 0.1
    np.testing.assert_allclose(force, -slope, rtol=0, atol=1e-6 * max(scale, 1.0))
    # Each force is a sum of at most eight terms of its size, right to some eps; distances are 3.
    rounding = 8 * 8 * 8 * np.finfo(float).eps * scale
    assert np.abs(force.sum(axis=0)).max() < rounding
    assert np.abs(np.cross(x, force).sum(axis=0)).max() < 3 * rounding
    sim.position = x
    # In an isolated scene the virial is sum x . f.
    assert abs(sim.diagnostics().virial[0] - (x * force).sum()) < 3 * 8 * rounding


def test_worlds_of_other_tuples_and_parameters_go_as_they_go_alone(device, simulate):
    scenes = [molecule(), molecule(seed=4), molecule()]
    first, _, last = (scene.interactions for scene in scenes)
    last[1] = ps.HarmonicBonds([(1, 0), (4, 6)], 7.0, [0.5, 1.5])
    first[3] = ps.Angles(np.zeros((0, 3), dtype=int), bending, epsilon=2.0)
    knobs = {"dt": 0.01, "substeps": 5, "precision": "float64"}
    together = equal_alone(simulate, scenes, device, 5, **knobs)
    potential = [simulate(scene, device, **knobs).diagnostics().potential[0] for scene in scenes]
    together.reset()
    np.testing.assert_array_equal(together.diagnostics().potential, potential)


def test_a_run_goes_on_after_a_restart(device, simulate, tmp_path):
    def build(scenes, device):
        return simulate(scenes, device, dt=0.01, substeps=5, precision="float64")

    scenes = [molecule(), molecule(seed=4)]
    goes_on_after_reset_and_save(build, scenes, device, tmp_path / "molecules.npz")


@pytest.mark.slow
def test_threads_graphs_and_single_precision_agree(device):
    """Of a long chain, whose launches are cut."""
    count = 20_000
    scene = ps.Scene()
    x = np.zeros((count, 3))
    x[:, 0], x[:, 1] = np.arange(count), 0.3 * (-1.0) ** np.arange(count)
    x[:, 2] = 0.1 * np.cos(np.arange(count))
    scene.add_particles(x, charge=1.0)
    at = np.arange(count)
    scene.add_interaction(ps.HarmonicBonds(np.stack([at[:-1], at[1:]], axis=1), 50.0, 1.0))
    triples = np.stack([at[:-2], at[1:-1], at[2:]], axis=1)
    scene.add_interaction(ps.HarmonicAngles(triples, 5.0, 2.0))
    quadruples = np.stack([at[:-3], at[1:-2], at[2:-1], at[3:]], axis=1)
    scene.add_interaction(ps.Dihedrals(quadruples, twisting, barrier=1.0, multiplicity=3))
    for precision in ("float32", "float64"):
        found = []
        for knobs in (
            {"execution": "graph", "threads": 1}, {"execution": "threads", "threads": 1},
            {"execution": "threads", "threads": 2},
        ):  # fmt: skip
            settings = ps.Settings(dt=0.01, substeps=5, precision=precision, **knobs)
            sim = ps.Simulation(scene, settings, device=device)
            sim.run(3)
            found.append(sim.position)
        assert np.array_equal(found[0], found[1]) and np.array_equal(found[0], found[2])


def test_nothing_is_there_to_be_pulled(device, simulate):
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0), (1, 0, 0)], velocity=(1, 0, 0))
    for part in (
        ps.Bonds([], screened, strength=1.0, reach=1.0), ps.HarmonicBonds([], 1.0),
        ps.Springs([], 1.0), ps.FENEBonds([]), ps.Angles([], bending, epsilon=1.0),
        ps.HarmonicAngles([], 1.0, 2.0),
        ps.Dihedrals([], twisting, barrier=1.0, multiplicity=2, charge_i=1.0),
    ):  # fmt: skip
        scene.add_interaction(part)
    sim = simulate(scene, device, dt=0.5)
    sim.run(2)
    assert sim.position[:, 0] == pytest.approx([1.0, 2.0])
    assert sim.diagnostics().potential[0] == 0.0
