"""Lennard-Jones liquid: one and two threads, a law of the user's own, one scene against worlds.

Run as ``python tests/benchmarks/molecular.py``. Reduced units, rho 0.8442, cutoff 2.5, skin 0.3,
dt 0.005, whole steps with velocity Verlet, as in LAMMPS's bench/in.lj.
"""

import numpy as np
from timing import rates, report

import particlesim as ps

SETTINGS = ps.Settings(
    dt=0.005, substeps=1, integrator="velocity_verlet", skin=0.3, threads=1, execution="threads"
)


@ps.law
def own_energy(r: float, epsilon: float, sigma: float):
    """Lennard-Jones as a user would write it: the energy only."""
    s2 = sigma * sigma / (r * r)
    s6 = s2 * s2 * s2
    return 4.0 * epsilon * (s6 * s6 - s6)


@ps.law
def own_force(r: float, epsilon: float, sigma: float):
    """The same with the force given."""
    s2 = sigma * sigma / (r * r)
    s6 = s2 * s2 * s2
    return 24.0 * epsilon * (2.0 * s6 * s6 - s6) / r


def liquid(count: int, density: float, interaction: ps.Interaction, seed: int = 0) -> ps.Scene:
    """``count`` atoms on a face-centred cubic lattice, at the melt benchmark's temperature."""
    cells = int(np.ceil((count / 4) ** (1 / 3) - 1e-9))
    side = (count / density) ** (1 / 3)
    x = ps.sample.lattice("fcc", (cells,) * 3, side / cells)
    scene = ps.Scene(periodic=((0, 0, 0), (side,) * 3))
    scene.add_particles(
        x[np.linspace(0, len(x) - 1, count).astype(int)],
        velocity=ps.sample.maxwell_boltzmann(count, 1.44, 1.0, seed=seed),
    )
    scene.add_interaction(interaction)
    return scene


def built_in() -> ps.Interaction:
    """The library's own Lennard-Jones."""
    return ps.LennardJones(cutoff=2.5)


def main() -> None:
    """Print the table."""

    def melt(interaction: ps.Interaction, **knobs):
        return lambda: ps.Simulation(
            liquid(32_000, 0.8442, interaction), SETTINGS.replace(**knobs), device="cpu"
        )

    own = {"cutoff": 2.5, "epsilon": 1.0, "sigma": 1.0}
    found = rates(
        {
            "LennardJones, 1 thread": melt(built_in()),
            "LennardJones, 2 threads": melt(built_in(), threads=2),
            "own energy, derived, 1 thread": melt(ps.PairPotential(own_energy, **own)),
            "own force, 1 thread": melt(ps.PairForce(own_force, **own)),
            "LennardJones, float64, 1 thread": melt(built_in(), precision="float64"),
        }
    )
    report("Lennard-Jones, 32 000 atoms, rho 0.8442", found)
    # At rho 0.7, so that a box of 100 atoms is two cutoffs wide.
    dilute = rates(
        {
            "one scene of 102 400 atoms": lambda: ps.Simulation(
                liquid(102_400, 0.7, built_in()), SETTINGS, device="cpu"
            ),
            "1024 worlds of 100 atoms": lambda: ps.Simulation(
                [liquid(100, 0.7, built_in(), seed) for seed in range(1024)],
                SETTINGS,
                device="cpu",
            ),
        },
        frames=8,
    )
    report("Lennard-Jones, rho 0.7", dilute)


if __name__ == "__main__":
    main()
