"""Gravity between 100 000 bodies by a tree; pytreegrav and FMM3D.

A cold Plummer sphere falls in on itself, by leapfrog. Rates are those of all pairs in the same
time, as in gravity.py. Forces are off by some 5e-4 at an opening angle of 0.5 and 2e-5 at 0.2 (root
mean square, relative), pytreegrav's by some 2e-3 at its default and 8e-4 at 0.5, FMM3D's by 3e-5.
"""

from gravity import AGREE, SETTINGS, bodies
from peers import fmm3d, pytreegrav
from work.bodies import answers

import particlesim as ps
from particlesim.accuracy.bench.case import Case, Entry, Simulated


def ours(count: int, steps: int, angle: float, precision: str) -> Entry:
    """Bodies of ours, by a tree."""

    def start(place):
        settings = SETTINGS.replace(
            precision=precision, threads=place.threads, opening_angle=angle
        )  # fmt: skip
        sim = ps.Simulation(bodies(count), settings, device=place.device)
        return Simulated(sim, steps, found, work=steps * count**2)

    return Entry(start, precision)


def found(sim: ps.Simulation) -> dict[str, float]:
    """Of the answers the one that no sum over all pairs is needed for."""
    return answers(sim.position.astype(float), sim.velocity.astype(float), softened=False)


def case(count: int = 100_000, steps: int = 1) -> Case:
    """``steps``: of a block."""
    return Case(
        title=f"gravity between {count:,} bodies by a tree, {steps} steps a block",
        unit="pairs",
        ours={
            "Gravity, 0.5": ours(count, steps, 0.5, "float32"),
            "Gravity, 0.2": ours(count, steps, 0.2, "float32"),
            "Gravity, 0.2, float64": ours(count, steps, 0.2, "float64"),
        },
        peers={
            "pytreegrav, 0.7": pytreegrav.bodies(count, steps, "tree", 0.7),
            "pytreegrav, 0.5": pytreegrav.bodies(count, steps, "tree", 0.5),
            "FMM3D, 1e-4": fmm3d.bodies(count, steps, 1e-4),
        },
        agree={"infall": AGREE["infall"]},
        warm=1,
        repeats=5,
    )
