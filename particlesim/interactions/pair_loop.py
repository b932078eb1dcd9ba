"""The loop over the partners of a pair list, as the passes of an interaction share it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
import warp as wp

from .. import validate
from ..engine.model import Model, filled, structure_of
from ..kernels.engine.loops import Term
from ..kernels.interactions.pair import pair_kernel
from ..scene.law import Law

# Closer than this, particles count as coincident: in parts of the cutoff, or without a cutoff of
# how far the particles of a world are apart at the start.
COINCIDENT, CLOSEST = 1e-6, 1e-12
OWN = {"cutoff_squared", "closest_squared"}  # parameters of every loop


@dataclass
class PairLoop:
    """What the terms of a loop read: a pair list, arrays in its slots' order, and parameters.

    Args:
        pairs: Of :meth:`~particlesim.engine.neighbors.lists.Neighbors.of`, or alike.
        Data: Struct of the arrays in slot order; ``x`` are the positions.
        Params: Struct of the parameters, which holds ``cutoff_squared``; ``params`` has an entry a
            world.
    """

    model: Model
    pairs: Any
    Data: Any
    data: Any
    Params: Any
    params: wp.array

    @classmethod
    def over(
        cls, model: Model, pairs: Any, name: str, fields: Mapping[str, wp.array], Params: Any,
        params: wp.array,
    ) -> Self:  # fmt: skip
        """A loop that reads these arrays."""
        fields = {**fields, "slot": pairs.slots}
        Data = structure_of(f"{name}Data", fields)
        return cls(model, pairs, Data, filled(Data, fields), Params, params)

    @property
    def types(self) -> tuple[Any, ...]:
        """What terms are made for: the precision, and the structs of data and parameters."""
        return self.model.precision, self.Data, self.Params

    def sum(
        self, term: Term, store: Callable[..., wp.Function], out: Mapping[str, wp.array]
    ) -> None:
        """Sum a term over the partners of every slot, and store the sums.

        Args:
            term: See :mod:`particlesim.kernels.engine.loops`.
            store: Makes, of a precision and the structs of data, parameters and outputs, the
                function that takes a sum (see ``pair_kernel``).
            out: The arrays that it writes.
        """
        model = self.model
        Out = structure_of("PairSums", out)
        kernel = pair_kernel(
            term, store(*self.types, Out), self.Data, self.Params, Out,
            model.precision, model.periodic, self.pairs.partners, model.vectorised,
        )  # fmt: skip
        inputs = [self.pairs.pairs, model.box, self.params, self.data, filled(Out, out)]
        self.pairs.sum(kernel, inputs)


def squared_distances(owner: str, model: Model, cutoff: np.ndarray | None) -> dict[str, np.ndarray]:
    """Parameters that every loop takes: squares of the cutoff and of what counts as coincident.

    Args:
        owner: Whose loop.
        model: Its worlds.
        cutoff: One a world; None: all pairs.

    Raises:
        ValueError: Distances whose squares leave the kernels' precision.
    """
    numbers = np.finfo(model.precision.numpy)
    if cutoff is not None:
        model.squares_fit(owner, "cutoff", cutoff)
        most, closest = cutoff**2, COINCIDENT * cutoff
    else:
        size, spacing = model.apart()
        model.squares_fit(owner, "position", (size, spacing))
        most = np.full(model.world_count, numbers.max)
        closest = CLOSEST * np.where(size > 0, size, 1.0)
    return {"cutoff_squared": most, "closest_squared": np.maximum(closest**2, numbers.tiny)}


def check_names(owner: str, law: Law) -> None:
    """Refuse a law whose parameters are called like those of the loop itself."""
    for name in sorted(OWN & law.parameters.keys()):
        raise validate.fail(
            owner, f"parameter of {law.name}", "have a name of its own", name, "rename it"
        )
