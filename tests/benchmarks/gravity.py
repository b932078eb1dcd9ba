"""Gravity between 4 000 bodies, all pairs, both precisions; REBOUND, pytreegrav and FMM3D.

A cold sphere falls in on itself, by leapfrog. REBOUND and pytreegrav's direct sum look at all pairs
too; a tree and multipoles do not, and are counted as if they did: n^2 pairs a step.
"""

import numpy as np
from peers import fmm3d, pytreegrav, rebound
from work.bodies import SETTINGS, answers, bodies

import particlesim as ps
from particlesim.accuracy.bench.case import Case, Entry, Simulated

# Trees and multipoles are asked for forces to a few thousandths. The energy is kept by leapfrog to
# some 1e-4 while the sphere falls, and summed here in double precision for all.
AGREE = {"infall": 0.01, "energy": 1e-3}


def ours(count: int, precision: str, steps: int) -> Entry:
    """Bodies of ours."""

    def start(place):
        settings = SETTINGS.replace(precision=precision, threads=place.threads)
        sim = ps.Simulation(bodies(count), settings, device=place.device)
        return Simulated(sim, steps, found, work=steps * count**2)

    return Entry(start, precision)


def found(sim: ps.Simulation) -> dict[str, float]:
    """Of the answers, in double precision."""
    return answers(np.asarray(sim.position, float), np.asarray(sim.velocity, float))


def case(count: int = 4000, steps: int = 10) -> Case:
    """``steps``: of a block."""
    return Case(
        title=f"gravity between {count:,} bodies, {steps} steps a block",
        unit="pairs",
        ours={
            "Gravity": ours(count, "float32", steps),
            "Gravity, float64": ours(count, "float64", steps),
        },
        peers={
            "REBOUND": rebound.bodies(count, steps),
            "pytreegrav, direct": pytreegrav.bodies(count, steps, "bruteforce"),
            "pytreegrav, tree": pytreegrav.bodies(count, steps, "tree"),
            "FMM3D, 1e-4": fmm3d.bodies(count, steps, 1e-4),
        },
        agree=AGREE,
        repeats=5,
    )
