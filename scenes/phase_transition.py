"""A Lennard-Jones crystal is heated until it melts, and cooled until it freezes.

Reduced units. A bath that all atoms share takes the temperature up, and slowly down again. The
energy over the temperature, the caloric curve, rises by 3 an atom in the crystal (Dulong and Petit)
and jumps by the latent heat where it melts. On the way down it stays above for long: a crystal
without a surface melts when it is too hot, at some 1.9, and a liquid freezes when it is too cold,
at some 0.7. The known answer is the temperature, that of the bath.
"""

import numpy as np

import particlesim as ps

TIMES, TEMPERATURES = (0.0, 60.0, 90.0, 390.0), (0.3, 2.2, 0.9, 0.3)  # of the bath

frames = 650
settings = ps.Settings(dt=0.6, substeps=120, integrator="velocity_verlet")


def build(cells: int = 5, density: float = 1.0, slower: float = 1.0, seed: int = 0) -> ps.Scene:
    """A periodic box of 4 cells^3 atoms in an fcc lattice.

    Args:
        cells: Lattice cells along a side, at least 4.
        density: Atoms per sigma^3.
        slower: Factor on the times of the bath: heating and cooling take 390 times that.
        seed: Of the velocities and of the bath.
    """
    count = 4 * cells**3
    side = (count / density) ** (1 / 3)
    scene = ps.Scene(up_axis="z", periodic=((0, 0, 0), (side, side, side)))
    # In a lattice at rest half of the kinetic energy is soon in the springs.
    atoms = scene.add_particles(
        ps.sample.lattice("fcc", (cells, cells, cells), side / cells),
        velocity=ps.sample.maxwell_boltzmann(count, 2.0 * TEMPERATURES[0], 1.0, seed=seed),
        radius=0.5,
        group="atoms",
    )
    scene.add_interaction(ps.LennardJones(atoms, cutoff=2.5, truncation="shift"))
    ramp = (slower * np.array(TIMES), TEMPERATURES)
    bath = ps.VelocityRescaling(
        atoms, temperature=ramp, relaxation_time=0.1, degrees_of_freedom=3 * count - 3, seed=seed
    )
    scene.add_thermostat(bath)
    return scene


def caloric(sim: ps.Simulation) -> tuple[float, float, float]:
    """Temperatures of the bath and of the atoms, 2 K / (3 N - 3), and the energy an atom."""
    bath, found, n = sim.scenes[0].thermostats[0], sim.diagnostics(), sim.particle_count
    wanted = np.interp(sim.time, bath.times, bath.temperatures)
    return float(wanted), float(2 * found.kinetic[0] / (3 * n - 3)), float(found.energy[0] / n)


def order(sim: ps.Simulation, cells: int = 5) -> float:
    """|sum exp(i G.x)| / N over the start's (1 1 1): 1 at rest, about N^-1/2 when it is lost."""
    G = 2.0 * np.pi * cells / sim.model.box_length[0]
    return float(abs(np.exp(1j * (sim.position @ G)).mean()))


def error(sim: ps.Simulation) -> float:
    """Difference of the temperature from that of the bath, relative; it has its fluctuations."""
    wanted, temperature, _ = caloric(sim)
    return abs(temperature / wanted - 1.0)
