"""Thermostats and barostats, as abstract parts of a scene."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from .. import validate
from .part import Interaction, Part


class Thermostat(Part):
    """A heat bath: it changes velocities in the middle of every drift, in turn with the others.

    What ``exchange`` may do is what ``apply`` of an :class:`Interaction` may. It is called by
    ``Integrator.drift`` and ``move``; a method of which stages go back in time takes none.
    """

    requires: frozenset[str] = frozenset({"velocity"})

    def exchange(self, state: Any, dt: float) -> None:
        """Change velocities as the bath does in ``dt``."""
        raise validate.undefined(self, "exchange(self, state, dt)")

    def fastest(self, scene: Any) -> float:
        """What a component of a velocity that it gives is about, at most [length/time]."""
        return 0.0


class Barostat(Thermostat):
    """It changes the box, and with it positions and velocities, where a thermostat acts.

    The box is ``state.box``, one row a world: its lower corner, which stays, its lengths, and one
    over these. ``interactions`` are those of the simulation, which tell their virial by
    ``measure``. There is one in a scene, of which all axes are periodic, nothing is pinned, and
    all parts follow the box.
    """

    requires: frozenset[str] = frozenset({"position", "velocity", "box"})
    interactions: Sequence[Interaction]  # once bound
