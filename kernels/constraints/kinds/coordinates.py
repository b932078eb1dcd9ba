"""Constraints on the angle or the dihedral of a tuple."""

import itertools
import math

import warp as wp

from ...interactions import coordinates
from ...precision import Precision, function_from_source
from ..constraints import positions_type


def angle_evaluation(precision: Precision, item: type) -> wp.Function:
    """C = angle at the middle - rest angle."""
    return _evaluation(coordinates.angle(precision), (0, 1, 2), "{q}", precision, item)


def hinge_evaluation(precision: Precision, item: type) -> wp.Function:
    """C = fold - rest angle, -pi to pi, of the edge 0-1 with the wings 2 and 3.

    The fold is the dihedral along 2-0-1-3, which is pi in a plane, less pi.
    """
    turn = f"wp.round(({{q}}) * real({0.5 / math.pi!r}))"
    nearest = f"({{q}}) - {turn} * real({2.0 * math.pi!r})"
    nearest = nearest.replace("{q}", f"{{q}} - real({math.pi!r})")
    return _evaluation(coordinates.dihedral(precision), (2, 0, 1, 3), nearest, precision, item)


def _evaluation(
    coordinate: wp.Function, along: tuple[int, ...], value: str, precision: Precision, item: type
) -> wp.Function:
    """``coordinate`` (see kernels.interactions.coordinates) of the particles in this order.

    ``value``: C, of {q}, how far the coordinate is from the rest angle.
    """
    steps = ", ".join(f"X[{b}] - X[{a}]" for a, b in itertools.pairwise(along))
    last = len(along) - 1
    rows = {
        a: "-T[0]" if n == 0 else f"T[{n - 1}]" if n == last else f"T[{n - 1}] - T[{n}]"
        for n, a in enumerate(along)
    }
    gradient = ", ".join(rows[a] for a in sorted(rows))
    source = (
        "def coordinate_constraint(X: Positions, q: Item):\n"
        f"    value, T = coordinate(wp.matrix_from_rows({steps}))\n"
        f"    return {value.format(q='value - q.rest_angle')}, wp.matrix_from_rows({gradient})\n"
    )
    namespace = {
        "wp": wp, "coordinate": coordinate, "real": precision.scalar,
        "Positions": positions_type(precision, len(along)), "Item": item,
    }  # fmt: skip
    return function_from_source(source, namespace)
