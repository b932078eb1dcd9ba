"""Geometry: what a picture shows, as spheres, rounded cones and triangles, on the host."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

SHAPES = ("ball", "cone", "wire", "corner", "veil")


@dataclass(eq=False)
class Geometry:
    """Shapes to draw, in single precision. Colours are linear, 0..1.

    Example:
        >>> geometry = Geometry()
        >>> geometry.add_spheres([(0, 0, 0), (2, 0, 0)], 0.5, (0.2, 0.4, 0.9))
        >>> geometry.box.tolist()
        [[-0.5, -0.5, -0.5], [2.5, 0.5, 0.5]]
    """

    _parts: dict[str, list[np.ndarray]] = field(default_factory=dict, init=False)

    def add_spheres(self, position: Any, radius: Any, color: Any) -> None:
        """Spheres at (n, 3), of one radius or (n,) [length] and one colour or (n, 3)."""
        balls = _with_radius(_points(position), radius)
        self._add("ball", balls, len(balls), 1, color)

    def add_cones(
        self, start: Any, end: Any, radius: Any, color: Any, casts_shadow: bool = True
    ) -> None:
        """Rounded cones: spheres of changing size along a line.

        Args:
            start: (m, 3) [length].
            end: (m, 3) [length].
            radius: One, (m,), or (m, 2) for start and end [length].
            color: One, (m, 3), or (m, 2, 3).
            casts_shadow: Or not, as outlines, which are no bodies.
        """
        ends = np.stack([_points(start), _points(end)], axis=1)
        radii = np.asarray(radius, dtype=np.float32)
        radii = np.broadcast_to(radii[:, None] if radii.ndim == 1 else radii, ends.shape[:2])
        name = "cone" if casts_shadow else "wire"
        self._add(name, _with_radius(ends.reshape(-1, 3), radii.ravel()), len(ends), 2, color)

    def add_triangles(
        self, points: Any, triangles: Any, color: Any, normals: Any = None, opacity: float = 1.0
    ) -> None:
        """Triangles (t, 3) int between points (p, 3).

        Args:
            points: (p, 3) [length].
            triangles: (t, 3) int.
            color: One, (t, 3), or (t, 3, 3) for the corners.
            normals: (t, 3, 3) at the corners, for smooth shading; None: flat.
            opacity: 1 is solid; a clear triangle casts no shadow.
        """
        index = np.asarray(triangles).reshape(-1, 3)
        corners = _points(points)[index].reshape(-1, 3)
        if opacity < 1.0:
            self._add("veil", corners, len(index), 1, color)
            self._append("veil_opacity", np.full(len(index), opacity, dtype=np.float32))
            return
        self._add("corner", corners, len(index), 3, color)
        smooth = np.zeros_like(corners) if normals is None else np.reshape(normals, (-1, 3))
        self._append("normal", smooth.astype(np.float32))

    def array(self, name: str) -> np.ndarray:
        """Rows of a kind, float32; an array without rows if there are none.

        Args:
            name: ``ball``, ``cone`` and ``wire`` (two rows each; wires cast no shadow), ``corner``
                (three a solid triangle), ``normal`` (of these), ``veil`` (three a clear triangle),
                ``veil_opacity``, and ``<name>_color``.
        """
        parts = self._parts.get(name)
        width = {"ball": (4,), "cone": (4,), "wire": (4,), "veil_opacity": ()}.get(name, (3,))
        return np.concatenate(parts) if parts else np.zeros((0, *width), dtype=np.float32)

    @property
    def box(self) -> np.ndarray:
        """Lower and upper corner of all, (2, 3) [length]; the unit box where there is nothing."""
        box = self.box_of(*SHAPES)
        return np.array([[-0.5] * 3, [0.5] * 3]) if box is None else box

    def points(self, *names: str) -> tuple[np.ndarray, np.ndarray]:
        """What is on the outside of what is named (see :meth:`array`), or of all shapes.

        Returns:
            Points (n, 3) and the radii there, (n,).
        """
        rows = [self.array(name) for name in names or SHAPES]
        found = np.concatenate([r if r.shape[1] == 4 else _with_radius(r, 0.0) for r in rows])
        return found[:, :3], found[:, 3]

    def box_of(self, *names: str) -> np.ndarray | None:
        """Lower and upper corner of what is named (see :meth:`array`), (2, 3); None of nothing."""
        low, high = [], []
        for name in names:
            rows = self.array(name)
            if len(rows):
                r = rows[:, 3:] if rows.shape[1] == 4 else np.float32(0.0)
                low.append((rows[:, :3] - r).min(axis=0))
                high.append((rows[:, :3] + r).max(axis=0))
        if not low:
            return None
        return np.array([np.min(low, axis=0), np.max(high, axis=0)], dtype=np.float64)

    def _add(self, name: str, rows: np.ndarray, count: int, each: int, color: Any) -> None:
        """Rows of ``count`` shapes, and ``each`` colours a shape."""
        given = np.asarray(color, dtype=np.float32)
        given = given[:, None] if given.ndim == 2 else given
        colors = np.broadcast_to(given, (count, each, 3)).reshape(-1, 3)
        self._append(name, rows)
        self._append(f"{name}_color", colors)

    def _append(self, name: str, rows: np.ndarray) -> None:
        self._parts.setdefault(name, []).append(rows)


def _points(given: Any) -> np.ndarray:
    return np.asarray(given, dtype=np.float32).reshape(-1, 3)


def _with_radius(points: np.ndarray, radius: Any) -> np.ndarray:
    rows = np.empty((len(points), 4), dtype=np.float32)
    rows[:, :3] = points
    rows[:, 3] = radius
    return rows
