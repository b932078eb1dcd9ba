"""Newton (Linux Foundation, 2025), on the same Warp: its XPBD solver, float32, on one core."""

import numpy as np
from work.grains import GRAVITY, RADIUS, SETTINGS, places

from particlesim.accuracy.bench.case import Entry, Place, Running


class Grains(Running):
    """A block is so many frames of the settings' substeps; contacts with the ground are looked for
    once a frame, those between particles once a substep.
    """

    def __init__(self, place: Place, side: int, friction: float, frames: int, iterations: int):
        import newton
        import warp as wp

        x = places(side)
        builder = newton.ModelBuilder(up_axis=newton.Axis.Y, gravity=(0.0, -GRAVITY, 0.0))
        builder.add_particles(
            pos=[tuple(row) for row in x], vel=[(0.0, 0.0, 0.0)] * len(x), mass=[1.0] * len(x),
            radius=[RADIUS] * len(x),
        )  # fmt: skip
        builder.add_ground_plane()
        with wp.ScopedDevice("cpu"):
            self.model = builder.finalize()
            self.model.particle_mu = self.model.soft_contact_mu = friction
            self.solver = newton.solvers.SolverXPBD(self.model, iterations=iterations)
            self.states = self.model.state(), self.model.state()
            self.control, self.contacts = self.model.control(), self.model.contacts()
        self.frames, self.substeps = frames, SETTINGS.substeps
        self.dt = SETTINGS.substep
        self.particles, self.work = len(x), frames * self.substeps * len(x)

    def advance(self) -> None:
        now, then = self.states
        for _ in range(self.frames):
            self.model.collide(now, self.contacts)
            for _ in range(self.substeps):
                now.clear_forces()
                self.solver.step(now, then, self.control, self.contacts, self.dt)
                now, then = then, now
        self.states = now, then

    def answers(self) -> dict[str, float]:
        return {"height": float(np.mean(self.states[0].particle_q.numpy()[:, 1]))}


def grains(side: int, friction: float, frames: int, iterations: int) -> Entry:
    """The block."""
    return Entry(
        lambda place: Grains(place, side, friction, frames, iterations), "float32", "newton"
    )
