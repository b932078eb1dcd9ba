"""OpenMM (Eastman et al. 2024), its CPU platform, in mixed precision."""

from work.liquid import CUTOFF, STEP, atoms

from particlesim.accuracy.bench.case import Entry, Place, Running


class Melt(Running):
    """A block of so many steps; nm, ps, g/mol and kJ/mol are the reduced units."""

    def __init__(self, place: Place, count: int, steps: int):
        import openmm

        x, v, side = atoms(count)
        system = openmm.System()
        system.setDefaultPeriodicBoxVectors((side, 0, 0), (0, side, 0), (0, 0, side))
        force = openmm.NonbondedForce()
        force.setNonbondedMethod(force.CutoffPeriodic)
        force.setCutoffDistance(CUTOFF)
        force.setUseDispersionCorrection(False)
        for _ in range(count):
            system.addParticle(1.0)
            force.addParticle(0.0, 1.0, 1.0)
        system.addForce(force)
        self.integrator = openmm.VerletIntegrator(STEP)
        self.context = openmm.Context(
            system, self.integrator, openmm.Platform.getPlatformByName("CPU"),
            {"Threads": str(place.threads)},
        )  # fmt: skip
        self.context.setPositions(x)
        self.context.setVelocities(v)
        self.steps, self.work, self.particles = steps, count * steps, count

    def advance(self) -> None:
        self.integrator.step(self.steps)

    def answers(self) -> dict[str, float]:
        state = self.context.getState(getEnergy=True)
        energy = state.getKineticEnergy() + state.getPotentialEnergy()
        return {"energy": energy._value / self.particles}


def melt(count: int, steps: int) -> Entry:
    """The liquid."""
    return Entry(lambda place: Melt(place, count, steps), "mixed", "openmm")
