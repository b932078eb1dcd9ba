"""What bonds, angles and dihedrals have in common: a law of one coordinate of a tuple."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any

import numpy as np
import warp as wp

from ... import validate
from ...engine import topology
from ...engine.execution.launch import launch
from ...engine.limit import Limit
from ...engine.model import Model, filled, structure_of
from ...engine.neighbors.lists import Neighbors
from ...engine.probe import Probe
from ...engine.state import State
from ...kernels.interactions import bonded as kernels
from ...kernels.precision import Precision
from ...scene.law import Law
from ...scene.law import law as make_law
from ...scene.part import Interaction
from ..laws.arguments import NUMBERS, Arguments

SUFFIXES = ("_i", "_j", "_k", "_l")
MOTION = {"position", "velocity"}  # what an energy of a coordinate alone does not depend on


class Bonded(Interaction):
    """Base of forces f_a = -(du/dq) dq/dx_a by a law u(q, ...) of a coordinate q of each tuple.

    The law is derived by ``wp.grad`` inside the kernel. Forces of a tuple sum to zero, and have no
    torque, to round-off. In a periodic scene each particle of a tuple is seen as the image next to
    the one before it.

    Args:
        law: ``u(q, ...)`` [energy]. Its further parameters are given, or are quantities of the
            tuple's particles, by their order in it: ``mass_i``, ``charge_j`` and so on.
        tuples: (m, k) indices, distinct within a row.
        parameters: One for all or (m,) numbers each; whole ones where the law takes an ``int``,
            (3,) or (m, 3) where it takes a ``wp.vec3``.
    """

    argument: str  # what the tuples are called
    size: int  # particles of each
    coordinate: Callable[[Precision], wp.Function]  # that a law takes first
    # Others, by what it calls them.
    by_name: Mapping[str, Callable[[Precision], wp.Function]] = MappingProxyType({})
    follows_box = True
    damped = False  # with -damping dq/dt beside -du/dq; ``items`` gives the damping

    def __init__(self, law: Any, tuples: Any, parameters: Mapping[str, Any]):
        self.law = make_law(law)
        self.law.check_derivable(self.name)
        self._check_coordinate()
        index = topology.tuples(self.name, self.argument, tuples, self.size)
        topology.check_once(self.name, self.argument, _from_the_lower_end(index))
        setattr(self, self.argument, index)
        self.arguments = ItemArguments(
            self.name, self.law, len(self.tuples), parameters, SUFFIXES[: self.size]
        )
        self.parameters: dict[str, np.ndarray] = self.arguments.values
        if moving := sorted(self.arguments.quantities & MOTION):
            raise validate.fail(
                self.name, f"law {self.law.name}", f"be one of {self._what} and of what stays",
                moving[0], "write it in that coordinate, or as a Constraint's as_force()",
            )  # fmt: skip
        self.requires = frozenset({"force"} | self.arguments.quantities)
        self.conservative = True

    def _check_coordinate(self) -> None:
        """The law's first parameter is a number."""
        first, kind = next(iter(self.law.parameters.items()), ("nothing", None))
        if kind not in NUMBERS:
            raise validate.fail(
                self.name, f"law {self.law.name}", f"take {self._what} first, as a float", first,
                f"write def {self.law.name}({self._what.split()[-1]}: float, ...)",
            )  # fmt: skip

    @property
    def _what(self) -> str:
        """The coordinate in words."""
        return {2: "the length", 3: "the angle", 4: "the dihedral"}[self.size]

    @property
    def tuples(self) -> np.ndarray:
        """(m, k) indices, under the name that the class gives them."""
        return getattr(self, self.argument)

    def kind(self) -> tuple[Any, ...]:
        return (type(self), self.law.key, tuple(self.parameters))

    def items(self, model: Model, w: int) -> dict[str, np.ndarray]:
        """Parameters of each tuple of world w."""
        return dict(self.parameters)

    # The engine's side ------------------------------------------------------------------------

    def prepare(self, model: Model, neighbors: Neighbors) -> None:
        self.model = model
        self.arguments.check(model.attributes)
        each = [peer.tuples for peer in self.peers]
        self.members = topology.merged(self.name, self.argument, model, each)
        steps = np.concatenate([topology.steps(model, w, own) for w, own in enumerate(each)])
        model.squares_fit(self.name, "distances", steps)
        self.shortest = steps.min(axis=1, initial=np.inf)
        items = [peer.items(model, w) for w, peer in enumerate(self.peers)]
        self.columns_of = {
            name: np.concatenate([each[name] for each in items]) for name in items[0]
        }
        model.fits(self.name, self.columns_of)
        self.rows = topology.incidence(self.members)
        self.count = len(self.rows["particle"])

    def attach(self, model: Model, state: State) -> None:
        if not self.count:
            return
        fields = {"x": state.position}
        fields |= {name: state[name] for name in sorted(self.arguments.quantities)}
        if self.damped:
            fields["v"] = state.velocity
        Data = structure_of("BondedData", fields)
        order = self.rows["tuple"]
        # A struct needs a field.
        columns = {name: column[order] for name, column in self.columns_of.items()}
        columns = columns or {"none": np.zeros(len(order))}
        Params, params = model.parameters("BondedParameters", columns)
        index = {suffix: f"ids[{a}]" for a, suffix in enumerate(SUFFIXES[: self.size])}
        first = next(iter(self.law.parameters))
        made = kernels.Bonds(
            self.law.function(model.precision, self.name, float),
            tuple(self.arguments.source(index)),
            self.by_name.get(first, type(self).coordinate)(model.precision),
            self.size, self.damped, model.precision, model.periodic, Data, Params,
        )  # fmt: skip
        self.force_kernel = kernels.force_kernel(made)
        self.undamped = dataclasses.replace(made, damped=False)
        rows = kernels.rows_type(self.size)()
        columns = {**self.rows, "world": model.world_of[self.rows["particle"]]}
        for name in ("particle", "world", "begin"):
            setattr(rows, name, model.array(columns[name].astype(np.int32), wp.int32))
        ids = self.members[order].astype(np.int32)
        rows.ids = model.array(ids, kernels.indices_type(self.size))
        self.inputs = [rows, params, model.box, filled(Data, fields)]

    def apply(self, state: State, neighbors: Neighbors, dt: float) -> None:
        if self.count:
            launch(self.force_kernel, self.count, [*self.inputs, state.force], self.model.device)

    def measure(self, state: State, energy: wp.array, virial: wp.array) -> None:
        self._measure(energy, virial, tensor=False)

    def measure_stress(self, state: State, energy: wp.array, stress: wp.array) -> bool:
        self._measure(energy, stress, tensor=True)
        return True

    def _measure(self, energy: wp.array, virial: wp.array, tensor: bool) -> None:
        if self.count:
            kernel = kernels.measure_kernel(self.undamped, tensor)
            launch(kernel, self.count, [*self.inputs, energy, virial], self.model.device)

    def limits(self, probe: Probe) -> list[Limit]:
        """By the gradient of the force at the present state."""
        return probe.response(self) if self.count else []

    def complaint(self) -> str:
        """That places are too coarse for how far the particles of a tuple are apart."""
        return self.model.unresolved(self.name, "distances", self.shortest, self.members)


def _from_the_lower_end(index: np.ndarray) -> np.ndarray:
    """Tuples named from one end: the same backwards is the same angle, or dihedral."""
    return np.where(index[:, :1] < index[:, -1:], index, index[:, ::-1])


class ItemArguments(Arguments):
    """Of a law of tuples, whose parameters are one for all or one for each.

    Args:
        count: Tuples.
    """

    def __init__(
        self, owner: str, law: Law, count: int, given: Mapping[str, Any], suffixes: tuple[str, ...]
    ):
        self.count = count
        super().__init__(owner, law, 1, given, suffixes)

    def value(self, name: str, value: Any) -> np.ndarray:
        """A parameter's values, checked: (count,) numbers or (count, 3) vectors."""
        kind = self.law.parameters[name]
        found = validate.rows(self.owner, name, value, self.count, 3 if kind is wp.vec3 else None)
        if kind is not int:
            return found
        if not np.issubdtype(np.asarray(value).dtype, np.integer):
            raise validate.fail(
                self.owner, name, f"be whole, as {self.law.name} takes it", value,
                f"give whole numbers, or write {name}: float there",
            )  # fmt: skip
        return found.astype(np.int32)
