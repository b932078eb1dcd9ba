"""A Lennard-Jones crystal melts: the benchmark that molecular dynamics codes are timed by.

Reduced units, sigma = epsilon = m = k = 1: an fcc lattice at a density of 0.8442, cut off at 2.5,
set going at T = 1.44 (LAMMPS, bench/in.lj). Within a unit of time half of the kinetic energy has
gone into the lattice, which is lost. LAMMPS has for 32 000 atoms at the start E_pair / N =
-6.7733681 and P = -5.0197073, and after 200 steps of 0.005 an energy of -4.6226272 in all: atoms
that cross the cutoff have taken 0.009 of it.
"""

import numpy as np

import particlesim as ps

ENERGY, PRESSURE, MELTED = -6.7733681, -5.0197073, -4.6226272

frames = 200
settings = ps.Settings(dt=0.05, substeps=10, integrator="velocity_verlet")


def build(
    cells: int = 8, density: float = 0.8442, temperature: float = 1.44, seed: int = 0
) -> ps.Scene:
    """A periodic box of 4 cells^3 atoms.

    Args:
        cells: Lattice cells along a side, at least 3; LAMMPS has 20.
        density: Atoms per sigma^3.
        temperature: At the start [epsilon / k].
        seed: Of the velocities.
    """
    count = 4 * cells**3
    side = (count / density) ** (1 / 3)
    v = ps.sample.maxwell_boltzmann(count, temperature, 1.0, seed=seed)
    v *= np.sqrt((3 * count - 3) * temperature / (v**2).sum())  # exactly of that temperature
    scene = ps.Scene(up_axis="z", periodic=((0, 0, 0), (side, side, side)))
    atoms = scene.add_particles(
        ps.sample.lattice("fcc", (cells, cells, cells), side / cells),
        velocity=v,
        radius=0.5,
        group="atoms",
    )
    scene.add_interaction(ps.LennardJones(atoms, cutoff=2.5))
    return scene


def error(sim: ps.Simulation) -> float:
    """Difference of the energy an atom from LAMMPS' after 200 steps, where it stays.

    3 N - 3 degrees of freedom were set to T = 1.44, there of 32 000 atoms.
    """
    n = sim.particle_count
    expected = MELTED - 1.5 * 1.44 * (1.0 / n - 1.0 / 32000)
    return abs(float(sim.diagnostics().energy[0]) / n - expected)
