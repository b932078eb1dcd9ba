"""Cloth of 101 x 101 knots, one iteration a substep; pyPBD."""

from peers import pypbd
from work.cloth import SETTINGS, cloth, knots

import particlesim as ps
from particlesim.accuracy.bench.case import Case, Entry, Simulated

# How far the middle has come down after some seconds: it falls by g t^2 / 2, with t counted a
# substep apart or not by the two orders of kick and drift, and then hangs and swings. A block is
# long enough to wake the threads of whoever comes next: their sleep is not what is measured.
AGREE = {"height": 0.03}


def ours(side: int, iterations: int, frames: int, precision: str = "float32", **knobs) -> Entry:
    """A cloth of ours; a unit of work is a distance in an iteration."""
    distances = len(knots(side)[1])

    def start(place):
        settings = SETTINGS.replace(
            iterations=iterations, precision=precision, threads=place.threads, **knobs
        )
        sim = ps.Simulation(cloth(side), settings, device=place.device)
        work = frames * settings.substeps * iterations * distances
        return Simulated(sim, frames, lambda sim: {"height": sim.position[:, 1].mean()}, work)

    return Entry(start, precision)


def case(side: int = 101, iterations: int = 1, frames: int = 20) -> Case:
    """``side``: knots along an edge."""
    return Case(
        title=f"cloth of {side} x {side} knots, {len(knots(side)[1]):,} distances, {iterations} "
        f"iteration{'s' if iterations > 1 else ''} a substep",
        unit="distances x iterations",
        ours={
            "Distance": ours(side, iterations, frames),
            "Distance, plain sums": ours(side, iterations, frames, compensated=False),
            "Distance, float64": ours(side, iterations, frames, "float64"),
        },
        peers={"pyPBD": pypbd.cloth(side, iterations, frames)},
        agree=AGREE,
    )
