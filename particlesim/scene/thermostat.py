"""Thermostats, as abstract parts of a scene."""

from __future__ import annotations

from typing import Any

from .. import validate
from .part import Part


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
