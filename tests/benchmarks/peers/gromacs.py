"""GROMACS (Abraham et al. 2015) as the system has it, in mixed precision.

With sigma in nm, epsilon in kJ/mol and the mass in g/mol its units are the reduced ones: its time
unit is then sqrt(m sigma^2 / epsilon).
"""

import re
import subprocess
import tempfile
from pathlib import Path

import numpy as np
from work.liquid import CUTOFF, SKIN, STEP, atoms

from particlesim.accuracy.bench.case import Entry, Place, Running

BAR = 16.6054  # in kJ/mol/nm^3: 1e5 Pa times nm^3 over kJ/mol is 1 / 16.6054

TOPOLOGY = """
[ defaults ]
1 1 no
[ atomtypes ]
A 1.0 0.0 A 4.0 4.0
[ moleculetype ]
A 0
[ atoms ]
1 A 1 A A 1 0.0 1.0
[ system ]
liquid
[ molecules ]
A {count}
"""

SETTINGS = """
integrator = md
dt = {step}
nsteps = {steps}
nstenergy = {steps}
nstlog = {steps}
nstcalcenergy = {steps}
nstcomm = 0
comm-mode = none
cutoff-scheme = Verlet
nstlist = 20
verlet-buffer-tolerance = -1
rlist = {rlist}
coulombtype = Cut-off
rcoulomb = {cutoff}
vdw-modifier = None
rvdw = {cutoff}
DispCorr = no
"""


class Melt(Running):
    """A block of so many steps, from where the last one ended."""

    def __init__(self, place: Place, count: int, steps: int):
        self.threads, self.work, self.particles = place.threads, count * steps, count
        self._folder = tempfile.TemporaryDirectory()
        self.folder = Path(self._folder.name)
        x, v, side = atoms(count)
        _write(self.folder / "now.g96", x, v, side)
        (self.folder / "topol.top").write_text(TOPOLOGY.format(count=count))
        text = SETTINGS.format(step=STEP, steps=steps, cutoff=CUTOFF, rlist=CUTOFF + SKIN)
        (self.folder / "grompp.mdp").write_text(text)
        self.found: dict[str, float] = {}

    def advance(self) -> float:
        self._gmx("grompp", "-c", "now.g96", "-maxwarn", "9")
        self._gmx(
            "mdrun", "-ntmpi", "1", "-ntomp", str(self.threads), "-pin", "off", "-c", "now.g96",
            "-nb", "cpu",
        )  # fmt: skip
        log = (self.folder / "md.log").read_text(errors="replace")
        self.found = _energies(log)
        # Its own clock, which leaves out the start; nor does the end count, which is written here
        # only to go on from.
        whole = float(re.search(r"Time:\s+\S+\s+(\S+)", log).group(1))
        return whole - float(re.search(r"Write traj\.(?:\s+\d+){3}\s+(\S+)", log).group(1))

    def answers(self) -> dict[str, float]:
        return {
            "energy": self.found["Total Energy"] / self.particles,
            "pressure": self.found["Pressure (bar)"] / BAR,
        }

    def _gmx(self, *words: str) -> None:
        done = subprocess.run(["gmx", *words], cwd=self.folder, capture_output=True)
        if done.returncode:
            raise RuntimeError(f"gmx {words[0]}: {done.stderr[-300:].decode(errors='replace')}")


def _write(path: Path, x: np.ndarray, v: np.ndarray, side: float) -> None:
    """A start, with all digits."""
    with path.open("w") as file:
        for block, rows in (("POSITION", x), ("VELOCITY", v)):
            file.write("TITLE\nliquid\nEND\n" if block == "POSITION" else "")
            file.write(f"{block}RED\n")
            np.savetxt(file, rows, "%15.9f%15.9f%15.9f", delimiter="")
            file.write("END\n")
        file.write(f"BOX\n{side:15.9f}{side:15.9f}{side:15.9f}\nEND\n")


def _energies(log: str) -> dict[str, float]:
    """The last energies that a log has: names in columns of 15 letters over their values."""
    block = log[: log.index("A V E R A G E S")].rpartition("Energies (kJ/mol)\n")[2]
    lines = [line for line in block.splitlines() if line.strip()]
    found = {}
    for names, values in zip(lines[::2], lines[1::2], strict=False):
        if not re.fullmatch(r"[-+.eE\d\s]+", values):
            break
        heads = [names[at : at + 15].strip() for at in range(0, len(names), 15)]
        found |= dict(zip(heads, map(float, values.split()), strict=False))
    return found


def melt(count: int, steps: int) -> Entry:
    """The liquid."""
    return Entry(lambda place: Melt(place, count, steps), "mixed", "gmx")
