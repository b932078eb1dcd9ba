"""Rigid bodies: particles that fill a shape, and keep it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ... import validate
from ...scene.constraint_base import ConstraintBase
from ...scene.scene import Scene
from ..clusters.shape_matching import ShapeMatching
from .body import Body, add_body, held

OWNER = "Scene.add_rigid_body"


def add_rigid_body(
    scene: Scene, points: Any, *, spacing: float, density: float, break_force: float | None = None,
    pinned: Any = (), velocity: Any = 0.0, angular_velocity: Any = (0.0, 0.0, 0.0),
    group: str | None = None, color: Sequence[float] | None = None,
) -> Body:  # fmt: skip
    """Add a rigid body: points of a lattice that fill it, held in their places.

    A particle weighs rho s^3 and has half a spacing s for its radius, by which contacts and
    boundaries hold it; a cube of n^3 has (1 - 1 / n^2) of the moment of inertia of a full one.

    Args:
        points: (n, 3) [length], at least two, as of ``sample.box``, ``sample.sphere`` or
            ``sample.mesh_points``.
        spacing: s, distance of neighbouring points [length].
        density: rho [mass/length^3].
        break_force: Force on a particle at which the body is gone for good [force]; None:
            unbreakable.
        pinned: Points that are held, by number or (n,) bool: one is a pivot, two are an axis.
        velocity: (3,) for all, or (n, 3) [length/time].
        angular_velocity: omega about the centre of mass, in addition, (3,) [rad/time].
        group, color: As of ``add_particles``.

    Returns:
        A :class:`Body` with the constraint ``"shape"``.

    Raises:
        ValueError: Fewer than two points, values out of range, and what ``add_particles`` refuses.

    Example:
        >>> from particlesim import Scene, sample
        >>> scene = Scene()
        >>> brick = sample.box((0, 0, 0), (0.2, 0.1, 0.1), spacing=0.05)
        >>> body = scene.add_rigid_body(brick, spacing=0.05, density=2000.0)
        >>> len(body.group), f"{scene.mass.sum():.1f} kg"
        (16, '4.0 kg')
    """
    x = validate.rows(OWNER, "points", points, None, 3)
    s = validate.number(OWNER, "spacing", spacing, above=0.0, unit="length")
    rho = validate.number(OWNER, "density", density, above=0.0, unit="mass/length^3")
    middle = x.mean(axis=0) if len(x) else np.zeros(3)
    omega = validate.vector(OWNER, "angular_velocity", angular_velocity, unit="rad/time")
    motion = validate.rows(OWNER, "velocity", velocity, len(x), 3)
    row = scene.particle_count + np.arange(len(x))
    constraints: dict[str, ConstraintBase] = {
        "shape": ShapeMatching([row], break_force=break_force)
    }
    return add_body(
        scene, x, constraints, mass=rho * s**3, radius=0.5 * s, pinned=held(OWNER, pinned, len(x)),
        velocity=motion + np.cross(omega, x - middle), group=group, color=color,
    )  # fmt: skip
