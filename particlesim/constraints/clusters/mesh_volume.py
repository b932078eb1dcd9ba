"""The volume of closed meshes: balloons, cushions and soft shells."""

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
from ...kernels.constraints.clusters import mesh_volume as kernels
from ...kernels.constraints.clusters.members import Form
from ..tuples import bodies
from .implicit import ImplicitClusters
from .members import Members, colors


class MeshVolume(ImplicitClusters):
    """C = V - p V_0: each closed mesh of triangles encloses the volume V = p V_0.

    V = sum over triangles of a . (b x c) / 6, solved as one constraint of all vertices (Mueller et
    al. 2007, eqs. 26 to 28, with XPBD's compliance). Its impulses have no torque about the places
    where the substep began, so momentum and angular momentum are kept to round-off. The pressure
    that holds the volume is what :meth:`~particlesim.Simulation.force` tells.

    Args:
        triangles: (t, 3) indices of a mesh's corners, all of them counterclockwise from outside,
            or all from inside; a list of these for several meshes.
        pressure: p, the volume in parts of the rest volume, one or one a mesh, above 0.
        rest_volume: V_0 [volume], one or one a mesh, above 0; None: as at the start.
        compliance: alpha, volume over pressure [volume / pressure], one or one a mesh, at least 0.
        burst_pressure: Beyond which a mesh no longer holds anything [pressure], one or one a mesh,
            above 0; None: it never bursts.

    Raises:
        ValueError: A mesh that is not closed, or not of triangles that go round the same way, or
            flat with no rest volume; indices or values out of range.

    Example:
        >>> faces = [(0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3)]
        >>> MeshVolume(faces, pressure=1.5).pressure.tolist()
        [1.5]
    """

    requires = frozenset({"position", "velocity", "inverse_mass", "correction"})

    def __init__(
        self, triangles: Any, pressure: Any = 1.0, *, rest_volume: Any = None,
        compliance: Any = 0.0, burst_pressure: Any = None,
    ):  # fmt: skip
        name = self.name
        self.triangles = [_closed(name, mesh) for mesh in _meshes(triangles)]
        self.corners = [np.unique(mesh) for mesh in self.triangles]
        count = len(self.triangles)
        self.pressure = topology.limits(name, "pressure", pressure, count)
        self.rest_volume = (
            None
            if rest_volume is None
            else topology.limits(name, "rest_volume", rest_volume, count)
        )
        self.compliance = topology.per_item(name, "compliance", compliance, count, minimum=0)
        self.burst_pressure = (
            None if burst_pressure is None
            else topology.limits(name, "burst_pressure", burst_pressure, count)
        )  # fmt: skip

    def kind(self) -> tuple[Any, ...]:
        return type(self), self.burst_pressure is None

    # The engine's side ------------------------------------------------------------------------

    @property
    def breakable(self) -> bool:
        return self.burst_pressure is not None

    def prepare(self, model: Model, neighbors: Neighbors) -> None:
        self.model = model
        corners = [peer.corners for peer in self.peers]
        none: list[None] = [None] * len(corners)
        self.members = Members(self.name, model, corners, none, colors(corners))
        self.count = self.members.count
        none_yet = np.zeros(0)
        starts = [peer._volumes(model, w) for w, peer in enumerate(self.peers)]
        rest = [
            np.abs(found) if peer.rest_volume is None else peer.rest_volume
            for peer, found in zip(self.peers, starts, strict=True)
        ]
        self.inwards = np.concatenate([none_yet, *starts]) < 0  # the triangles face
        self.target = np.concatenate([none_yet, *rest]) * self._listed_values("pressure")

    def _listed_values(self, name: str) -> np.ndarray:
        return np.concatenate([getattr(peer, name) for peer in self.peers])

    def _volumes(self, model: Model, w: int) -> np.ndarray:
        """Of each mesh, of world w, at the start; below 0 where triangles face inwards."""
        found = np.zeros(len(self.triangles))
        x, box = model.scenes[w].position, model.box_start[w]
        for n, mesh in enumerate(self.triangles):
            d = topology.nearest(x[mesh] - x[mesh[0, 0]], box)
            found[n] = np.einsum("ti,ti->", d[:, 0], np.cross(d[:, 1], d[:, 2])) / 6
            if self.rest_volume is None and found[n] == 0:
                raise validate.fail(
                    self.name, f"triangles[{n}]", "enclose a volume above 0 at the start", 0.0,
                    "give rest_volume",
                )  # fmt: skip
        return found

    def attach(self, model: Model, state: State) -> None:
        if not self.count:
            return
        members, device = self.members, model.device
        self.bodies = bodies(model, state)
        nothing = np.zeros(self.count)
        self.clusters = members.struct(nothing, nothing, False)
        self.struct = kernels.Volumes()
        for name, column in self._faces().items():
            setattr(self.struct, name, model.array(column.astype(np.int32), wp.int32))
        burst = self.burst_pressure is not None
        values = {"target": self.target, "compliance": self._listed_values("compliance")}
        values["limit"] = self._listed_values("burst_pressure") if burst else nothing
        for name, column in values.items():
            setattr(self.struct, name, model.array(column[members.order], wp.float64))
        self.struct.slope = wp.zeros(len(self.clusters.particle), dtype=wp.vec3d, device=device)
        self.struct.sums = wp.zeros(len(self.clusters.cluster), dtype=wp.vec2d, device=device)
        for name in ("lam", "step"):
            setattr(self.struct, name, wp.zeros(self.count, dtype=wp.float64, device=device))
        self.struct.broken = wp.zeros(self.count, dtype=wp.int32, device=device)
        self.found = wp.zeros(self.count, dtype=wp.float64, device=device)
        form = Form(model.precision, model.periodic, "position_error" in state, False, False)
        self.add_up, self.solve, self.inflate = (
            make(form)
            for make in (kernels.add_up_kernel, kernels.solve_kernel, kernels.inflate_kernel)
        )
        self.fresh = True

    def _faces(self) -> dict[str, np.ndarray]:
        """The triangles of each member, by its two other corners in turn."""
        meshes = [mesh for peer in self.peers for mesh in peer.triangles]
        counts, left, right = [np.zeros(1, dtype=np.int64)], [], []
        for k, row in zip(self.members.order, self.members.particles, strict=True):
            world = int(np.searchsorted(self.members.edges, k, side="right")) - 1
            outwards = meshes[k][:, ::-1] if self.inwards[k] else meshes[k]
            mesh = outwards + self.model.offsets[world]
            first, then, last = np.concatenate([mesh, np.roll(mesh, -1, 1), np.roll(mesh, 1, 1)]).T
            order = np.argsort(first, kind="stable")
            counts.append(np.bincount(np.searchsorted(row, first), minlength=len(row)))
            left.append(then[order])
            right.append(last[order])
        face = np.cumsum(np.concatenate(counts))
        return {"face": face, "left": np.concatenate(left), "right": np.concatenate(right)}

    def project(self, state: State, neighbors: Neighbors, dt: float) -> None:
        if not self.count or dt <= 0:
            return
        fresh, own, timed = self._timing(dt)
        device, t, c, b = self.model.device, self.struct, self.clusters, self.bodies
        for start, end, first, last in self.members.spans:
            inputs = [first, own, timed, self.model.box, t, c, b]
            launch(self.add_up, last - first, inputs, device)
            launch(self.solve, end - start, [start, fresh, 1.0 / dt, t, c], device)
            launch(self.inflate, last - first, [first, t, c, b], device)

    def _strain(self, may_break: int, dt: float) -> wp.array:
        """The pressure in each mesh, above 0 where it pushes outwards."""
        inputs = [may_break, self.struct, (1.0 / dt) ** 2, self.found]
        launch(kernels.pressure_kernel(), self.count, inputs, self.model.device)
        return self.found

    def persistent(self) -> dict[str, wp.array]:
        return {"broken": self.struct.broken} if self.count else {}

    def readable(self) -> dict[str, wp.array]:
        return {"lam": self.struct.lam} if self.count else {}

    def worlds(self, name: str, array: wp.array) -> np.ndarray | None:
        return self.members.world


