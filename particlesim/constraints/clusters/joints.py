"""Joints between rigid clusters, and between one and the world."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import warp as wp

from ... import validate
from ...engine import topology
from ...engine.execution.launch import launch
from ...engine.model import Model
from ...engine.neighbors.lists import Neighbors
from ...engine.state import State
from ...kernels.constraints.clusters import joints as kernels
from ...kernels.constraints.clusters.joint_bounce import bounce_kernel
from ...kernels.constraints.clusters.members import Form
from ..tuples import bodies
from .implicit import ImplicitClusters
from .members import Members, checked


class BallJoint(ImplicitClusters):
    """A point of one cluster and a point of another, or of the world, stay together.

    Both points are those of the rotations that fit the clusters best, and an impulse at a point
    moves all members of its cluster as the rigid body of their masses (Mueller et al. 2020, eqs. 2
    to 9): the joint holds as well for a thousand members as for four. It acts on both sides at one
    place, so that momentum and angular momentum are kept to round-off. What keeps the clusters
    rigid is a :class:`~particlesim.constraints.clusters.shape_matching.ShapeMatching` of them.

    Args:
        a: Particle indices, or a Group, of the first cluster; a list of these for several joints.
        b: The same of the second; None: the world.
        point: Where they are joined at the start [length], (3,); (m, 3) for m joints.
        compliance: Distance of the points over force [length / force], one or one a joint, at
            least 0.
        break_force: Force beyond which a joint is gone for good [force], one or one a joint, above
            0; None: unbreakable.

    Raises:
        ValueError: Clusters of fewer than 2 particles, with one twice or out of range, or that
            share particles; points that are no points; values out of range.

    Example:
        >>> from particlesim import Scene, sample
        >>> scene = Scene()
        >>> box = sample.box((0, 0, 0), (2, 2, 2), 1.0)
        >>> left, right = scene.add_particles(box), scene.add_particles(box + (3, 0, 0))
        >>> joint = scene.add_constraint(BallJoint(left, right, (2.0, 1.0, 1.0)))
        >>> joint.point.tolist()
        [[2.0, 1.0, 1.0]]
    """

    requires = frozenset({"position", "velocity", "inverse_mass", "correction"})
    axis: np.ndarray | None = None
    lower: np.ndarray
    upper: np.ndarray

    def __init__(
        self, a: Any, b: Any, point: Any, *, compliance: Any = 0.0, break_force: Any = None
    ):
        name, one = self.name, np.ndim(point) == 1
        where = [point] if one else point
        self.point = validate.rows(name, "point", where, None, 3)
        count = len(self.point)
        self.a = self._side("a", [a] if one else a, count)
        self.b = None if b is None else self._side("b", [b] if one else b, count)
        for n, (left, right) in enumerate(zip(self.a, self.b or [], strict=False)):
            shared = np.intersect1d(left, right)
            if len(shared):
                raise validate.fail(
                    name, f"b[{n}]", "hold other particles than a", int(shared[0]),
                    "leave it out of one of them",
                )  # fmt: skip
        self.compliance = topology.per_item(name, "compliance", compliance, count, minimum=0)
        self.break_force = (
            None
            if break_force is None
            else topology.limits(name, "break_force", break_force, count)
        )

    def _side(self, which: str, value: Any, count: int) -> list[np.ndarray]:
        rows = checked(self.name, value, which)
        if len(rows) != count:
            raise validate.fail(
                self.name, which, f"hold a cluster for each of {count} points", len(rows),
                "give one list of indices for each",
            )  # fmt: skip
        return rows

    @property
    def sides(self) -> list[list[np.ndarray]]:
        """The clusters, those of ``a`` and then those of ``b`` if it has them."""
        return [self.a] if self.b is None else [self.a, self.b]

    def kind(self) -> tuple[Any, ...]:
        return type(self), self.b is None, self.break_force is None

    # The engine's side ------------------------------------------------------------------------

    @property
    def breakable(self) -> bool:
        return self.break_force is not None

    @property
    def sorting(self) -> tuple[np.ndarray, np.ndarray]:
        return self.order, self.edges

    def prepare(self, model: Model, neighbors: Neighbors) -> None:
        self.model = model
        each = [[row for side in peer.sides for row in side] for peer in self.peers]
        none = np.zeros(sum(map(len, each)), dtype=np.int32)
        shapes: list[None] = [None] * len(each)
        self.members = Members(self.name, model, each, shapes, none)
        lengths = [len(peer.point) for peer in self.peers]
        self.count, self.edges = sum(lengths), np.concatenate([[0], np.cumsum(lengths)])
        together = [
            [np.concatenate(rows) for rows in zip(*peer.sides, strict=True)] for peer in self.peers
        ]
        color = np.concatenate([np.zeros(0, dtype=np.int32), *map(topology.colors, together)])
        self.order = np.argsort(color, kind="stable")
        self.worlds_joined = np.repeat(np.arange(len(lengths)), lengths)[self.order]
        rows = np.bincount(color) if self.count else np.zeros(0, dtype=np.int64)
        self.spans = list(itertools.pairwise([0, *np.cumsum(rows).tolist()]))

    def _columns(self) -> dict[str, np.ndarray]:
        """What joints are, in the order in which the worlds list them."""
        members, model = self.members, self.model
        found: dict[str, list[Any]] = {name: [] for name in ("a", "b", "q_a", "q_b")}
        held = model.column("pinned") > 0
        for w, peer in enumerate(self.peers):
            count, first = len(peer.point), members.edges[w]
            for n in range(count):
                ends = [first + n, first + count + n if peer.b else -1]
                for side, k in zip("ab", ends, strict=True):
                    found[side].append(k)
                    found[f"q_{side}"].append(self._place(w, k, peer.point[n]))
        columns = {name: np.array(rows) for name, rows in found.items()}
        free = np.array([float(not held[row].all()) for row in members.particles] + [0.0])
        columns |= {"mobile_a": free[columns["a"]], "mobile_b": free[columns["b"]]}
        return columns | self._angles()

    def _place(self, w: int, k: int, point: np.ndarray) -> np.ndarray:
        """A point from the centre of cluster k, as its nearest image; of the world, as it is."""
        if k < 0:
            return point
        members, model = self.members, self.model
        first = model.scenes[w].position[members.particles[k][0] - model.offsets[w]]
        return topology.nearest(point - first - members.centre[k], model.box_start[w])

    def _angles(self) -> dict[str, np.ndarray]:
        """Axes, what is across them, and limits, of hinges."""
        return {}

    def attach(self, model: Model, state: State) -> None:
        if not self.count:
            return
        columns = {**self._columns(), **self._values("compliance")}
        if self.break_force is not None:
            columns |= self._values("break_force", "limit")
        self.bodies, self.struct = bodies(model, state), kernels.Joints()
        for name, column in columns.items():
            real = wp.vec3d if column.ndim == 2 else wp.float64
            whole = column.dtype.kind == "i"
            host = column[self.order].astype(np.int32 if whole else np.float64)
            setattr(self.struct, name, model.array(host, wp.int32 if whole else real))
        self.struct.lam = wp.zeros(self.count, dtype=wp.vec3d, device=model.device)
        self.struct.broken = wp.zeros(self.count, dtype=wp.int32, device=model.device)
        self.pull = wp.zeros(self.count, dtype=wp.float64, device=model.device)
        nothing = np.zeros(self.members.count)
        self.clusters = self.members.struct(nothing, nothing, False)
        clusters = Form(model.precision, model.periodic, "position_error" in state, False, False)
        self.form = kernels.JointForm(clusters, self.axis is not None)
        self.project_kernel, self.fresh = kernels.project_kernel(self.form), True

    def _values(self, name: str, field: str | None = None) -> dict[str, np.ndarray]:
        return {field or name: np.concatenate([getattr(peer, name) for peer in self.peers])}

    def project(self, state: State, neighbors: Neighbors, dt: float) -> None:
        if not self.count or dt <= 0:
            return
        fresh, own, timed = self._timing(dt)
        for start, end in self.spans:
            inputs = [start, fresh, own, 1.0 / dt, timed, self.model.box, self.struct,
                      self.clusters, self.bodies]  # fmt: skip
            launch(self.project_kernel, end - start, inputs, self.model.device)

    def bounce(self, state: State, neighbors: Neighbors, bounces: Any, dt: float) -> None:
        """The velocities' change since ``before`` becomes one that rigid joints allow.

        Momentum and angular momentum of the change are kept.
        """
        for start, end in self.spans:
            inputs = [start, self.model.box, self.struct, self.clusters, self.bodies, bounces]
            launch(bounce_kernel(self.form), end - start, inputs, self.model.device)

    def _strain(self, may_break: int, dt: float) -> wp.array:
        """The force of each joint."""
        inputs = [may_break, self.struct, (1.0 / dt) ** 2, self.pull]
        launch(kernels.strain_kernel(), self.count, inputs, self.model.device)
        return self.pull

    def persistent(self) -> dict[str, wp.array]:
        if not self.count:
            return {}
        return {"turn": self.clusters.turn, "broken": self.struct.broken}

    def readable(self) -> dict[str, wp.array]:
        return {"lam": self.struct.lam} if self.count else {}

    def worlds(self, name: str, array: wp.array) -> np.ndarray | None:
        return self.members.world if name == "turn" else self.worlds_joined
