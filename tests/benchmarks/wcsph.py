"""Weakly compressible SPH, 59 000 particles at rest: both precisions, SPlisHSPlasH.

Support two spacings (30 neighbours), cubic spline, Tait, artificial viscosity. Walls are springs
with us and particles (Akinci et al. 2012) with SPlisHSPlasH, which are 20 000 more to look at.
"""

from peers import splishsplash
from work.water import SETTINGS, answers, flowing, water

import particlesim as ps
from particlesim.accuracy.bench.case import Case, Entry, Simulated

# Walls of springs and of particles hold the water some tenth of a spacing apart from each other.
AGREE = {"height": 0.03, "front": 0.03}


def ours(side: int, length: float, start: float, frames: int, precision: str) -> Entry:
    """Water of ours."""

    def begin(place):
        settings = SETTINGS.replace(precision=precision, threads=place.threads)
        sim = ps.Simulation(water(side, length), settings, device=place.device)
        if start:
            sim.position, sim.velocity = flowing(side, length, start, place.threads)
        return Simulated(sim, frames, lambda sim: answers(sim.position))

    return Entry(begin, precision)


def case(side: int = 39, length: float = 1.0, start: float = 0.0, frames: int = 2) -> Case:
    """``side``: particles along an edge; ``length``: of the trough, in columns; ``start``: [s]."""
    where = f"after {start:g} s of a trough of {length:g} columns" if start else "at rest"
    return Case(
        title=f"{side**3:,} particles of water {where}, {frames * SETTINGS.substeps} steps a block",
        unit="particle-steps",
        ours={
            "SPH": ours(side, length, start, frames, "float32"),
            "SPH, float64": ours(side, length, start, frames, "float64"),
        },
        peers={"SPlisHSPlasH": splishsplash.water(side, length, start, frames)},
        agree=AGREE,
        warm=2,
        repeats=5,
    )
