"""Triangles of boundaries, for recordings."""

from __future__ import annotations

from typing import Any

import numpy as np
import warp as wp

CELLS = 64  # along the longest side of what is drawn
AROUND = 48  # points of a circle


def revolved(
    profile: np.ndarray, center: np.ndarray, axis: np.ndarray, aside: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """A surface of revolution.

    Args:
        profile: Radii and places along the axis of its points, (k, 2) [length], with rising places
            or, at the ends, falling radii.
        center: Where the axis is at 0, (3,).
        axis: Unit vector, (3,).
        aside: Unit vector across it, (3,).

    Returns:
        Points, (p, 3), and triangles, (t, 3), counterclockwise from outside.
    """
    angle = 2 * np.pi * np.arange(AROUND) / AROUND
    circle = np.outer(np.cos(angle), aside) + np.outer(np.sin(angle), np.cross(axis, aside))
    points = center + profile[:, :1, None] * circle + profile[:, 1:, None] * axis
    ring, k = np.meshgrid(np.arange(len(profile) - 1), np.arange(AROUND), indexing="ij")
    a = ring * AROUND + k
    b = ring * AROUND + (k + 1) % AROUND
    low = np.stack([a, b, b + AROUND], axis=-1)
    high = np.stack([a, b + AROUND, a + AROUND], axis=-1)
    triangles = np.concatenate([low.reshape(-1, 3), high.reshape(-1, 3)])
    points = points.reshape(-1, 3)
    # At a pole one side of a triangle vanishes.
    corners = points[triangles]
    area = np.linalg.norm(
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
    )
    return points, triangles[area > 1e-12 * area.max()]


def level_set(d: np.ndarray, lower: np.ndarray, upper: np.ndarray) -> dict[str, Any]:
    """The surface where a distance on a grid is 0, clear where it closes in the particles.

    Args:
        d: At the nodes, (n, m, k), positive where particles may be.
        lower: Where the first node is, (3,).
        upper: Where the last one is, (3,).

    Returns:
        ``points``, ``triangles`` and ``container`` of a shape; nothing where there is no surface.
    """
    from warp.geometry import IsoSurfaceMarchingCubes

    field = wp.array(d, dtype=wp.float32, device="cpu")
    points, corners = IsoSurfaceMarchingCubes.extract(field, lower=lower, upper=upper)
    triangles = corners.numpy().reshape(-1, 3)
    inside = bool(d[np.ix_([0, -1], [0, -1], [0, -1])].max() < 0)
    mesh = {"points": points.numpy(), "triangles": triangles, "container": inside}
    return mesh if len(triangles) else {}


def nodes(lower: np.ndarray, upper: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Places of a grid between corners, (n, 3), and how many there are along each axis, (3,)."""
    counts = 1 + np.ceil(CELLS * (upper - lower) / (upper - lower).max()).astype(int)
    axes = [np.linspace(*ends) for ends in zip(lower, upper, counts, strict=True)]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3), counts


def extent(shapes: list[dict[str, Any]]) -> tuple[np.ndarray, np.ndarray] | None:
    """Corners of a box with some room around shapes, but for planes and open boxes; None: none."""
    corners = [each for shape in shapes for each in _corners(shape) if np.isfinite(each).all()]
    if not corners:
        return None
    lower, upper = np.min(corners, axis=0), np.max(corners, axis=0)
    room = 0.05 * (upper - lower).max()
    return lower - room, upper + room


def _corners(shape: dict[str, Any]) -> list[np.ndarray]:
    if shape["kind"] == "box":
        return [shape["lower"], shape["upper"]]
    if shape["kind"] == "sphere":
        return [shape["center"] - shape["radius"], shape["center"] + shape["radius"]]
    return list(shape["points"]) if shape["kind"] == "mesh" else []


def turned_over(shape: dict[str, Any]) -> dict[str, Any]:
    """A shape whose inside and outside are exchanged."""
    if shape["kind"] == "plane":
        return {**shape, "normal": -shape["normal"]}
    return {**shape, "container": not shape.get("container", True)}
