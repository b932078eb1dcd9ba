"""Cloth: distances along the edges of a mesh, and what resists its bending."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ... import validate
from ...scene import sample
from ...scene.constraint_base import ConstraintBase
from ...scene.scene import Scene
from ..contact import Contact
from ..distance import Distance
from ..kinds.bending import Bending, hinges
from .body import Body, add_body, compliance, held, massive, shares

OWNER = "Scene.add_cloth"


def add_cloth(
    scene: Scene, vertices: Any, triangles: Any, *, areal_density: float, radius: Any = 0.0,
    stiffness: float | None = None, bending_stiffness: float = 0.0, break_force: Any = None,
    self_collision: bool = False, self_friction: float = 0.0, pinned: Any = (),
    velocity: Any = 0.0, group: str | None = None, color: Sequence[float] | None = None,
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
        break_force: Force at which an edge is torn for good [force], and with it what bends there,
            one or one for each row of ``sample.edges(triangles)``; None: unbreakable.
        self_collision: Whether its vertices touch each other (:class:`Contact`), but for those that
            are held together. Their radii must be so large that none slips through a triangle, and
            so small that ends of edges do not overlap: 0.36 to 0.5 sides of a square's halves.
        self_friction: mu of that contact, at least 0.
        pinned: Vertices that are held, by number or (n,) bool.
        velocity, group, color: As of ``add_particles``.

    Returns:
        A :class:`Body` with ``"stretch"`` and, where it has them, ``"bend"`` and ``"touch"``.

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
    area, pairs = areas(OWNER, x, faces), sample.edges(faces)
    mass = _masses(faces, area, len(x), areal_density)
    mu = validate.number(OWNER, "self_friction", self_friction, minimum=0.0)
    if self_collision:
        _closed(x, faces, pairs, radius)
    parts = _holding(x, faces, pairs, area, stiffness, bending_stiffness, break_force, scene)
    body = add_body(
        scene, x, parts, mass=mass, radius=radius, triangles=faces,
        pinned=held(OWNER, pinned, len(x)), velocity=velocity, group=group, color=color,
    )  # fmt: skip
    if self_collision:
        parts["touch"] = scene.add_constraint(Contact(body.group, mu, exclude=True))
    return body


def _masses(faces: np.ndarray, area: np.ndarray, count: int, areal_density: float) -> np.ndarray:
    """Of the vertices, (n,): a triangle weighs on its corners alike."""
    share = shares(faces, area, count)
    massive(OWNER, "vertices", share)
    unit = "mass/area"
    return share * validate.number(OWNER, "areal_density", areal_density, above=0.0, unit=unit)


def _holding(
    x: np.ndarray, faces: np.ndarray, pairs: np.ndarray, area: np.ndarray,
    stiffness: float | None, bending_stiffness: float, break_force: Any, scene: Scene,
) -> dict[str, ConstraintBase]:  # fmt: skip
    """What holds a mesh together, whose vertices will be the next of the scene."""
    first, softness = scene.particle_count, _slenderness(x, pairs, faces, area)
    softness *= compliance(OWNER, "stiffness", stiffness, "force/length")
    stretch = Distance(pairs + first, compliance=softness, break_force=break_force)
    d = validate.number(OWNER, "bending_stiffness", bending_stiffness, minimum=0.0, unit="energy")
    if not d > 0.0 or not len(bends := hinges(faces)):
        return {"stretch": stretch}
    bend = Bending(
        bends + first, compliance=_breadth(x, bends) / d,
        edges=None if break_force is None else stretch,
    )  # fmt: skip
    return {"stretch": stretch, "bend": bend}


def _closed(x: np.ndarray, faces: np.ndarray, pairs: np.ndarray, radius: Any) -> None:
    """Refuse radii by which ends of an edge overlap, or vertices slip through a triangle."""
    r = validate.rows(OWNER, "radius", radius, len(x), None)
    length = np.linalg.norm(x[pairs[:, 1]] - x[pairs[:, 0]], axis=1)
    overlap = r[pairs].sum(axis=1) / length
    gap = _widest(x[faces])
    least = gap - r.min()
    thin = least / np.maximum(r[faces].min(axis=1), 1e-9 * gap)
    for excess, rows, bound, say in (
        (overlap, pairs, 0.5 * length, "most {:.4g} [length], half of the edge {}"),
        (thin, faces, least, "least {:.4g} [length], that nothing slips through {}"),
    ):
        at = int(np.argmax(excess))
        if excess[at] > 1.0 + 1e-9:
            raise validate.fail(
                OWNER, "radius", f"be at {say.format(bound[at], rows[at].tolist())}",
                float(r[rows[at]].max()), "change it, or the mesh, or leave self_collision out",
            )  # fmt: skip


def _widest(corners: np.ndarray) -> np.ndarray:
    """How far a point in a triangle may be from its nearest corner, of (t, 3, 3), (t,).

    The radius of the circle through the corners; in an obtuse one the place is on the longest side.
    """
    sides = np.linalg.norm(np.roll(corners, -1, axis=1) - np.roll(corners, 1, axis=1), axis=2)
    a, b, c = np.sort(sides, axis=1).T
    cosine = [(a**2 + b**2 - c**2) / (2 * a * b) for a, b, c in ((a, b, c), (b, c, a), (c, a, b))]
    round_all = 0.5 * c / np.sqrt(np.maximum(1 - cosine[0] ** 2, 1e-300))
    along = 0.5 * np.maximum(b / cosine[1], a / cosine[2])
    return np.where(cosine[0] < 0, along, round_all)


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
