"""Timing on shared machines: runs in turn, and the median of their rates."""

import statistics
import time
from collections.abc import Callable, Mapping

import particlesim as ps


def rates(
    simulations: Mapping[str, Callable[[], ps.Simulation]], frames: int = 20, repeats: int = 7
) -> dict[str, float]:
    """Particle-substeps a second of each simulation, the median over alternating repeats.

    Args:
        simulations: What to time; each is made once and warmed up before anything is timed.
        frames: Frames a repeat.
        repeats: How often each is timed, in turn, so that a noisy machine disturbs all alike.
    """
    made = {name: make() for name, make in simulations.items()}
    for sim in made.values():
        for _ in range(max(6, frames // 4)):
            sim.step()
    found: dict[str, list[float]] = {name: [] for name in made}
    for _ in range(repeats):
        for name, sim in made.items():
            start = time.perf_counter()
            for _ in range(frames):
                sim.step()
            seconds = time.perf_counter() - start
            found[name].append(frames * sim.settings.substeps * sim.particle_count / seconds)
    return {name: statistics.median(each) for name, each in found.items()}


def report(title: str, found: Mapping[str, float], unit: str = "M particle-substeps/s") -> None:
    """Print rates, in millions."""
    print(title)
    for name, rate in found.items():
        print(f"  {name:<34} {rate / 1e6:8.2f} {unit}")