def _meshes(value: Any) -> list[np.ndarray]:
    """One mesh, or each of several, as arrays."""
    try:
        array = np.asarray(value)
    except ValueError:  # of different lengths
        return [np.asarray(each) for each in value]
    if array.ndim == 3:
        return list(array)
    return [array] if array.size or array.ndim > 1 else []


def _closed(owner: str, value: np.ndarray) -> np.ndarray:
    """A mesh each edge of which is that of two triangles, once in either direction."""
    count = int(value.max(initial=0)) + 1 if np.issubdtype(value.dtype, np.integer) else 0
    mesh = validate.triangles(owner, value, count)
    edges = np.concatenate([mesh[:, [0, 1]], mesh[:, [1, 2]], mesh[:, [2, 0]]])
    once, times = np.unique(edges, axis=0, return_counts=True)
    if (times > 1).any():
        edge = once[int(np.argmax(times > 1))].tolist()
        raise validate.fail(
            owner, "triangles", "go round the same way, each edge once in either direction",
            f"{edge} twice", "turn round those that face the other way",
        )  # fmt: skip
    forth, back = ({(int(a), int(b)) for a, b in pairs} for pairs in (edges, edges[:, ::-1]))
    if forth != back:
        raise validate.fail(
            owner, "triangles", "close the mesh", f"an edge {min(forth - back)} of one triangle",
            "fill the hole",
        )  # fmt: skip
    return mesh
