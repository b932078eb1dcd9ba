"""Triangles of boundaries, for recordings."""

from __future__ import annotations

import numpy as np

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
