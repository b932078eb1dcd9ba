"""Contacts of bodies that bounce off each other: impulses that go through all that holds them."""

from __future__ import annotations

from typing import Any

import warp as wp

from ...engine.execution.launch import launch
from ...kernels.constraints.solving import contact_bounce as kernels


class ContactBounce:
    """The part of contacts in :class:`~particlesim.engine.constraining.bounces.Bounces`.

    Args:
        contact: A ``Contact``, attached.
    """

    def __init__(self, contact: Any):
        self.contact, self.model = contact, contact.model
        real = self.model.precision.scalar
        self.many = self.model.array([0.0] * self.model.particle_count, real)
        self._make_room()

    def _make_room(self) -> None:
        """As many entries as the rows have now."""
        touching, real = self.contact.touching, self.model.precision.scalar
        self.generation, entries = touching.generation, len(touching.struct.entry)
        self.push, self.more = (
            wp.zeros(entries, dtype=real, device=self.model.device) for _ in range(2)
        )

    def start(self, bounces: Any) -> None:
        """What the projection has made of velocities of pairs that bounce is taken back."""
        if self.generation != self.contact.touching.generation:
            self._make_room()
        kernel = kernels.start_kernel(self.model.precision)
        self._launch(kernel, bounces, self.many, self.push)

    def sweep(self, bounces: Any) -> None:
        """Once over all pairs that bounce."""
        precision = self.model.precision
        self._launch(kernels.find_kernel(precision), bounces, self.many, self.push, self.more)
        self._launch(kernels.give_kernel(precision), bounces, self.many, self.more)

    def _launch(self, kernel: wp.Kernel, *inputs: Any) -> None:
        it = self.contact
        everything = [it.pairs.pairs, it.touching.struct, it.bodies, *inputs]
        launch(kernel, it.count, everything, self.model.device)
