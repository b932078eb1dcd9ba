"""Memory of a particle: a liquid of a million atoms, and LAMMPS; water; grains.

Bytes are those that the process holds beyond what it had when the libraries were loaded, of our
programs with all compiled kernels and the scene itself in NumPy. Beside them what `explain` says,
of arrays and lists alone.
"""

from peers import lammps
from work.liquid import SETTINGS as LIQUID
from work.liquid import liquid
from work.water import SETTINGS as WATER
from work.water import STEP, water

import particlesim as ps
from particlesim.accuracy.bench.case import Case, Entry, Simulated


def explained(sim: ps.Simulation) -> dict[str, float]:
    """Bytes a particle of arrays and lists."""
    return {"explained": sim.explain().bytes_per_particle}


def dry(count: int, precision: str) -> Entry:
    """A liquid of atoms."""

    def start(place):
        settings = LIQUID.replace(precision=precision, threads=place.threads)
        return Simulated(ps.Simulation(liquid(count), settings, device=place.device), 1, explained)

    return Entry(start, precision)


def wet(side: int) -> Entry:
    """Water."""

    def start(place):
        settings = WATER.replace(threads=place.threads, dt=STEP, substeps=1)
        return Simulated(ps.Simulation(water(side), settings, device=place.device), 1, explained)

    return Entry(start)


def case(count: int = 1_000_000, side: int = 80) -> Case:
    """``count``: atoms; ``side``: particles of water along an edge."""
    return Case(
        title=f"{count:,} atoms, and {side**3:,} particles of water",
        unit="particle-substeps",
        ours={
            "liquid": dry(count, "float32"),
            "liquid, float64": dry(count, "float64"),
            "water": wet(side),
        },
        peers={"LAMMPS": lammps.melt(count, 1)},
        repeats=3,
    )
