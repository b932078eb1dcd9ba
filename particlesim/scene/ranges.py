"""Ranges: what the kernels' precision can hold of a scene, asked once when it is made.

What leaves it is refused by name, with the way out: other units, another origin or double
precision.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from .. import validate

REMEDY = "choose other units, or Settings(precision='float64')"
# Lengths that lie so many times within the roots of the smallest and the largest normal number have
# squares with all their digits, and so have sums of a few of them.
ROOM = 4.0
# What neighbouring numbers may be apart unasked, in parts of a length; of a diameter, as contacts
# see places with what rounding has kept from them: only the start is rounded.
COARSE, COARSE_DIAMETER = 1.0 / 64.0, 1.0 / 5.0


def fits(owner: str, columns: Mapping[str, np.ndarray], kind: Any) -> None:
    """Refuse numbers that become infinite in a precision, masses of which nothing is left, and
    parameters of all of which but few digits are; what is little beside others may well be nothing.
    """
    numbers = np.finfo(kind)
    for name, column in columns.items():
        given = np.asarray(column, dtype=np.float64)
        with np.errstate(over="ignore", under="ignore"):
            kept = given.astype(kind)
        lost = np.isfinite(given) & ~np.isfinite(kept)
        if name not in ("position", "velocity", "mass"):
            lost |= (given != 0) & (np.abs(kept).max(initial=0.0) < numbers.tiny)
        if name == "mass":
            with np.errstate(over="ignore", divide="ignore"):  # the inverse of 0, too
                lost |= ~np.isfinite((1.0 / given).astype(kind))
        if lost.any():
            raise validate.fail(
                owner, name,
                f"be within {np.dtype(kind)}, about {numbers.tiny:.0e} to {numbers.max:.0e}",
                float(given[tuple(np.argwhere(lost)[0])]), REMEDY,
            )  # fmt: skip


def squares_fit(owner: str, name: str, lengths: Any, kind: Any) -> None:
    """Refuse lengths whose squares leave a precision, so that distances could not be computed.

    One that is too large, or all that are above 0 too small: what is little beside others may well
    be nothing.
    """
    given = np.asarray(lengths, dtype=np.float64).ravel()
    numbers = np.finfo(kind)
    least = ROOM * float(np.sqrt(numbers.tiny))
    most = float(np.sqrt(numbers.max)) / ROOM
    lost = given >= most
    if 0 < given.max(initial=0.0) <= least:
        lost |= given > 0
    if lost.any():
        raise validate.fail(
            owner, name,
            f"have its square within {np.dtype(kind)}, {least:.1e} to {most:.1e} [length]",
            float(given[np.argmax(lost)]), REMEDY,
        )  # fmt: skip


def step_fits(step: float, kind: Any) -> None:
    """Refuse a substep that leaves a precision, so that nothing would move, or whose square leaves
    double precision, in which limits are computed.
    """
    numbers, double = np.finfo(kind), np.finfo(float)
    least = max(ROOM * float(np.sqrt(double.tiny)), float(numbers.tiny))
    most = min(float(np.sqrt(double.max)) / ROOM, float(numbers.max))
    if step and not least <= step <= most:
        raise validate.fail(
            "Settings", "dt", f"make a substep of {least:.1e} to {most:.1e} [time]", step, REMEDY
        )


def unresolved(
    owner: str, name: str, lengths: np.ndarray, x: np.ndarray, kind: Any, part: float
) -> str:
    """What is to be said of lengths that places are too far from the origin for; empty if nothing.

    Near x numbers are ``spacing(x)`` apart, and places are rounded to them.

    Args:
        owner: Whose lengths. name: What they are.
        lengths: (m,) [length]; 0 says nothing.
        x: (m,) the largest coordinates that go with them [length].
        kind: The precision's number.
        part: Of a length, what numbers may be apart unasked.
    """
    apart = np.spacing(np.abs(x).astype(kind)).astype(np.float64)
    coarse = (lengths > 0) & (apart > part * lengths)
    if not coarse.any():
        return ""
    k = int(np.argmax(np.where(coarse, apart / np.where(coarse, lengths, 1.0), 0.0)))
    return (
        f"{owner}: {name} must be far above what {np.dtype(kind)} tells apart, got {lengths[k]:.4g}"
        f" near {x[k]:.4g}, where places are {apart[k]:.3g} apart; choose an origin nearer by, or "
        "Settings(precision='float64')."
    )
