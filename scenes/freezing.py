"""A Lennard-Jones fluid is cooled until it freezes.

Reduced units. Drag takes the heat out; the atoms settle into close packing, with about 12
neighbours each within 1.35 sigma (a simple liquid has fewer, and no common distance).
"""

import numpy as np

import particlesim as ps

frames = 240
settings = ps.Settings(dt=0.25, substeps=50)


def build(
    cells: int = 8,
    density: float = 1.0,
    temperature: float = 2.0,
    cooling: float = 0.04,
    seed: int = 0,
) -> ps.Scene:
    """A periodic box of 4 cells^3 atoms.

    Args:
        cells: Lattice cells along a side; the start is soon forgotten.
        density: Atoms per sigma^3.
        temperature: At the start [epsilon / k].
        cooling: Drag coefficient [mass / time].
        seed: Of the velocities.
    """
    count = 4 * cells**3
    side = (count / density) ** (1 / 3)
    scene = ps.Scene(up_axis="z", periodic=((0, 0, 0), (side, side, side)))
    # A stretched simple cubic start has another symmetry than the crystal that forms.
    edge = int(np.ceil(count ** (1 / 3)))
    start = ps.sample.lattice("sc", (edge, edge, edge), side / edge)
    atoms = scene.add_particles(
        start[np.linspace(0, len(start) - 1, count).astype(int)],
        velocity=ps.sample.maxwell_boltzmann(count, temperature, 1.0, seed=seed),
        radius=0.5,
        group="atoms",
    )
    scene.add_interaction(ps.LennardJones(atoms, cutoff=2.5, truncation="shift"))
    scene.add_interaction(ps.Drag(linear=cooling))
    return scene


def neighbors(sim: ps.Simulation, distance: float = 1.35) -> np.ndarray:
    """How many atoms each atom has within ``distance``."""
    x, side = sim.position, sim.model.box_length[0]
    result = np.zeros(len(x), dtype=int)
    for row, centre in enumerate(x):
        d = x - centre
        d -= side * np.round(d / side)
        result[row] = np.count_nonzero((d**2).sum(axis=1) < distance**2) - 1
    return result
