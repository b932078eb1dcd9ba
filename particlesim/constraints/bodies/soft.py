"""Soft bodies: tetrahedra of an elastic material."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ... import validate
from ...scene import sample
from ...scene.constraint_base import ConstraintBase
from ...scene.sample.solids import volumes
from ...scene.scene import Scene
from ..kinds.neo_hookean import NeoHookean
from .body import Body, add_body, held, massive, shares

OWNER = "Scene.add_soft_body"


def add_soft_body(
    scene: Scene, vertices: Any, tetrahedra: Any, *, density: float, youngs_modulus: float,
    poissons_ratio: float = 0.3, damping: float = 0.0, radius: Any = 0.0, pinned: Any = (),
    velocity: Any = 0.0, group: str | None = None, color: Sequence[float] | None = None,
) -> Body:  # fmt: skip
    """Add a soft body: the vertices of tetrahedra of an elastic material (:class:`NeoHookean`).

    It is drawn as its surface.

    Args:
        vertices: (n, 3) [length].
        tetrahedra: (t, 4) indices of vertices, of positive volume; with the vertices as
            ``sample.box_tetrahedra``, ``sample.mesh_tetrahedra`` and ``sample.mesh`` give them.
        density: rho [mass/length^3]; a tetrahedron weighs on its corners alike.
        youngs_modulus: E [force/length^2].
        poissons_ratio: nu, 0 to 0.5.
        damping: tau, as of :class:`NeoHookean` [time].
        radius: Of the particles, one or (n,), by which contacts and boundaries hold them [length].
        pinned: Vertices that are held, by number or (n,) bool.
        velocity, group, color: As of ``add_particles``.

    Returns:
        A :class:`Body` with the constraint ``"elastic"``.

    Raises:
        ValueError: Tetrahedra of no or negative volume; a vertex in none; values out of range, and
            what ``add_particles`` refuses.

    Example:
        >>> from particlesim import Scene, sample
        >>> scene = Scene()
        >>> mesh = sample.box_tetrahedra((0, 0, 0), (0.2, 0.1, 0.1), spacing=0.05)
        >>> jelly = scene.add_soft_body(*mesh, density=1000.0, youngs_modulus=2e4)
        >>> len(jelly.group), len(jelly.group.triangles), f"{scene.mass.sum():.1f} kg"
        (45, 80, '2.0 kg')
    """
    x = validate.rows(OWNER, "vertices", vertices, None, 3)
    rho = validate.number(OWNER, "density", density, above=0.0, unit="mass/length^3")
    index = np.asarray(tetrahedra)
    skin = sample.surface(index)
    elastic = NeoHookean(
        index + scene.particle_count, youngs_modulus, poissons_ratio, damping=damping
    )
    volume = _volumes(x, index)
    share = shares(index, volume, len(x))
    massive(OWNER, "vertices", share)
    constraints: dict[str, ConstraintBase] = {"elastic": elastic}
    return add_body(
        scene, x, constraints, mass=rho * share, radius=radius, triangles=skin,
        pinned=held(OWNER, pinned, len(x)), velocity=velocity, group=group, color=color,
    )  # fmt: skip


def _volumes(x: np.ndarray, index: np.ndarray) -> np.ndarray:
    """Of tetrahedra that have one, (t,)."""
    if index.min() < 0 or index.max() >= len(x):
        worst = index.max() if index.max() >= len(x) else index.min()
        raise validate.fail(
            OWNER, "tetrahedra", f"hold indices from 0 to {len(x) - 1}", int(worst),
            "count the vertices from 0",
        )  # fmt: skip
    volume = volumes(x, index)
    longest = np.ptp(x[index], axis=1).max(axis=1)
    flat = volume <= 1e-9 * longest**3
    if flat.any():
        at = int(np.argmax(flat))
        raise validate.fail(
            OWNER, f"tetrahedra[{at}]", "have a volume above 0 [length^3]", float(volume[at]),
            "leave it out, or swap two of its vertices",
        )  # fmt: skip
    return volume
