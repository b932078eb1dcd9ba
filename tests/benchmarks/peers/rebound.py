"""REBOUND (Rein and Liu 2012), float64: direct sums and leapfrog, on one core."""

import numpy as np
from work.bodies import SOFTENING, STEP, answers, plummer

from particlesim.accuracy.bench.case import Entry, Place, Running


class Bodies(Running):
    """A block is so many steps."""

    def __init__(self, place: Place, count: int, steps: int):
        import rebound

        self.sim = rebound.Simulation()
        self.sim.integrator, self.sim.gravity = "leapfrog", "basic"
        self.sim.softening, self.sim.dt = SOFTENING, STEP
        for x, y, z in plummer(count):
            self.sim.add(m=1.0 / count, x=x, y=y, z=z)
        self.steps, self.work, self.particles = steps, steps * count**2, count

    def advance(self) -> None:
        self.sim.steps(self.steps)

    def answers(self) -> dict[str, float]:
        x, v = np.zeros((self.particles, 3)), np.zeros((self.particles, 3))
        self.sim.synchronize()
        self.sim.serialize_particle_data(xyz=x, vxvyvz=v)
        return answers(x, v)


def bodies(count: int, steps: int) -> Entry:
    """The sphere."""
    return Entry(lambda place: Bodies(place, count, steps), "float64", "rebound")
