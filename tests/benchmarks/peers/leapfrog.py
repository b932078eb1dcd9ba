"""Leapfrog around a library that gives forces only."""

from collections.abc import Callable

import numpy as np
from work.bodies import STEP, answers, plummer

from particlesim.accuracy.bench.case import Running


class Leapfrog(Running):
    """A block is so many steps of velocity Verlet from rest.

    Args:
        count: Bodies.
        steps: Of a block.
        accelerate: Accelerations at positions, (n, 3) to (n, 3).
    """

    def __init__(self, count: int, steps: int, accelerate: Callable[[np.ndarray], np.ndarray]):
        self.x, self.accelerate = plummer(count), accelerate
        self.v, self.a = np.zeros_like(self.x), accelerate(self.x)
        self.steps, self.work, self.particles = steps, steps * count**2, count

    def advance(self) -> None:
        for _ in range(self.steps):
            self.v += 0.5 * STEP * self.a
            self.x += STEP * self.v
            self.a = self.accelerate(self.x)
            self.v += 0.5 * STEP * self.a

    def answers(self) -> dict[str, float]:
        return answers(self.x, self.v, softened=False)
