"""Forces between particles and a field: they act on it, it goes its way, it acts on them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import warp as wp

from ... import validate
from ...engine.limit import Limit
from ...engine.model import Model
from ...engine.neighbors.lists import Neighbors
from ...engine.probe import Probe
from ...engine.state import State
from ...scene.part import Interaction
from .grid import Coupling, Field


class FieldForce(Interaction):
    """Particles put what they couple with on a field u, and feel f_i = -q_i grad u(x_i).

    Both by the same linear weights of the nodes around (cloud in cell), so that the energy
    q_i u(x_i) is what they exchange with the field.

    Args:
        field: A :class:`GridField` that has waves, or a :class:`PoissonField`.
        group: Which particles; None: all.
        coupling: The quantity q of particles, ``"mass"`` or an attribute.
        strength: What q is multiplied with.

    Raises:
        ValueError: A grid whose periodic axes are not those of the box.

    Example:
        >>> pond = GridField((0, None, 0), (4, None, 3), spacing=0.1, speed=1.5)
        >>> FieldForce(pond, coupling="charge", strength=0.5).strength
        0.5
    """

    def __init__(
        self, field: Any, group: Any = None, coupling: str = "mass", strength: float = 1.0
    ):
        if not isinstance(field, Field):
            raise TypeError(
                f"{self.name}: field must be a GridField or a PoissonField, got {field!r}; "
                "make one first."
            )
        self.field, self.group, self.quantity = field, group, str(coupling)
        self.strength = validate.number(self.name, "strength", strength)
        self.requires = frozenset({"force", self.quantity})
        self.conservative = field.conservative

    def kind(self) -> tuple[Any, ...]:
        return (type(self), self.quantity, *self.field.kind())

    def prepare(self, model: Model, neighbors: Neighbors) -> None:
        self.model = model
        self.conservative = all(peer.conservative for peer in self.peers)
        known = {"mass", "radius", *model.attributes}
        if self.quantity not in known or model.attributes.get(self.quantity):
            raise validate.fail(
                self.name, "coupling", f"be a number of the particles ({', '.join(sorted(known))})",
                self.quantity, "add_particles(..., charge=...)",
            )  # fmt: skip
        members = model.members([peer.group for peer in self.peers], self.name)
        strengths = [peer.strength for peer in self.peers]
        q = np.abs(model.column(self.quantity)[members])
        world = model.world_of[members]
        # Room for ten times as much as there is at the start.
        largest = 10.0 * np.bincount(world, q, minlength=model.world_count) * np.abs(strengths)
        fields = [peer.field for peer in self.peers]
        self.coupling = Coupling(self.name, model, fields, members, strengths, largest)
        self.live = fields[0].live(self.coupling)

    def attach(self, model: Model, state: State) -> None:
        self.amount = state[self.quantity]

    def apply(self, state: State, neighbors: Neighbors, dt: float) -> None:
        self.coupling.put(state, self.amount)
        self.live.settle()
        self.coupling.feel(state, self.amount, self.live.u)

    def advance(self, state: State, dt: float) -> None:
        self.live.advance(dt)

    def limits(self, probe: Probe) -> list[Limit]:
        """By the gradient at the present places, and by the shortest wave."""
        return probe.response(self) + self.live.limits(self.name)

    def measure(self, state: State, energy: wp.array, virial: wp.array) -> None:
        """Energies; the field's own is shared out evenly. It has no virial of particles."""
        own, u = self.live.energy(), self.live.u
        self.coupling.share(state, self.amount, u, own, self.live.part, energy)

    def persistent(self) -> dict[str, wp.array]:
        return self.live.persistent()

    def worlds(self, name: str, array: wp.array) -> np.ndarray:
        return self.coupling.node_world_host

    def reset(self, worlds: Sequence[int]) -> None:
        self.live.reset(worlds)

    def read_field(self, part: Interaction) -> np.ndarray:
        """See ``Simulation.field``; ``part`` is this, or the one of a world's scene."""
        worlds = [w for w, peer in enumerate(self.peers) if part is peer] or [0]
        rows = slice(int(self.coupling.first[worlds[0]]), int(self.coupling.first[worlds[0] + 1]))
        return self.live.u.numpy()[rows].reshape(self.coupling.nodes[worlds[0]]).copy()
