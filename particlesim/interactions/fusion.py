"""Pair forces that share a neighbour list share one pass over it.

Which ones do is known in every world by itself (see ``neighbors``). Where worlds differ, each pass
goes over its own worlds, so that the sums of every world run as they run when it is alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import warp as wp

from ..engine.model import filled
from ..engine.neighbors.lists import Neighbors
from ..engine.state import State
from ..kernels.engine.loops import Term
from ..kernels.interactions import pair as kernels
from ..kernels.precision import structure
from ..scene.part import Interaction
from .pair import Pair
from .pair_loop import OWN, PairLoop


class PairPass(Interaction):
    """Pair forces over one list, summed in one loop, in some worlds or in all.

    Of several the row of neighbours and their positions are read once, which takes 0.8 to 0.9 of
    the time of two passes over a Lennard-Jones liquid. Each keeps its cutoff and reports its own
    energy.

    Args:
        parts: Bound and attached pair interactions with the same list in the worlds of the pass.
        active: By world, whether it takes part.
    """

    def __init__(self, parts: Sequence[Pair], active: np.ndarray):
        self.parts = parts
        first = parts[0]
        self.loop, self.term = _fused(parts) if len(parts) > 1 else (first.loop, first.term)
        host = self.loop.params.numpy()
        columns = {name: host[name] for name in host.dtype.names}
        columns["cutoff_squared"] = np.where(active, columns["cutoff_squared"], 0.0)
        params = first.model.structures(self.loop.Params, columns)
        self.loop = replace(self.loop, params=params)

    @property
    def name(self) -> str:
        return " + ".join(part.name for part in self.parts)

    def apply(self, state: State, neighbors: Neighbors, dt: float) -> None:
        self.loop.sum(self.term, kernels.add_force, {"f": state.force})


def _fused(parts: Sequence[Pair]) -> tuple[PairLoop, Term]:
    """The loop and the term of several pair forces together."""
    model, pairs = parts[0].model, parts[0].pairs
    precision, names = model.precision, {f"part_{k}": part for k, part in enumerate(parts)}
    loops = {name: part.loop for name, part in names.items()}
    own = {"x": wp.array(dtype=precision.vec3), "slot": wp.array(dtype=wp.int32)}
    Data = structure("FusedData", own | {name: loop.Data for name, loop in loops.items()})
    numbers = dict.fromkeys(sorted(OWN), precision.scalar)
    of_loops = {name: loop.Params for name, loop in loops.items()}
    Params = structure("FusedParameters", numbers | of_loops)
    data, columns = Data(), {}
    data.x, data.slot = pairs.fields["position"], pairs.slots
    for name, part in names.items():
        fields = {**part.fields_of(pairs), "slot": pairs.slots}
        setattr(data, name, filled(part.loop.Data, fields))
        columns[name] = part.params.numpy()
    of_parts = list(columns.values())
    for name in OWN:
        columns[name] = np.max([each[name] for each in of_parts], axis=0)
    params = model.structures(Params, columns)
    term = kernels.fused_term([part.term for part in parts], precision, Data, Params)
    return PairLoop(model, pairs, Data, data, Params, params), term


def fuse(interactions: Sequence[Interaction]) -> list[Interaction]:
    """The passes that evaluate these interactions: pair forces with one list become one pass."""
    listed = [each for each in interactions if isinstance(each, Pair) and each.listed]
    passes_of, of_lists = _passes(listed), {id(each) for each in listed}
    passes: list[Interaction] = []
    for each in interactions:
        passes += passes_of.get(id(each), []) if id(each) in of_lists else [each]
    return passes


def _passes(parts: Sequence[Pair]) -> dict[int, list[Interaction]]:
    """The passes over pair forces, by the id of the first one in each."""
    if not parts:
        return {}
    leader = np.array([part.pairs.leader for part in parts])
    # Where a part looks for nothing it goes with whom it goes elsewhere, if that is anywhere.
    elsewhere = leader.max(axis=1, keepdims=True)
    own = -1 - np.arange(len(parts))[:, None]
    leader = np.where(leader < 0, np.where(elsewhere < 0, own, elsewhere), leader)
    patterns, pattern_of = np.unique(leader, axis=1, return_inverse=True)
    active: dict[tuple[int, ...], np.ndarray] = {}
    for number, pattern in enumerate(patterns.T):
        for own in np.unique(pattern):
            group = tuple(np.nonzero(pattern == own)[0].tolist())
            active[group] = active.get(group, False) | (pattern_of == number)
    result: dict[int, list[Interaction]] = {}
    for group, worlds in active.items():
        together = [parts[k] for k in group]
        alone = len(together) == 1 and worlds.all()
        found = together[0] if alone else PairPass(together, worlds)
        result.setdefault(id(together[0]), []).append(found)
    return result
