"""PositionBasedDynamics (Bender et al. 2017), float64: its distance constraints by XPBD."""

import numpy as np
from work.cloth import COMPLIANCE, GRAVITY, MASS, SETTINGS, knots

from particlesim.accuracy.bench.case import Entry, Place, Running


class Cloth(Running):
    """A block is so many frames; contacts are not looked for."""

    def __init__(self, place: Place, side: int, iterations: int, frames: int):
        import pypbd

        x, pairs, pinned = knots(side)
        self.simulation = pypbd.Simulation.getCurrent()
        self.simulation.initDefault()
        self.model = self.simulation.getModel()
        self.particles_of_model = self.model.getParticles()
        for place_of, fixed in zip(x, pinned, strict=True):
            self.particles_of_model.addVertex(place_of)
            last = self.particles_of_model.size() - 1
            self.particles_of_model.setMass(last, 0.0 if fixed else MASS)
        for i, j in pairs:
            self.model.addDistanceConstraint_XPBD(int(i), int(j), 1.0 / COMPLIANCE)
        self.step = self.simulation.getTimeStep()
        self.step.setValueUInt(pypbd.TimeStepController.NUM_SUB_STEPS, SETTINGS.substeps)
        self.step.setValueUInt(pypbd.TimeStepController.MAX_ITERATIONS, iterations)
        pypbd.TimeManager.getCurrent().setTimeStepSize(SETTINGS.dt)
        self.frames = frames
        self.work = frames * SETTINGS.substeps * iterations * len(pairs)

    def advance(self) -> None:
        for _ in range(self.frames):
            self.step.step(self.model)

    def answers(self) -> dict[str, float]:
        count = self.particles_of_model.size()
        y = [self.particles_of_model.getPosition(k)[1] for k in range(count)]
        return {"height": float(np.mean(y))}


def cloth(side: int, iterations: int, frames: int) -> Entry:
    """The cloth."""
    assert GRAVITY == 9.81  # the library's own
    return Entry(lambda place: Cloth(place, side, iterations, frames), "float64", "pypbd")
