"""Cloth: distances along the edges of a mesh, and what resists its bending."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ... import validate
from ...scene import sample
from ...scene.constraint_base import ConstraintBase
from ...scene.scene import Scene
from ..distance import Distance
from ..kinds.bending import Bending, hinges
from .body import Body, add_body, compliance, held, massive, shares

OWNER = "Scene.add_cloth"


def add_cloth(
    scene: Scene, vertices: Any, triangles: Any, *, areal_density: float, radius: Any = 0.0,
    stiffness: float | None = None, bending_stiffness: float = 0.0, break_force: Any = None,
    pinned: Any = (), velocity: Any = 0.0, group: str | None = None,
    color: Sequence[float] | None = None,
) -> Body:  # fmt: skip
    """Add a cloth or a membrane: the vertices of a mesh, at the lengths of its edges.

    An edge of length l between triangles of the areas A_1 and A_2 has the stiffness
    Y (A_1 + A_2) / l^2 (Van Gelder 1998, eq. 6). Pulled along any direction, a mesh of equilateral
    triangles has then just Y for its modulus and narrows by a third; one of right-angled halves of
    squares, as ``sample.rectangle`` makes them, is a fifth stiffer along the squares' sides.

    Args:
        vertices: (n, 3) [length].
        triangles: (t, 3) indices of vertices, all turning the same way round, as of
            ``sample.rectangle``; drawn are those of which no edge is torn.
        areal_density: [mass/area]; a triangle weighs on its corners alike.
        radius: Of the particles, one or (n,), by which contacts and boundaries hold them [length].
        stiffness: Y, Young's modulus times the thickness [force/length]. None: it does not stretch.
        bending_stiffness: D = E h^3 / (12 (1 - nu^2)) [energy], at rest as it is at the start (see
            :class:`Bending`). 0: it bends freely.
        break_force: Force at which an edge is torn for good [force], one or one for each row of
            ``sample.edges(triangles)``; None: unbreakable.
        pinned: Vertices that are held, by number or (n,) bool.
        velocity, group, color: As of ``add_particles``.

    Returns:
        A :class:`Body` with the constraints ``"stretch"`` and, where it resists, ``"bend"``.

    Raises:
        ValueError: A triangle without area, a vertex in none, and what ``add_particles`` refuses.

    Example:
        >>> from particlesim import Scene, sample
        >>> scene = Scene()
        >>> mesh = sample.rectangle((0, 1, 0), [(0, 0, 1), (1, 0, 0)], cells=10)
        >>> cloth = scene.add_cloth(*mesh, areal_density=0.15, pinned=[0, 10], group="flag")
        >>> len(cloth.group), len(cloth.group.triangles), f"{scene.mass.sum():.2f} kg"
        (121, 200, '0.15 kg')
    """
    x = validate.rows(OWNER, "vertices", vertices, None, 3)
    faces = validate.triangles(OWNER, triangles, len(x))
    area = areas(OWNER, x, faces)
    heavy = validate.number(OWNER, "areal_density", areal_density, above=0.0, unit="mass/area")
    share = shares(faces, area, len(x))
    massive(OWNER, "vertices", share)
    pairs, first = sample.edges(faces), scene.particle_count
    softness = _slenderness(x, pairs, faces, area)
    softness *= compliance(OWNER, "stiffness", stiffness, "force/length")
    constraints: dict[str, ConstraintBase] = {
        "stretch": Distance(pairs + first, compliance=softness, break_force=break_force)
    }
    d = validate.number(OWNER, "bending_stiffness", bending_stiffness, minimum=0.0, unit="energy")
    if d > 0.0 and len(bends := hinges(faces)):
        constraints["bend"] = Bending(bends + first, compliance=_breadth(x, bends) / d)
    return add_body(
        scene, x, constraints, mass=heavy * share, radius=radius, triangles=faces,
        pinned=held(OWNER, pinned, len(x)), velocity=velocity, group=group, color=color,
    )  # fmt: skip


def areas(owner: str, x: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Of triangles that have one, (t,)."""
    a, b, c = x[faces.T]
    area = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
    longest = np.maximum(np.linalg.norm(b - a, axis=1), np.linalg.norm(c - a, axis=1))
    flat = area <= 1e-9 * longest**2
    if flat.any():
        at = int(np.argmax(flat))
        raise validate.fail(
            owner, f"triangles[{at}]", "have an area", faces[at].tolist(),
            "leave it out, or join vertices that coincide",
        )  # fmt: skip
    return area


def _slenderness(
    x: np.ndarray, pairs: np.ndarray, faces: np.ndarray, area: np.ndarray
) -> np.ndarray:
    """l^2 over the area of the triangles beside each edge, (m,)."""
    sides = np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    at = np.searchsorted(pairs @ [len(x), 1], sides @ [len(x), 1])  # edges are in order
    beside = np.bincount(at, weights=np.repeat(area, 3), minlength=len(pairs))
    return ((x[pairs[:, 1]] - x[pairs[:, 0]]) ** 2).sum(axis=1) / beside


def _breadth(x: np.ndarray, bends: np.ndarray) -> np.ndarray:
    """The area of both triangles of a hinge over the square of its edge, (h,)."""
    edge, near, far = (x[bends[:, k]] - x[bends[:, 0]] for k in (1, 2, 3))
    area = sum(0.5 * np.linalg.norm(np.cross(edge, wing), axis=1) for wing in (near, far))
    return area / (edge**2).sum(axis=1)
