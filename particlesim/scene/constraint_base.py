"""Constraints as abstract parts of a scene."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from .. import validate
from .part import Part


class ConstraintBase(Part):
    """Acts on positions after integration.

    In a substep: ``begin`` once, then ``project`` in each iteration, in turn with the other
    constraints, by ``rank``; then the velocities follow the projection, what has met something
    bounces off, and ``finish``. Corrections are added to ``state.position`` and, the same amount,
    to ``state.correction``. What these methods may do is what ``apply`` of an :class:`Interaction`
    may.

    Example:
        >>> import warp as wp
        >>> from particlesim import ConstraintBase, Scene, Settings, Simulation, launch
        >>> Vectors = wp.array(dtype=wp.vec3)
        >>> @wp.kernel(module="unique")
        ... def lift(first: int, height: float, x: Vectors, correction: Vectors):
        ...     i = first + wp.tid()
        ...     up = wp.vec3(0.0, wp.max(height - x[i][1], 0.0), 0.0)
        ...     x[i] = x[i] + up
        ...     correction[i] = correction[i] + up
        >>> class Floor(ConstraintBase):
        ...     def __init__(self, height):
        ...         self.height = height
        ...
        ...     def prepare(self, model, neighbors):
        ...         self.model = model
        ...
        ...     def project(self, state, neighbors, dt):
        ...         inputs = [self.height, state.position, state.correction]
        ...         launch(lift, state.count, inputs, self.model.device)
        >>> scene = Scene()
        >>> stone = scene.add_particles([(0, 1, 0)], velocity=(3, -4, 0))
        >>> floor = scene.add_constraint(Floor(0.5))
        >>> sim = Simulation(scene, Settings(dt=0.5), device="cpu")
        >>> sim.run(2)
        >>> sim.position.round(5).tolist(), sim.velocity.round(5).tolist()
        ([[3.0, 0.5, 0.0]], [[3.0, 0.0, 0.0]])
    """

    rank = 0  # of what is swept first: 0 holds bodies together, 1 apart, 2 within boundaries
    rigid_bodies = (
        False  # an impulse goes through what it holds at once: what hits it is an impulse
    )
    solid = False  # it is what holds a continuum, and has ``wall``

    def wall(self, model: Any, state: Any) -> Any:
        """A :class:`~particlesim.scene.wall.Wall`, if it is solid; also before ``prepare``."""
        raise validate.undefined(self, "wall(self, model, state)")

    def meet(self, constraints: Sequence[ConstraintBase]) -> None:
        """Before ``prepare``: all constraints of the simulation, as they were added."""

    def begin(self, state: Any, neighbors: Any, dt: float) -> None:
        """At the start of a substep's projection."""

    def project(self, state: Any, neighbors: Any, dt: float) -> None:
        """One sweep."""
        raise validate.undefined(self, "project(self, state, neighbors, dt)")

    def go_on(self, count: Any, omega: Any) -> None:
        """Positions went on as ``Settings.acceleration`` says: multipliers do so, too."""

    def look(self, flag: Any, tolerance: float) -> None:
        """Set the flag if something is missed by more than ``Settings.constraint_tolerance``."""

    def finish(self, state: Any, neighbors: Any, dt: float) -> None:
        """After the velocities have followed and what met has bounced off: damping, breaking."""

    @property
    def bounces(self) -> bool:
        """Whether what it holds may bounce off; asked for once, when all parts are attached."""
        return False

    def start_bounce(self, state: Any, neighbors: Any, bounces: Any, dt: float) -> None:
        """The velocities have followed: who bounces off, at what speed? Of who ``bounces``.

        ``bounces`` is a struct (``kernels.engine.bounces``): velocities ``before`` the sweeps, and
        worlds to be swept ``again``, which whoever is too slow marks. What a projection has made of
        the velocity of who bounces off is taken back: the sweeps give the whole impulse.
        """

    def prepare_bounce(self, state: Any, neighbors: Any, bounces: Any, dt: float) -> None:
        """Somebody bounces off: the sweeps are about to begin."""

    def bounce(self, state: Any, neighbors: Any, bounces: Any, dt: float) -> None:
        """One sweep over the velocities of worlds that are ``running``, by impulses alone.

        What holds a body together takes care that the change of its velocities since ``before``
        leaves it as it is.
        """

    def measure(self, state: Any, energy: Any, virial: Any) -> None:
        """Add the virial of each particle (float64) in the last substep, on demand."""

    def measure_stress(self, state: Any, energy: Any, stress: Any) -> bool:
        """The same as a tensor, as of :class:`Interaction`; False: it is not known."""
        return False

    def read_force(self, part: Part) -> np.ndarray:
        """See ``Simulation.force``; ``part`` is this, or the one of some worlds' scenes."""
        raise self._unknown("force")

    def read_broken(self, part: Part) -> np.ndarray:
        """See ``Simulation.broken``."""
        raise self._unknown("broken")

    def _unknown(self, what: str) -> ValueError:
        return validate.fail(
            f"Simulation.{what}", "constraint", "hold tuples of particles", self.name,
            "name a Constraint",
        )  # fmt: skip

    def shapes(self) -> list[dict[str, Any]]:
        """Static shapes to draw."""
        return []
