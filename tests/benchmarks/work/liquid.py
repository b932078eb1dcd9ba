"""A Lennard-Jones liquid in reduced units, as LAMMPS's bench/in.lj has it."""

from __future__ import annotations

import numpy as np

import particlesim as ps

CUTOFF, SKIN, STEP = 2.5, 0.3, 0.005
# Threads are given: what disturbs a trial frame is not to choose them for a whole race.
SETTINGS = ps.Settings(
    dt=STEP, substeps=1, integrator="velocity_verlet", skin=SKIN, execution="threads"
)


def atoms(count: int, density: float = 0.8442, seed: int = 0):
    """Places on a face-centred cubic lattice, velocities at T = 1.44, and the side of the box."""
    cells = int(np.ceil((count / 4) ** (1 / 3) - 1e-9))
    side = (count / density) ** (1 / 3)
    x = ps.sample.lattice("fcc", (cells,) * 3, side / cells)
    v = ps.sample.maxwell_boltzmann(count, 1.44, 1.0, seed=seed)
    return x[np.linspace(0, len(x) - 1, count).astype(int)], v, side


def liquid(
    count: int, interaction: ps.Interaction | None = None, density: float = 0.8442, seed: int = 0
) -> ps.Scene:
    """The same as a scene; the interaction: the library's own Lennard-Jones."""
    x, v, side = atoms(count, density, seed)
    scene = ps.Scene(periodic=((0, 0, 0), (side,) * 3))
    scene.add_particles(x, velocity=v)
    scene.add_interaction(interaction or ps.LennardJones(cutoff=CUTOFF))
    return scene


def thermodynamics(sim: ps.Simulation) -> dict[str, float]:
    """Energy an atom, and pressure (Clausius 1870), of the first world."""
    now, scene = sim.diagnostics(), sim.scenes[0]
    volume = float(np.prod(np.subtract(scene.periodic[1], scene.periodic[0])))
    return {
        "energy": float(now.energy[0]) / scene.particle_count,
        "pressure": float(2 * now.kinetic[0] + now.virial[0]) / (3 * volume),
    }
