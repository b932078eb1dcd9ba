"""Grains in contact, 27 000: with and without friction, beside a boulder of 100 radii; Newton.

A timed block is some frames of 20 substeps, while the grains fall and settle.
"""

from peers import newton
from work.grains import SETTINGS, block, height

import particlesim as ps
from particlesim.accuracy.bench.case import Case, Entry, Simulated

# The mean height falls from half the block's by some grains' radii while it settles; solvers differ
# in how much overlap their one iteration leaves at the bottom of thirty layers.
AGREE = {"height": 0.05}


def ours(side: int, friction: float, frames: int, precision: str = "float32", boulder: float = 0.0):
    """A block of ours."""

    def start(place):
        settings = SETTINGS.replace(precision=precision, threads=place.threads)
        sim = ps.Simulation(block(side, friction, boulder), settings, device=place.device)
        # Smooth grains come to lie lower: they are compared in nothing.
        return Simulated(sim, frames, height(side) if friction else lambda sim: {})

    return Entry(start, precision)


def case(side: int = 30, frames: int = 2, iterations: int = 1) -> Case:
    """``side``: grains along an edge; ``iterations``: of Newton's solver."""
    return Case(
        title=f"{side**3:,} grains in contact, one iteration a substep",
        unit="particle-substeps",
        ours={
            "with friction": ours(side, 0.3, frames),
            "without": ours(side, 0.0, frames),
            "beside a boulder": ours(side, 0.3, frames, boulder=100.0),
            "float64": ours(side, 0.3, frames, "float64"),
        },
        peers={"Newton XPBD": newton.grains(side, 0.3, frames, iterations)},
        agree=AGREE,
    )
