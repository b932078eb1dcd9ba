"""Particles held at points in space, at rest or along paths."""

from __future__ import annotations

from typing import Any

import numpy as np
import warp as wp

from ... import validate
from ...engine import topology
from ...engine.execution.launch import launch
from ...engine.model import Model
from ...engine.neighbors.lists import Neighbors
from ...engine.state import State
from ...kernels.constraints.kinds.attachment import (
    Keyframes,
    attachment_evaluation,
    follow_kernel,
)
from ...scene.law import law
from ..constraint import Constraint


@law
def _distance(a: wp.vec3, target: wp.vec3):
    return wp.length(a - target)


class Attachment(Constraint):
    """C = |x - p(t)|: particles are held at points in space, which may move.

    Between keyframes a point goes along a straight line by the clock of its world: place and time
    are exact, however many substeps led there. Before the first and after the last it rests. What
    the particle is pulled with is ``sim.force``, and a pull of more than ``break_force`` tears it
    off for good, which a pinned particle never is. In a periodic scene points are where they are
    said to be, and not at the nearest image.

    Args:
        particles: (m,) indices.
        target: p [length]: (3,) or (m, 3) points; with ``times`` (f, m, 3), or (f, 3) for all, the
            points at each of these; None: where the particles are at the start.
        times: (f,) ascending times of the keyframes [time]; None: the points are at rest.
        compliance: alpha, the inverse of the stiffness [length / force], one or (m,), at least 0.
        damping: beta [force time / length], one or (m,), at least 0 (see :class:`Constraint`).
        break_force: Force beyond which a particle is torn off for good [force], one or (m,), above
            0; None: unbreakable.

    Raises:
        ValueError: Wrong shapes, indices or values; times that do not ascend.

    Example:
        >>> lifted = Attachment([0, 1], [(0, 0, 0), (0, 2, 0)], times=[0.0, 1.0], break_force=50.0)
        >>> lifted.points.shape  # (f, m, 3)
        (2, 2, 3)
    """

    unit = True

    def __init__(
        self, particles: Any, target: Any = None, *, times: Any = None, compliance: Any = 0.0,
        damping: Any = 0.0, break_force: Any = None,
    ):  # fmt: skip
        particles = topology.tuples(self.name, "particles", particles, 1)
        super().__init__(
            _distance, particles, compliance=compliance, damping=damping, break_force=break_force,
            target=(0.0, 0.0, 0.0),
        )  # fmt: skip
        self.times = self._ascending(times)
        self.points = None if target is None else self._keyed(target, times is not None)
        if self.points is None and times is not None:
            raise validate.fail(
                self.name, "target", "be given with times", None, "give points at each time"
            )

    def _ascending(self, times: Any) -> np.ndarray:
        if times is None:
            return np.zeros(1)
        given = validate.rows(self.name, "times", times, max(np.size(times), 1), None)
        if np.ndim(times) != 1 or (np.diff(given) <= 0).any():
            raise validate.fail(
                self.name, "times", "ascend", np.asarray(times), "give (f,) times in order"
            )
        return given

    def _keyed(self, target: Any, moving: bool) -> np.ndarray:
        """The points as (f, m, 3)."""
        f, m = len(self.times), len(self.particles)
        given = np.asarray(target)
        if not moving or given.ndim < 3:
            rows = validate.rows(self.name, "target", target, f if moving else m, 3)
            return np.broadcast_to(rows[:, None], (f, m, 3)) if moving else rows[None]
        if given.shape != (f, m, 3):
            raise validate.fail(
                self.name, "target", f"have shape ({f}, {m}, 3) or ({f}, 3)", given.shape,
                "give the points at each time",
            )  # fmt: skip
        return validate.rows(self.name, "target", given.reshape(-1, 3), f * m, 3).reshape(f, m, 3)

    def columns(self, model: Model, w: int) -> dict[str, np.ndarray]:
        columns = super().columns(model, w)
        columns["target"] = (
            model.scenes[w].position[self.particles[:, 0]]
            if self.points is None
            else self.points[0]
        )
        return columns

    def evaluation(self, model: Model, item: Any) -> wp.Function:
        return attachment_evaluation(model.precision, item)

    def prepare(self, model: Model, neighbors: Neighbors) -> None:
        super().prepare(model, neighbors)
        self.moving = any(len(peer.times) > 1 for peer in self.peers)
        if self.moving:
            self.requires = self.requires | {"time"}

    def attach(self, model: Model, state: State) -> None:
        super().attach(model, state)
        if self.count and self.moving:
            self.keys = self._keyframes(model)
            self.follow = follow_kernel(model.precision, self.tuples.Item)

    def _keyframes(self, model: Model) -> Any:
        """The keyframes of all worlds; those of a row follow each other."""
        points = [
            peer.columns(model, w)["target"][None] if peer.points is None else peer.points
            for w, peer in enumerate(self.peers)
        ]
        frames = np.array([len(each) for each in points])
        rows = np.array([each.shape[1] for each in points])
        count = np.repeat(frames, rows)
        world = np.repeat(np.arange(len(points)), rows)
        order = self.tuples.order
        columns = {
            "world": world,
            "count": count,
            "clock": np.repeat(np.cumsum(frames) - frames, rows),
            "first": np.cumsum(count) - count,
        }
        keys = Keyframes()
        for name, column in columns.items():
            setattr(keys, name, model.array(column[order].astype(np.int32), wp.int32))
        keys.time = model.array(np.concatenate([peer.times for peer in self.peers]), wp.float64)
        places = np.concatenate([np.swapaxes(each, 0, 1).reshape(-1, 3) for each in points])
        model.fits(self.name, {"target": places})
        keys.place = model.array(places, wp.vec3d)
        return keys

    def begin(self, state: State, neighbors: Neighbors, dt: float) -> None:
        super().begin(state, neighbors, dt)
        if self.count and self.moving and dt > 0:
            # The clock goes with the positions: this is where the substep ends.
            inputs = [self.keys, state.time, self.struct.item]
            launch(self.follow, self.count, inputs, self.model.device)
