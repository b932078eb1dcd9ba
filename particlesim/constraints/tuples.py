"""Tuples of all worlds as the kernels take them: merged and sorted by colour."""

from __future__ import annotations

import functools
import itertools
from collections.abc import Sequence
from typing import Any

import numpy as np
import warp as wp

from ..engine import topology
from ..engine.model import Model
from ..engine.state import State
from ..kernels.constraints.constraint_force import Seats
from ..kernels.constraints.constraints import Solved, bodies_type, tuples_type

# Of C / |grad C|^2, which for an angle goes with the square of lengths, in a scene of size 1.
LARGEST = 1e30


class Tuples:
    """The tuples of the peers of a constraint, one peer a world.

    Row r of the arrays is tuple ``order[r]`` in the order in which the worlds list theirs. Rows of
    one colour follow each other and share no particle: ``spans`` holds (first, last + 1) of each.
    """

    def __init__(self, owner: str, model: Model, peers: Sequence[Any]):
        each = [peer.particles for peer in peers]
        particles = topology.merged(owner, "particles", model, each)
        self.count, self.size = particles.shape
        self.edges = np.concatenate([[0], np.cumsum([len(index) for index in each])])
        color = _colors(each)
        self.order = np.argsort(color, kind="stable")
        rows = np.bincount(color) if self.count else np.zeros(0, dtype=np.int64)
        self.spans = list(itertools.pairwise([0, *np.cumsum(rows).tolist()]))
        self.particles = particles[self.order]
        self.world = np.repeat(np.arange(len(each)), np.diff(self.edges))[self.order]
        columns = [peer.columns(model, w) for w, peer in enumerate(peers)]
        self.damped = any(peer.damping.any() for peer in peers)
        self.one_sided, self.breakable = peers[0].inequality, peers[0].breakable
        idle = {"damping": not self.damped, "break_force": not self.breakable}
        merged = {
            name: np.concatenate([part[name] for part in columns])[self.order]
            for name in columns[0]
            if not idle.get(name)
        }
        model.fits(owner, merged)
        self.Item, self.items = model.parameters("ConstraintItem", merged)
        self.model = model
        steps = [topology.steps(model, w, index) for w, index in enumerate(each)]
        self.shortest = np.concatenate([d.min(axis=1, initial=np.inf) for d in steps])[self.order]
        longest = np.concatenate([d.max(axis=1, initial=0.0) for d in steps])[self.order]
        model.squares_fit(owner, "distances", np.maximum(longest, merged.get("rest_length", 0.0)))

    def complaint(self, owner: str) -> str:
        """That places are too coarse for how far the particles of a tuple are apart; or nothing."""
        if self.size < 2:
            return ""
        return self.model.unresolved(owner, "distances", self.shortest, self.particles)

    def struct(self) -> Any:
        """The tuples as the kernels take them, with multipliers and, if breakable, marks."""
        model = self.model
        result = tuples_type(model.precision, self.size, self.Item)()
        indices = wp.types.vector(length=self.size, dtype=wp.int32)
        result.particle = model.array(self.particles.astype(np.int32), indices)
        result.world = model.array(self.world.astype(np.int32), wp.int32)
        result.item = self.items
        result.lam = wp.zeros(self.count, dtype=model.precision.scalar, device=model.device)
        result.scale = wp.zeros(1, dtype=wp.float64, device=model.device)
        if self.breakable:
            result.broken = wp.zeros(self.count, dtype=wp.int32, device=model.device)
        return result

    def solved(self, constraint: Any, state: State) -> Solved:
        """What the kernels of a constraint, or of the force it makes, are made for."""
        model = self.model
        return Solved(
            constraint.evaluation(model, self.Item), model.precision, model.periodic,
            "position_error" in state, self.size, self.Item, constraint.relative, constraint.unit,
            constraint.carried, self.damped, self.one_sided, self.breakable,
        )  # fmt: skip

    @functools.cached_property
    def seats(self) -> Seats:
        """The tuples of every particle that is in one."""
        result = Seats()
        for name, column in topology.incidence(self.particles).items():
            setattr(result, name, self.model.array(column.astype(np.int32), wp.int32))
        return result


def bodies(model: Model, state: State) -> Any:
    """The arrays of the state that the kernels of constraints take."""
    result = bodies_type(model.precision)()
    result.unit = model.mass_unit
    size = float(model.apart()[0].max(initial=1.0))
    with np.errstate(over="ignore"):
        largest = LARGEST * np.square(size)
    result.most = min(largest, float(np.finfo(model.precision.numpy).max))
    names = {
        "x": "position", "x_error": "position_error", "v": "velocity", "w": "inverse_mass",
        "correction": "correction",
    }  # fmt: skip
    for field, name in names.items():
        if name in state:
            setattr(result, field, state[name])
    return result


def _colors(each: Sequence[np.ndarray]) -> np.ndarray:
    """Colours of all tuples; those of equal worlds are found once."""
    known: dict[int, np.ndarray] = {}
    for index in each:
        if id(index) not in known:
            known[id(index)] = topology.colors(index)
    return np.concatenate([known[id(index)] for index in each])
