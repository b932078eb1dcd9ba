"""Boundaries of triangles."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import warp as wp

from ... import validate
from ...engine.model import Model
from ...kernels.constraints.boundaries import mesh as kernels
from ...kernels.precision import Precision
from ...scene.group import select
from .combined import ShapedBoundary
from .motion import Motion
from .solid import STILL

FLAT = 1e-12  # of the square of its longest side, below which a triangle has no area


class MeshBoundary(ShapedBoundary):
    """The outside of a closed mesh, its inside, or both sides of a sheet of triangles.

    Particles are held off from the nearest point of the triangles. None goes through one, however
    fast: the way from where its substep began is followed. What is in the solid from the start is
    brought out to the nearest point. That is told by the winding number (Jacobson et al. 2013), so
    that an obstacle may consist of several closed parts, also overlapping ones.

    Triangles are looked for in single precision, relative to the middle of the mesh and in units of
    its size, and then measured in that of the simulation. So far from the origin, places are as
    exact as the simulation's own, and parts of the mesh may be smaller than it by up to 1e6.

    Args:
        vertices: (p, 3) [length].
        triangles: (t, 3) indices of vertices. Of a closed mesh those of neighbours go round the
            same way, either way.
        inside: True: a container; False: an obstacle.
        friction: mu, at least 0.
        restitution: e, 0 to 1: speed after over speed before, both against the surface's.
        group: Which particles it holds; None: all.
        sheet: It need not be closed, and holds particles on the side on which they are.
        thickness: Between the triangles and the surface, on each side [length], at least 0. A sheet
            holds points, which have no radius, by its thickness alone.
        velocity: Of the mesh, (3,) [length/time].
        angular_velocity: About the pivot, (3,) [rad/time].
        pivot: What it turns about, as described, (3,) [length].
        slip: A fluid slips along it; False: a viscous one sticks to it.
        motion: A ``Trajectory`` or ``Keyframes`` in the place of both velocities.

    Raises:
        ValueError: Values out of range; triangles without area, or of vertices that are not there;
            a mesh that is no sheet and not closed; a sheet without thickness that holds particles
            without radius; a periodic scene.

    Example:
        >>> corners = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
        >>> rock = MeshBoundary(corners, [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)], friction=0.5)
        >>> rock.distance([(0, 0, -1), (0.25, 0.25, 0.125)]).tolist()
        [1.0, -0.125]
    """

    sides = 3
    tracked = True

    def __init__(
        self, vertices: Any, triangles: Any, inside: bool = False, friction: float = 0.0,
        restitution: float = 0.0, group: Any = None, *, sheet: bool = False,
        thickness: float = 0.0, velocity: Sequence[float] = STILL,
        angular_velocity: Sequence[float] = STILL, pivot: Sequence[float] = STILL,
        slip: bool = True, motion: Motion | None = None,
    ):  # fmt: skip
        self._holds(friction, restitution, group, velocity, angular_velocity, slip, motion)
        self.pivot = validate.vector(self.name, "pivot", pivot, unit="length")
        self.inside, self.sheet = bool(inside), bool(sheet)
        self.thickness = validate.number(
            self.name, "thickness", thickness, minimum=0.0, unit="length"
        )
        points = validate.rows(self.name, "vertices", vertices, None, 3)
        corners = validate.triangles(self.name, triangles, len(points))
        # Vertices at one place are one, as in files that list each triangle's own.
        self.vertices, same = np.unique(points, axis=0, return_inverse=True)
        self.triangles = same.reshape(-1)[corners]
        self._check_areas()
        if self.inside and self.sheet:
            raise validate.fail(
                self.name, "inside", "be False of a sheet, which has no inside", inside,
                "leave it out",
            )  # fmt: skip
        if not self.sheet:
            self._check_closed()
        self._made: dict[tuple[str, str], dict[str, Any]] = {}

    def _check_areas(self) -> None:
        lower, upper = self.vertices.min(axis=0), self.vertices.max(axis=0)
        self.center, self.size = 0.5 * lower + 0.5 * upper, 0.5 * upper - 0.5 * lower
        self.unit = float(self.size.max())
        a, b, c = np.moveaxis((self.vertices - self.center)[self.triangles], 1, 0) / self.unit
        normal = np.cross(b - a, c - a)
        longest = np.max([((p - q) ** 2).sum(axis=1) for p, q in ((a, b), (b, c), (c, a))], axis=0)
        flat = np.linalg.norm(normal, axis=1) <= FLAT * longest
        if flat.any():
            at = int(np.argmax(flat))
            raise validate.fail(
                self.name, f"triangles[{at}]", "have an area",
                self.vertices[self.triangles[at]].tolist(), "leave it out",
            )  # fmt: skip
        self.volume = float((a * normal).sum() / 6.0)  # in units, positive if counterclockwise

    def _check_closed(self) -> None:
        """Every edge has two triangles, which go along it in opposite directions."""
        edges = np.concatenate([self.triangles[:, [k, (k + 1) % 3]] for k in range(3)])
        ways, counts = np.unique(edges, axis=0, return_counts=True)
        known = {(int(a), int(b)) for a, b in ways}
        back = np.array([(int(b), int(a)) in known for a, b in ways])
        alone = np.flatnonzero((counts > 1) | ~back)
        if len(alone):
            ends = self.vertices[ways[alone[0]]].tolist()
            raise validate.fail(
                self.name, "triangles", "close a surface, all going round the same way",
                f"an edge {ends} that two do not share so",
                "close it, or set sheet=True",
            )  # fmt: skip
        if self.volume < 0:
            self.triangles = self.triangles[:, ::-1]

    def near(self, precision: Precision, params: Any) -> wp.Function:
        return kernels.mesh_near(precision, params)

    def _geometry(self, device: Any, precision: Precision) -> dict[str, Any]:
        key = str(device), precision.name
        if key not in self._made:
            self._made[key] = self._on(device, precision)
        made = {name: each for name, each in self._made[key].items() if name != "owner"}
        return {
            **made, "center": self.center, "size": self.size, "inverse_unit": 1.0 / self.unit,
            "inside": int(self.inside), "sheet": int(self.sheet), "thickness": self.thickness,
            "room": np.inf,
        }  # fmt: skip

    def _on(self, device: Any, precision: Precision) -> dict[str, Any]:
        """What is held on a device, with Warp's mesh, which is named by a number."""
        points = self.vertices - self.center
        corners = wp.array(self.triangles.reshape(-1), dtype=wp.int32, device=device)
        mesh = wp.Mesh(
            wp.array(points / self.unit, dtype=wp.vec3, device=device), corners,
            support_winding_number=not self.sheet,
        )  # fmt: skip
        points = wp.array(points, dtype=precision.vec3, device=device)
        return {"owner": mesh, "mesh": np.uint64(mesh.id), "points": points, "corners": corners}

    def _check(self, model: Model, w: int) -> None:
        super()._check(model, w)
        scene = model.scenes[w]
        points = not scene.radius[select(scene, self.group, self.name)].all()
        if self.sheet and not self.thickness and points:
            raise validate.fail(
                self.name, "thickness", "be above 0 where particles have no radius",
                self.thickness, "give the sheet a thickness, or the particles a radius",
            )  # fmt: skip

    def shapes(self) -> list[dict[str, Any]]:
        mesh = {"points": self.vertices, "triangles": self.triangles, "container": self.inside}
        return [self._shape("mesh", **mesh)]
