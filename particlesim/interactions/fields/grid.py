"""Grids that fields live on, and what particles put there."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import warp as wp

from ... import validate
from ...engine.execution.launch import launch
from ...engine.limit import Limit
from ...engine.model import Model
from ...engine.state import State
from ...kernels.interactions.grid import coupling_kernels, grid_type

MOST = 2.0**61  # of the sums of whole numbers


class Field:
    """Base of fields on a regular grid; a member says how it follows what particles put on it.

    Args:
        lower: First corner [length]; None on an axis along which nothing differs.
        upper: Last corner, likewise. Along a periodic axis both are those of the scene's box.
        spacing: Of the nodes [length]; along each axis the nearest that fits.
    """

    def __init__(self, lower: Any, upper: Any, spacing: float):
        name = type(self).__name__
        self.spacing = validate.number(name, "spacing", spacing, above=0.0, unit="length")
        ends = []
        for what, given in (("lower", lower), ("upper", upper)):
            if not isinstance(given, Sequence | np.ndarray) or len(given) != 3:
                raise validate.fail(
                    name, what, "be three numbers, or None along an axis [length]", given,
                    "give a corner",
                )  # fmt: skip
            ends.append([
                np.nan if each is None else validate.number(name, what, each) for each in given
            ])  # fmt: skip
        self.lower, self.upper = np.array(ends)
        self.active = ~np.isnan(self.lower)
        if not np.array_equal(self.active, ~np.isnan(self.upper)) or not self.active.any():
            raise validate.fail(
                name, "upper", "be None where lower is, and not everywhere", upper, "match them"
            )
        if not (self.lower < self.upper)[self.active].all():
            raise validate.fail(name, "upper", "be above lower [length]", upper, "swap them")

    def nodes(self, periodic: Sequence[bool]) -> np.ndarray:
        """Nodes along each axis, (3,)."""
        cells = np.maximum(np.round((self.upper - self.lower) / self.spacing), 1)
        count = np.where(np.array(list(periodic)), cells, cells + 1)
        return np.where(self.active, count, 1).astype(int)

    def kind(self) -> tuple[Any, ...]:
        """What must agree for scenes to be simulated in one batch."""
        return (type(self), tuple(self.active))

    conservative: bool = False  # it keeps, with its particles, its energy

    def columns(self) -> dict[str, float]:
        """Numbers of the grid that are its own kind's."""
        return {}

    def live(self, coupling: Coupling) -> Any:
        """What a simulation has of it."""
        raise validate.undefined(self, "live(self, coupling)")


class Coupling:
    """The fields of all worlds, and the particles that couple to them.

    Args:
        owner: For errors.
        model: With the worlds.
        fields: Of each world its own.
        members: Rows of the particles.
        amounts: How strongly those of each world couple.
        largest: Sum of the sizes of what the particles of a world put on it, (worlds,).
    """

    def __init__(
        self, owner: str, model: Model, fields: Sequence[Field], members: np.ndarray,
        amounts: Sequence[float], largest: np.ndarray,
    ):  # fmt: skip
        self.owner, self.model, self.fields = owner, model, fields
        precision, device = model.precision, model.device
        self.count = len(members)
        self.particle = model.array(members, wp.int32)
        self.world = model.array(model.world_of[members], wp.int32)
        self.nodes = np.array([self._nodes(w) for w in range(model.world_count)])
        sizes = self.nodes.prod(axis=1)
        self.first = np.concatenate([[0], np.cumsum(sizes)])
        self.rows = int(self.first[-1])
        self.node_world_host = np.repeat(np.arange(model.world_count), sizes)
        self.node_world = model.array(self.node_world_host, wp.int32)
        active = np.array([field.active for field in fields])
        lower = np.array([np.where(field.active, field.lower, 0.0) for field in fields])
        self.lengths = np.array(
            [np.where(field.active, field.upper - field.lower, 1.0) for field in fields]
        )
        wraps = active & np.array(list(model.periodic))
        cells = np.where(wraps, self.nodes, np.maximum(self.nodes - 1, 1))
        self.steps = self.lengths / cells
        scale = MOST / np.where(largest > 0, largest, 1.0)
        columns: dict[str, Any] = {
            "lower": lower, "inverse": np.where(active, 1.0 / self.steps, 0.0),
            "nodes": self.nodes, "wraps": wraps, "first": self.first[:-1],
            "scale": 2.0 ** np.floor(np.log2(scale)), "amount": np.array(amounts),
        }  # fmt: skip
        own = [field.columns() for field in fields]
        columns |= {name: np.array([each[name] for each in own]) for name in own[0]}
        if "mass" in columns:  # of a volume: of one node
            columns["mass"] = columns["mass"] * np.where(active, self.steps, 1.0).prod(axis=1)
        self.columns = columns
        self.grids = model.structures(grid_type(precision), columns)
        self.sums = wp.zeros(self.rows, dtype=wp.int64, device=device)

    def _nodes(self, w: int) -> np.ndarray:
        """Nodes of a world's grid, whose periodic axes are those of its box."""
        field, model = self.fields[w], self.model
        wraps = field.active & np.array(list(model.periodic))
        lower, length = model.box_lower[w], model.box_length[w]
        fits = np.isclose(field.lower, lower) & np.isclose(field.upper, lower + length)
        if not fits[wraps].all():
            raise validate.fail(
                self.owner, "field", "have the corners of the box along periodic axes",
                (field.lower.tolist(), field.upper.tolist()), "give those of Scene(periodic=...)",
            )  # fmt: skip
        return field.nodes(model.periodic)

    def zeros(self) -> wp.array:
        """A number for each node."""
        real, device = self.model.precision.scalar, self.model.device
        return wp.zeros(self.rows, dtype=real, device=device)

    def put(self, state: State, amount: wp.array) -> None:
        """What the particles put on the grids at their present places, into ``sums``."""
        self.sums.zero_()
        self._launch("put", state, amount, self.sums)

    def feel(self, state: State, amount: wp.array, u: wp.array) -> None:
        """Add the forces of the field."""
        self._launch("feel", state, amount, u, state.force)

    def share(
        self, state: State, amount: wp.array, u: wp.array, own: wp.array, part: float,
        energy: wp.array,
    ) -> None:  # fmt: skip
        """Add to the particles what they have in the field, and their share of its own."""
        self._launch("energy", state, amount, u, own, part, energy)

    def _launch(self, name: str, state: State, amount: wp.array, *others: Any) -> None:
        kernel = getattr(coupling_kernels(self.model.precision), name)
        inputs = [self.particle, self.world, self.grids, state.position, amount, *others]
        launch(kernel, self.count, inputs, self.model.device)

    def shares(self) -> wp.array:
        """What one particle has of its world, (worlds,); 0 where there is none."""
        worlds = self.model.world_count
        count = np.bincount(self.world.numpy(), minlength=worlds)
        return self.model.array(np.where(count > 0, 1.0 / np.maximum(count, 1), 0.0), wp.float64)

    def limit(self, speed: np.ndarray, part: str) -> list[Limit]:
        """dt <= 2 / omega of the shortest wave, omega^2 = 4 c^2 sum of 1 / h^2 (Courant 1928)."""
        inverse = np.where(self.nodes > 1, 1.0 / self.steps, 0.0)
        omega = 2.0 * speed * np.sqrt((inverse**2).sum(axis=1))
        w = int(np.argmax(omega))
        if not omega[w] > 0:
            return []
        reason = f"2 / omega, omega = {omega[w]:.4g} /s of the shortest wave on the grid"
        return [Limit(part, "wave", 2.0 / float(omega[w]), reason, w)]
