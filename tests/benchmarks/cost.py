"""Cost of a particle, from 1 000 to a million; and while a scene grows thirtyfold.

The liquid is that of lennard_jones.py. What grows is a cloud of drops, each a small crystal, that
fly apart, each in proportion to its place; it is compared with the same drops, as fast, that fly
side by side: both make their lists anew in every step, of equally many pairs.
"""

import numpy as np
from work.liquid import CUTOFF, SETTINGS, liquid, thermodynamics

import particlesim as ps
from particlesim.accuracy.bench.case import Case, Entry, Simulated

GROWTH = 30.0
CELLS, CONSTANT = 3, 1.5496  # of a drop's crystal: the fcc lattice at rest within the cutoff
APART = 9.0  # between the middles of drops
WARM, REPEATS = 3, 7


def still(count: int, work: int) -> Entry:
    """A liquid; blocks of about so many atom-steps."""

    def start(place):
        settings = SETTINGS.replace(threads=place.threads)
        sim = ps.Simulation(liquid(count), settings, device=place.device)
        return Simulated(sim, max(1, work // count), thermodynamics)

    return Entry(start)


def flying(side: int, frames: int, apart: bool) -> Entry:
    """Drops, ``side`` cubed: apart until they are thirty times as far, or as fast side by side."""
    drop = ps.sample.lattice("fcc", (CELLS,) * 3, CONSTANT)
    middles = APART * (np.indices((side,) * 3).reshape(3, -1).T - (side - 1) / 2)
    v = middles * (GROWTH - 1) / ((WARM + REPEATS) * frames * SETTINGS.dt)
    if not apart:
        v = np.full_like(v, np.sqrt(np.mean(v**2)))

    def start(place):
        scene = ps.Scene()
        scene.add_particles(
            (middles[:, None] + drop[None]).reshape(-1, 3), velocity=np.repeat(v, len(drop), axis=0)
        )
        scene.add_interaction(ps.LennardJones(cutoff=CUTOFF))
        settings = SETTINGS.replace(threads=place.threads)
        sim = ps.Simulation(scene, settings, device=place.device)
        return Simulated(sim, frames, lambda sim: {"bound": bound(sim)})

    return Entry(start)


def bound(sim: ps.Simulation) -> float:
    """Potential energy an atom."""
    return float(sim.diagnostics().potential[0]) / sim.particle_count


def case(largest: int = 1_000_000, side: int = 7, frames: int = 6) -> Case:
    """``largest``: number of atoms; ``side``: drops along an edge; ``frames``: of their blocks."""
    sizes = [count for count in (1000, 30_000, 1_000_000) if count <= largest]
    drops = f"{side**3} drops"
    return Case(
        title=f"cost of a particle up to {sizes[-1]:,} atoms, and of {drops} that fly",
        unit="atom-steps",
        ours={
            **{f"liquid of {count:,}": still(count, work=500_000) for count in sizes},
            f"{drops} side by side": flying(side, frames, apart=False),
            f"{drops} apart, to {GROWTH:g} times the extent": flying(side, frames, apart=True),
        },
        # The drops' atoms rest where they are; what rounding at 1500 sigma adds is 1e-4 of it.
        agree={"bound": 1e-3},
        warm=WARM,
        repeats=REPEATS,
    )
