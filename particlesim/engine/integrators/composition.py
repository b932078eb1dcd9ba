"""Compositions: velocity Verlet in stages of several lengths, of higher order."""

from __future__ import annotations

from ..limit import composed_step
from .velocity_verlet import VelocityVerlet


class Composition(VelocityVerlet):
    """Velocity Verlet steps of w_1 dt, w_2 dt, ... one after the other; a member names the w.

    Where the w are the same from either end and their cubes add up to 0, errors of third order
    cancel, and those of even order are none: the order is 4, and more with more conditions
    (Yoshida 1990). One evaluation of the forces a stage: each starts from those that
    the last has ended with. The map is symplectic and symmetric in time as its stages are.
    """

    def largest_step(self, omega_squared: float, gamma: float) -> float:
        """Largest stable step of x'' = -omega^2 x; it takes no damping."""
        return composed_step(self.stages, omega_squared)
