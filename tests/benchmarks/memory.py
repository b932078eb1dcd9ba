"""Memory of a particle: a liquid of a million atoms, and LAMMPS; water; grains.

Bytes are those that the process holds beyond what it had when the libraries were loaded, of our
programs with all compiled kernels and the scene itself in NumPy. `explain` says what the arrays and
lists alone take.
"""

from lennard_jones import ours as liquid_of
from peers import lammps
from work.water import SETTINGS as WATER
from work.water import water

import particlesim as ps
from particlesim.accuracy.bench.case import Case, Entry, Simulated


def wet(side: int) -> Entry:
    """Water."""

    def start(place):
        settings = WATER.replace(threads=place.threads, substeps=1)
        return Simulated(ps.Simulation(water(side), settings, device=place.device))

    return Entry(start)


def case(count: int = 1_000_000, side: int = 80) -> Case:
    """``count``: atoms; ``side``: particles of water along an edge."""
    built_in = ps.LennardJones(cutoff=2.5)
    return Case(
        title=f"{count:,} atoms, and {side**3:,} particles of water",
        unit="particle-substeps",
        ours={
            "liquid": liquid_of(count, built_in, "float32", 1),
            "liquid, float64": liquid_of(count, built_in, "float64", 1),
            "water": wet(side),
        },
        peers={"LAMMPS": lammps.melt(count, 1)},
        repeats=3,
    )
