"""Gravity between all images of a periodic box."""

from __future__ import annotations

import math
from typing import Any

import warp as wp

from ...engine.model import Model
from ...engine.neighbors.lists import Neighbors
from ...engine.state import State
from ...scene.law import law
from ..electrostatics.images import Asked, Images
from ..pair import Pair

TWO_BY_ROOT_PI = 2.0 / math.sqrt(math.pi)


@law
def near_potential(
    r: float, mass_i: float, mass_j: float, constant: float, softening: float, damping: float
):
    R = wp.sqrt(r * r + softening * softening)
    return -(constant * mass_i) * (mass_j * wp.erfc(damping * R) / R)


@law
def near_force(
    r: float, mass_i: float, mass_j: float, constant: float, softening: float, damping: float
):
    # In an order that stays in single precision's range wherever the force does.
    R2 = r * r + softening * softening
    x = damping * wp.sqrt(R2)
    part = wp.erfc(x) + TWO_BY_ROOT_PI * x * wp.exp(-x * x)
    return -(constant * mass_i) * (mass_j / R2) * (r / wp.sqrt(R2)) * part


class _Near(Pair):
    """What gravity has nearby, erfc(a R) / R of R^2 = r^2 + s^2."""

    name = "Gravity"

    def __init__(self, group: Any, cutoff: float, parameters: dict[str, Any]):
        super().__init__(near_potential, near_force, group, cutoff, parameters)


class Periodic:
    """The sum over all images: near pairs, and waves or a mesh (see ``electrostatics.images``).

    Args:
        part: The ``Gravity`` of all worlds.
        model: With the worlds.
        neighbors: Of whom the near pairs ask for theirs.
    """

    def __init__(self, part: Any, model: Model, neighbors: Neighbors):
        self.neighbors = neighbors
        asked = [
            Asked(
                peer.group, -peer.parameters["constant"], peer.tolerance, peer.near_cutoff,
                peer.parameters["softening"],
            )
            for peer in part.peers
        ]  # fmt: skip
        self.images = Images(part.name, model, part.method, "mass", asked)
        pairs = [
            _Near(peer.group, found.cutoff, {**peer.parameters, "damping": found.damping})
            for peer, found in zip(part.peers, self.images.splittings, strict=True)
        ]  # fmt: skip
        self.near = pairs[0].bind(pairs)
        self.near.prepare(model, neighbors)

    def attach(self, model: Model, state: State) -> None:
        """As of an interaction."""
        self.near.attach(model, state)

    def pull(self, state: State) -> None:
        """Add the forces."""
        self.near.apply(state, self.neighbors, 0.0)
        self.images.apply(state)

    def measure(self, state: State, energy: wp.array, virial: wp.array) -> None:
        """Add each body's half of its energies with others, and of its virials."""
        near = wp.zeros_like(energy), wp.zeros_like(virial)
        self.near.measure(state, *near)
        self.images.measure(state, near, energy, virial)

    def complaint(self) -> str:
        """What near pairs have to say."""
        return self.near.complaint()
