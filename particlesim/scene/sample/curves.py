"""Points along a curve."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ... import validate


def curve(points: Any, spacing: float) -> np.ndarray:
    """Points at even distances along a polyline, both of its ends among them.

    A line of length L gets max(1, round(L / spacing)) equal parts of arc length; the straight
    distance of two points is a little less where it turns between them.

    Args:
        points: Corners of the line (n, 3) [length], at least two, each apart from the next.
        spacing: Distance of neighbouring points [length], fitted to the length.

    Returns:
        Points (m, 3) [length], in order.

    Raises:
        ValueError: Fewer than two corners, corners that coincide with the next.

    Example:
        >>> curve([(0, 0, 0), (1, 0, 0), (1, 1, 0)], spacing=0.5)[:, 0].tolist()
        [0.0, 0.5, 1.0, 1.0, 1.0]
    """
    owner = "sample.curve"
    rows = validate.rows(owner, "points", points, None, 3)
    spacing = validate.number(owner, "spacing", spacing, above=0.0, unit="length")
    if len(rows) < 2:
        raise validate.fail(owner, "points", "be at least two", len(rows), "give both ends")
    length = np.linalg.norm(np.diff(rows, axis=0), axis=1)
    if not length.all():
        at = int(np.argmin(length))
        raise validate.fail(
            owner, f"points[{at + 1}]", "differ from the one before", rows[at + 1], "leave it out"
        )
    way = np.append(0.0, np.cumsum(length))
    parts = max(1, math.floor(way[-1] / spacing + 0.5))
    where = np.linspace(0.0, way[-1], parts + 1)
    return np.stack([np.interp(where, way, column) for column in rows.T], axis=1)
