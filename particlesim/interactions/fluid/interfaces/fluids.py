"""The fluids of one SPH: a single one, or several beside each other."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import warp as wp

from .... import validate
from ....engine.model import Model
from ....kernels.interactions.selection import chosen
from ...selection import are_groups, kinds_of
from ..equations_of_state import EquationOfState

FLUID = "fluid"  # the number of a particle's fluid, from 0, as laws are given it
PAIR = ("fluid_i", "fluid_j")  # and those of a pair


class Fluids:
    """What the fluids of an ``SPH`` differ in: their groups, rest densities and equations of state.

    A parameter that goes by fluids is in as many fields of the kernels' parameters as there are
    fluids; where there is one, in the field of its own name.

    Args:
        owner: For errors.
        group: As of the ``SPH``; where something is given by fluids a list of groups, one a fluid.
        rest_density: A number, one a fluid, or None.
        equation_of_state: One, or one a fluid.
    """

    def __init__(self, owner: str, group: Any, rest_density: Any, equation_of_state: Any):
        given = {"rest_density": rest_density, "equation_of_state": equation_of_state}
        lists = {name: list(value) for name, value in given.items() if np.ndim(value)}
        if lists and not are_groups(group):
            raise validate.fail(
                owner, "group", f"be a list of groups, one a fluid, with {', '.join(lists)} by "
                "fluids", group, "give [these, those]",
            )  # fmt: skip
        self.owner, self.fields = owner, dict[str, list[str]]()
        self.groups = list(group) if lists else [group]
        count = len(self.groups)
        for name, values in lists.items():
            if len(values) != count:
                raise self._uneven(name, values)
        self.states = lists.get("equation_of_state", [equation_of_state] * count)
        for state in self.states:
            if not isinstance(state, EquationOfState):
                raise TypeError(
                    f"{owner}: equation_of_state must be an EquationOfState, got {state!r}; give "
                    "Tait(sound_speed)."
                )
        if len({tuple(each.key for each in state.laws.values()) for state in self.states}) > 1:
            raise validate.fail(
                owner, "equation_of_state", "be of one kind for all fluids",
                [state.name for state in self.states], "give each the same laws, with its numbers",
            )  # fmt: skip
        self.densities = None
        if rest_density is not None:
            self.densities = [
                validate.number(owner, "rest_density", each, above=0.0, unit="mass/length^d")
                for each in lists.get("rest_density", [rest_density] * count)
            ]

    @property
    def several(self) -> bool:
        """There is more than one."""
        return len(self.groups) > 1

    def by_fluids(self, name: str, values: Sequence[float]) -> Sequence[float]:
        """Values of as many as there are."""
        if not self.several or np.shape(values) != (len(self.groups),):
            raise self._uneven(name, values)
        return values

    def _uneven(self, name: str, values: Any) -> ValueError:
        return validate.fail(
            self.owner, name, f"be one, or one for each of {len(self.groups)} groups", values,
            "give as many as there are fluids",
        )  # fmt: skip

    def keep(self, name: str, values: Sequence[float]) -> dict[str, float]:
        """A parameter by fluids, as parameters of the ``SPH``."""
        fields = [f"{name}_{k}" for k in range(len(values))] if self.several else [name]
        self.fields[name] = fields
        return dict(zip(fields, values, strict=True))

    def source(self, name: str, fluid: str = FLUID) -> str:
        """Source of the parameter of a particle's fluid, whose number is ``fluid``."""
        return chosen(fluid, [f"p.{field}" for field in self.fields.get(name, [name])])

    def numbers(self, scene: Any) -> np.ndarray:
        """Of the fluid of each particle of a scene, (n,); what is of none is never read."""
        if not self.several:
            return np.zeros(scene.particle_count)
        return kinds_of(scene, self.groups, self.owner, "group")

    def by_particle(
        self, columns: Mapping[str, np.ndarray], number: np.ndarray
    ) -> dict[str, np.ndarray]:
        """Parameters of particles, of those by fluids that of their own."""
        found = dict(columns)
        for name, fields in self.fields.items():
            own = np.stack([found.pop(field) for field in fields])
            found[name] = own[number.astype(int), np.arange(len(number))]
        return found

    def hold(self, model: Model, pairs: Any, numbers: np.ndarray) -> None:
        """What the terms read of several fluids, in the order of a list's slots."""
        weights = np.full(model.particle_count, model.mass_unit)
        of = {"m": weights, FLUID: numbers}
        real = model.precision.scalar
        self.held = {name: pairs.hold(model.array(each, real)) for name, each in of.items()}

    def read(self, mass: wp.array) -> dict[str, wp.array]:
        """Arrays in slot order by the names that the terms give them."""
        return {**self.held, "mass": mass} if self.several else {"m": mass}
