"""Ropes: distances along a line of particles, and what resists its bending."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import warp as wp

from ... import validate
from ...scene.constraint_base import ConstraintBase
from ...scene.law import law
from ...scene.scene import Scene
from ..constraint import Constraint
from ..distance import Distance
from .body import Body, add_body, compliance, held, shares

OWNER = "Scene.add_rope"


@law
def _bend(a: wp.vec3, b: wp.vec3, c: wp.vec3, before: float, after: float):
    return wp.length((c - b) / after - (b - a) / before)


def add_rope(
    scene: Scene, points: Any, *, linear_density: float, radius: Any = 0.0,
    stiffness: float | None = None, bending_stiffness: float = 0.0, tension_only: bool = False,
    break_force: float | None = None, pinned: Any = (), velocity: Any = 0.0,
    group: str | None = None, color: Sequence[float] | None = None,
) -> Body:  # fmt: skip
    """Add a rope, a cable or a straight rod: particles in a row, at their distances.

    A link of length l has the compliance l / EA. Where it resists bending, three neighbours with
    links l_1 and l_2 keep to a line,

        C = |(x_2 - x_1) / l_2 - (x_1 - x_0) / l_1|,   alpha = (l_1 + l_2) / (2 EI)

    which is curvature times length, and the energy that of a beam, EI / 2 int kappa^2 ds (Bergou
    et al. 2008, section 4.2; without twist).

    Args:
        points: (n, 3) [length], at least two, as of ``sample.curve``; the links are as long as they
            are apart.
        linear_density: [mass/length]; a particle has half of each of its links.
        radius: Of the particles, one or (n,), by which contacts and boundaries hold them [length].
        stiffness: EA, the force that would double the length [force]. None: it does not stretch.
        bending_stiffness: EI [force length^2], straight at rest. 0: it bends freely.
        tension_only: Links only pull, and go slack.
        break_force: At which a link is torn for good [force]; None: unbreakable.
        pinned: Points that are held, by number or (n,) bool. Two close to each other clamp an end.
        velocity, group, color: As of ``add_particles``.

    Returns:
        A :class:`Body` with the constraints ``"stretch"`` and, where it resists, ``"bend"``.

    Raises:
        ValueError: Fewer than two points, one on the next, and what ``add_particles`` refuses.

    Example:
        >>> from particlesim import Scene, sample
        >>> scene = Scene()
        >>> line = sample.curve([(0, 2, 0), (1, 2, 0)], spacing=0.1)
        >>> rope = scene.add_rope(line, linear_density=0.2, pinned=[0], group="rope")
        >>> len(rope.group), f"{scene.mass.sum():.1f} kg", list(rope.constraints)
        (11, '0.2 kg', ['stretch'])
    """
    x, length = _row(points)
    heavy = validate.number(OWNER, "linear_density", linear_density, above=0.0, unit="mass/length")
    softness = compliance(OWNER, "stiffness", stiffness, "force")
    resistance = validate.number(
        OWNER, "bending_stiffness", bending_stiffness, minimum=0.0, unit="force length^2"
    )
    row = scene.particle_count + np.arange(len(x))
    pairs = np.stack([row[:-1], row[1:]], axis=1)
    options: dict[str, Any] = {"tension_only": tension_only, "break_force": break_force}
    constraints: dict[str, ConstraintBase] = {
        "stretch": Distance(pairs, compliance=softness * length, **options)
    }
    if resistance > 0.0 and len(x) > 2:
        constraints["bend"] = _bending(row, length, resistance)
    return add_body(
        scene, x, constraints, mass=heavy * shares(pairs - row[0], length, len(x)), radius=radius,
        pinned=held(OWNER, pinned, len(x)), velocity=velocity, group=group, color=color,
    )  # fmt: skip


def _row(points: Any) -> tuple[np.ndarray, np.ndarray]:
    """Points of a rope, and the lengths between them."""
    x = validate.rows(OWNER, "points", points, None, 3)
    if len(x) < 2:
        raise validate.fail(OWNER, "points", "be at least two", len(x), "give both ends")
    length = np.linalg.norm(np.diff(x, axis=0), axis=1)
    if not length.all():
        at = int(np.argmin(length)) + 1
        raise validate.fail(
            OWNER, f"points[{at}]", "differ from the one before", x[at], "leave it out"
        )
    return x, length


def _bending(row: np.ndarray, length: np.ndarray, resistance: float) -> Constraint:
    """Of three neighbours each, of the whole row."""
    before, after = length[:-1], length[1:]
    return Constraint(
        _bend, np.stack([row[:-2], row[1:-1], row[2:]], axis=1),
        compliance=0.5 * (before + after) / resistance, before=before, after=after,
    )  # fmt: skip
