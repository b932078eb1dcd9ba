"""Lennard-Jones liquid of 32 000 atoms, also by one's own laws; LAMMPS, GROMACS, OpenMM.

rho 0.8442, cutoff 2.5, skin 0.3, dt 0.005, whole steps with velocity Verlet. LAMMPS and GROMACS
renew their lists every 20 steps, as in bench/in.lj; everybody else when an atom has moved half the
skin, which is sooner.
"""

from peers import gromacs, lammps, openmm
from work.liquid import CUTOFF, SETTINGS, liquid, thermodynamics

import particlesim as ps
from particlesim.accuracy.bench.case import Case, Entry, Simulated


@ps.law
def own_energy(r: float, epsilon: float, sigma: float):
    """Lennard-Jones as a user would write it: the energy only."""
    s2 = sigma * sigma / (r * r)
    s6 = s2 * s2 * s2
    return 4.0 * epsilon * (s6 * s6 - s6)


@ps.law
def own_force(r: float, epsilon: float, sigma: float):
    """The same with the force given."""
    s2 = sigma * sigma / (r * r)
    s6 = s2 * s2 * s2
    return 24.0 * epsilon * (2.0 * s6 * s6 - s6) / r


OWN = {"cutoff": CUTOFF, "epsilon": 1.0, "sigma": 1.0}
# Chaos makes everybody's atoms go their own ways within a hundred steps. The energy stays, up to
# the jumps of a potential that is cut off at -0.016: each pair that enters or leaves brings or
# takes as much, and what they do to the average is below 0.2 % of it over some hundred steps. The
# pressure of 32 000 atoms fluctuates by some 0.01 (Lebowitz et al. 1967: as 1 / sqrt(N)) about 0.7
# once melted: 5 % are three deviations.
AGREE = {"energy": 2e-3, "pressure": 0.05}


def ours(
    count: int, interaction: ps.Interaction, precision: str, frames: int, same: bool = True
) -> Entry:
    """A liquid of ours; ``same``: as everybody's, so that the answers agree."""

    def answers(sim):
        if not same:
            return {}
        found = thermodynamics(sim)
        if isinstance(interaction, ps.PairForce):  # a force that is given has no energy
            del found["energy"]
        return found

    def start(place):
        settings = SETTINGS.replace(precision=precision, threads=place.threads)
        sim = ps.Simulation(liquid(count, interaction), settings, device=place.device)
        return Simulated(sim, frames, answers)

    return Entry(start, precision)


def case(count: int = 32_000, frames: int = 100) -> Case:
    """``frames``: steps of a block; GROMACS makes its list once more in each."""
    built_in = ps.LennardJones(cutoff=CUTOFF)  # in r^2; with its force shifted it is written in r
    in_r = ps.LennardJones(cutoff=CUTOFF, truncation="force_shift")
    return Case(
        title=f"Lennard-Jones liquid, {count:,} atoms, {frames} steps a block",
        unit="atom-steps",
        ours={
            "LennardJones": ours(count, built_in, "float32", frames),
            "LennardJones, float64": ours(count, built_in, "float64", frames),
            "in r": ours(count, in_r, "float32", frames, same=False),
            "own energy": ours(count, ps.PairPotential(own_energy, **OWN), "float32", frames),
            "own force": ours(count, ps.PairForce(own_force, **OWN), "float32", frames),
        },
        peers={
            "LAMMPS": lammps.melt(count, frames),
            "GROMACS": gromacs.melt(count, frames),
            "OpenMM": openmm.melt(count, frames),
        },
        agree=AGREE,
    )
