"""A triple pendulum, frames of 20 substeps: what a scene of few particles costs."""

import numpy as np

import particlesim as ps
from particlesim.accuracy.bench.case import Case, Entry, Simulated
from particlesim.scenes import triple_pendulum


def ours(precision: str, frames: int) -> Entry:
    """The ready scene."""

    def start(place):
        settings = ps.Settings(dt=1 / 60, substeps=20, precision=precision, threads=place.threads)
        sim = ps.Simulation(triple_pendulum.build(), settings, device=place.device)
        return Simulated(sim, frames, lambda sim: {"rods": rods(sim)}, frames)

    return Entry(start, precision)


def rods(sim: ps.Simulation) -> float:
    """Their mean length [m]; chaos leaves nothing else to compare."""
    return float(np.linalg.norm(np.diff(sim.position, axis=0), axis=1).mean())


def case(frames: int = 500) -> Case:
    """``frames``: of a block."""
    return Case(
        title=f"triple pendulum, 20 substeps a frame, {frames} frames a block",
        unit="frames",
        ours={"Distance": ours("float32", frames), "Distance, float64": ours("float64", frames)},
        agree={"rods": 1e-3},
    )
