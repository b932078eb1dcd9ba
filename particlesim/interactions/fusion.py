"""Pair forces that share a neighbour list share one pass over it.

Which ones do is known in every world by itself (see ``neighbors``). Where worlds differ, each pass
goes over its own worlds, so that the sums of every world run as they run when it is alone.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from typing import Any

import numpy as np
import warp as wp

from ..engine.execution.launch import launch
from ..engine.neighbors.lists import Neighbors
from ..engine.state import State
from ..engine.structs import filled
from ..kernels.interactions import pair as kernels
from ..kernels.precision import Precision, structure
from ..scene.part import Interaction
from .pair import Pair


class FusedPairs(Interaction):
    """Several pair forces over one list, summed in one loop.

    The row of neighbours and their positions are read once, which takes 0.8 to 0.9 of the time of
    two passes over a Lennard-Jones liquid. Each keeps its cutoff and reports its own energy.

    Args:
        parts: Bound and attached pair interactions with the same list in the worlds of the pass.
        active: By world, whether it takes part.
    """

    def __init__(self, parts: Sequence[Pair], active: np.ndarray):
        first = parts[0]
        self.parts, self.model, self.pairs, self.out = parts, first.model, first.pairs, first.out
        precision = self.model.precision
        kinds = {f"part_{k}": part for k, part in enumerate(parts)}
        Data, Params = _types(
            precision, tuple(part.Data for part in parts), tuple(part.Params for part in parts)
        )
        self.data = Data()
        self.data.x = self.pairs.fields["position"]
        for name, part in kinds.items():
            setattr(self.data, name, filled(part.Data, part.fields_of(self.pairs)))
        columns = {name: part.params.numpy() for name, part in kinds.items()}
        cutoffs = [column["cutoff_squared"] for column in columns.values()]
        reach = np.where(active, np.max(cutoffs, axis=0), 0.0)
        self.params = self.model.structures(Params, {"cutoff_squared": reach, **columns})
        term = kernels.fused_term([part.term for part in parts], precision, Data, Params)
        self.kernel = kernels.pair_kernel(
            term, kernels.add_force(precision, Data, Params, first.Out), Data, Params, first.Out, 3,
            precision, self.model.periodic, self.pairs.partners, self.model.vectorised,
        )  # fmt: skip

    @property
    def name(self) -> str:
        return " + ".join(part.name for part in self.parts)

    def apply(self, state: State, neighbors: Neighbors, dt: float) -> None:
        inputs = [self.pairs.pairs, self.model.box, self.params, self.data, self.out]
        launch(self.kernel, self.pairs.count, inputs, self.model.device)


@functools.cache
def _types(precision: Precision, data: tuple[Any, ...], params: tuple[Any, ...]) -> tuple[Any, Any]:
    """Structs of the parts' structs, the same ones for the same parts, so kernels are reused."""
    return (
        structure(
            "FusedData",
            {
                "x": wp.array(dtype=precision.vec3),
                **{f"part_{k}": each for k, each in enumerate(data)},
            },
        ),
        structure(
            "FusedParameters",
            {
                "cutoff_squared": precision.scalar,
                **{f"part_{k}": each for k, each in enumerate(params)},
            },
        ),
    )


class InSomeWorlds(Interaction):
    """A pair force in those worlds where it has a pass of its own.

    Args:
        part: A bound and attached pair interaction.
        active: By world, whether it takes part.
    """

    def __init__(self, part: Pair, active: np.ndarray):
        self.part = part
        host = part.params.numpy()
        columns = {name: host[name] for name in host.dtype.names}
        columns["cutoff_squared"] = np.where(active, columns["cutoff_squared"], 0.0)
        self.params = part.model.structures(part.Params, columns)

    @property
    def name(self) -> str:
        return self.part.name

    def apply(self, state: State, neighbors: Neighbors, dt: float) -> None:
        self.part.add_forces(self.params)


def fuse(interactions: Sequence[Interaction]) -> list[Interaction]:
    """The passes that evaluate these interactions: pair forces with one list become one pass."""
    passes_of = _passes([each for each in interactions if isinstance(each, Pair)])
    passes: list[Interaction] = []
    for each in interactions:
        passes += passes_of.get(id(each), []) if isinstance(each, Pair) else [each]
    return passes


def _passes(parts: Sequence[Pair]) -> dict[int, list[Interaction]]:
    """The passes over pair forces, by the id of the first one in each."""
    if not parts:
        return {}
    leader = np.array([part.pairs.leader for part in parts])
    # Where a part looks for nothing it goes with whom it goes elsewhere, if that is anywhere.
    elsewhere = leader.max(axis=1, keepdims=True)
    alone = -1 - np.arange(len(parts))[:, None]
    leader = np.where(leader < 0, np.where(elsewhere < 0, alone, elsewhere), leader)
    patterns, pattern_of = np.unique(leader, axis=1, return_inverse=True)
    active: dict[tuple[int, ...], np.ndarray] = {}
    for number, pattern in enumerate(patterns.T):
        for own in np.unique(pattern):
            group = tuple(np.nonzero(pattern == own)[0].tolist())
            active[group] = active.get(group, False) | (pattern_of == number)
    result: dict[int, list[Interaction]] = {}
    for group, worlds in active.items():
        together = [parts[k] for k in group]
        result.setdefault(id(together[0]), []).append(_pass(together, worlds))
    return result


def _pass(parts: Sequence[Pair], active: np.ndarray) -> Interaction:
    """One pass over these, in the worlds where they have one list."""
    if len(parts) > 1:
        return FusedPairs(parts, active)
    return parts[0] if active.all() else InSomeWorlds(parts[0], active)
