"""1024 worlds of 100 atoms, against one scene of 102 400.

At rho 0.7, so that a box of 100 atoms is two cutoffs wide.
"""

from work.liquid import SETTINGS, liquid

import particlesim as ps
from particlesim.accuracy.bench.case import Case, Entry, Simulated

DENSITY = 0.7


def ours(worlds: int, count: int, frames: int) -> Entry:
    """So many worlds of so many atoms."""

    def begin(place):
        settings = SETTINGS.replace(threads=place.threads)
        scenes = [liquid(count, density=DENSITY, seed=seed) for seed in range(worlds)]
        sim = ps.Simulation(scenes, settings, device=place.device)
        start = energy(sim)
        return Simulated(sim, frames, lambda sim: {"energy over start": energy(sim) / start})

    return Entry(begin)


def energy(sim: ps.Simulation) -> float:
    """Of all worlds."""
    return float(sim.diagnostics().energy.sum())


def case(worlds: int = 1024, count: int = 100, frames: int = 8) -> Case:
    """``count``: atoms of a world."""
    return Case(
        title=f"{worlds:,} worlds of {count:,} atoms against one scene of {worlds * count:,}",
        unit="atom-steps",
        ours={
            "one scene": ours(1, worlds * count, frames),
            "worlds": ours(worlds, count, frames),
        },
        # The lattices differ, each cut to fit its number. As they melt, a shell of atoms leaves or
        # enters the cutoff, where a pair is worth 0.016: one pair an atom is 1.5 % of its energy.
        agree={"energy over start": 0.03},
    )
