"""Which pairs a pair force counts, and parameters that go by the kinds of two particles."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import warp as wp

from .. import validate
from ..engine import topology
from ..engine.model import Model
from ..engine.neighbors.all_pairs import AllPairs
from ..kernels.interactions.calls import CUT
from ..kernels.interactions.selection import WITHIN, Selection, excluded_type, place
from ..scene.group import Group, select


class Chosen:
    """Kinds, tables and exclusions of a :class:`~particlesim.interactions.pair.Pair`.

    Args:
        owner: For errors.
        group: As the pair force has it; with tables a list of groups, one a kind.
        groups: Two groups of which each feels only the other; None: whoever is in ``group``.
        cutoff: Of all pairs, by kinds, or None.
        parameters: Numbers and vectors, and tables by kinds, (kinds, kinds).
        exclude: Parts that hold particles together, or (m, 2) pairs; or several of these.
        truncated: Whether the law is asked what it is at the cutoff.
    """

    def __init__(
        self, owner: str, group: Any, groups: Any, cutoff: Any, parameters: Mapping[str, Any],
        exclude: Any, *, truncated: bool,
    ):  # fmt: skip
        self.owner = owner
        self.tables = {
            name: np.asarray(value, dtype=np.float64)
            for name, value in {**parameters, WITHIN: cutoff}.items()
            if np.ndim(value) == 2
        }
        self.between, self.truncated = groups is not None, truncated
        self.kinds: list[Any] = []
        if self.between:
            if group is not None or not are_groups(groups) or len(groups) != 2:
                raise validate.fail(
                    owner, "groups", "be two groups, and group be left out", groups,
                    "give groups=(these, those)",
                )  # fmt: skip
            self.kinds = list(groups)
        elif self.tables:
            if not are_groups(group):
                raise validate.fail(
                    owner, "group", f"be a list of groups, one a kind, with {self._names}", group,
                    "give group=[these, those]",
                )  # fmt: skip
            self.kinds = list(group)
        for name, table in self.tables.items():
            self._check(name, table)
        self.plain = {
            # What is asked of a law apart from any simulation is asked of the first kind.
            name: float(self.tables[name][0, 0]) if name in self.tables else value
            for name, value in parameters.items()
        }
        self.exclude = exclude

    @property
    def _names(self) -> str:
        return ", ".join(name.removesuffix("_squared") for name in self.tables)

    def _check(self, name: str, table: np.ndarray) -> None:
        count, name = len(self.kinds), "cutoff" if name == WITHIN else name
        if table.shape != (count, count):
            raise validate.fail(
                self.owner, name, f"have shape ({count}, {count}), a row a group", table.shape,
                "give one number, or a table by kinds",
            )  # fmt: skip
        validate.rows(self.owner, name, table, count, count)
        if not np.array_equal(table, table.T):
            raise validate.fail(
                self.owner, name, "be symmetric, as forces are opposite", table.tolist(),
                "give the same for (a, b) and (b, a)",
            )  # fmt: skip

    @property
    def group(self) -> Any:
        """All that are of some kind."""
        return list(self.kinds)

    @property
    def kind(self) -> tuple[Any, ...]:
        """What must agree for scenes to be simulated in one batch."""
        return (len(self.kinds), tuple(self.tables), self.between)

    def columns(self, peers: Sequence[Any], largest: float) -> dict[str, np.ndarray]:
        """Tables of all worlds as fields of parameters, one row a world.

        Args:
            peers: The pair forces of the worlds.
            largest: Square of a distance beyond any.
        """
        fields = {}
        for name in self.names:
            tables = np.array([peer.chosen._table(name, peer, largest) for peer in peers])
            for a in range(len(self.kinds)):
                for b in range(len(self.kinds)):
                    fields[place(name, a, b)] = tables[:, a, b]
        return fields

    @property
    def names(self) -> tuple[str, ...]:
        """Parameters that go by kinds."""
        own = [name for name in self.tables if name != WITHIN]
        own += [CUT] if self.truncated and WITHIN in self.tables else []
        return (*own, *([WITHIN] if self.between or WITHIN in self.tables else []))

    def _table(self, name: str, part: Any, largest: float) -> np.ndarray:
        if name != WITHIN:
            return self.tables[WITHIN if name == CUT else name]
        whole = np.full((len(self.kinds),) * 2, largest if part.cutoff is None else part.cutoff**2)
        table = self.tables[WITHIN] ** 2 if WITHIN in self.tables else whole
        return table * (1.0 - np.eye(2)) if self.between else table

    def prepare(self, model: Model, peers: Sequence[Any], pairs: AllPairs) -> None:
        """Kinds by slot and excluded partners by particle, of all worlds."""
        self.pairs, self.held = pairs, {}
        if self.names:
            argument = "groups" if self.between else "group"
            kinds = [
                kinds_of(model.scenes[w], peer.chosen.kinds, self.owner, argument)
                for w, peer in enumerate(peers)
            ]
            self.kind_of = model.array(np.concatenate(kinds), model.precision.scalar)
            self.held["kind"] = pairs.hold(self.kind_of)
        rows = topology.partners(model, topology.merged(
            self.owner, "exclude", model, [peer.chosen.excluded() for peer in peers]
        ))  # fmt: skip
        most = rows.shape[1]
        if most:
            self.held["excluded"] = model.array(rows, excluded_type(most))
        self.selection = Selection(len(self.kinds), self.names, most)

    @property
    def fields(self) -> dict[str, wp.array]:
        """What a term reads for it, once slots have their order."""
        particle = {"particle": self.pairs.order} if "excluded" in self.held else {}
        return {**self.held, **particle}

    def of(self, particle: np.ndarray) -> dict[str, wp.array]:
        """The same for slots that are these particles, and feel each other all."""
        fields = {}
        for name, array in self.fields.items():
            host = array.numpy()
            if name == "kind":
                values = self.kind_of.numpy()[particle]
            else:
                values = np.full((len(particle), *host.shape[1:]), -1)
            fields[name] = wp.array(values, dtype=array.dtype, device=array.device)
        return fields

    def excluded(self) -> np.ndarray:
        """Excluded pairs of a scene, (m, 2)."""
        return topology.excluded(self.owner, self.exclude)


def kinds_of(scene: Any, kinds: Sequence[Any], owner: str, argument: str) -> np.ndarray:
    """By particle of a scene which of these groups it is of, (n,); -1 where of none."""
    result = np.full(scene.particle_count, -1.0)
    for k, group in enumerate(kinds):
        rows = select(scene, group, owner)
        if (result[rows] >= 0).any():
            raise validate.fail(
                owner, argument, "be groups that have no particle in common", group,
                "name each particle once",
            )  # fmt: skip
        result[rows] = k
    return result


def are_groups(value: Any) -> bool:
    """It is a list of groups or of their names."""
    listed = isinstance(value, list | tuple) and len(value) > 0
    return listed and all(isinstance(each, Group | str) for each in value)
