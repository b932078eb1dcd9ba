"""Surface: a fluid's surface as a mesh of triangles, by splashsurf."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from .. import validate
from ..engine.source import Source
from ..interactions.fluid.sph import SPH
from ..scene.group import Group, select
from ..scene.scene import Scene

Mesh = tuple[np.ndarray, np.ndarray, np.ndarray]
SPACINGS = 1.3  # particle spacings in a smoothing length, where only the particles' size is known
LEVEL = 0.63  # of a flat face of a cubic lattice of that spacing, half a spacing above its end
MESH_STEPS, NORMAL_STEPS = 10, 3  # of smoothing at most, at the usual spacing
FINEST = 100  # grid's spacings in a smoothing length
FARTHEST = 2**20  # nodes along an axis, so that places in float32 are good to a part of a spacing
GONE = {
    "anisotropic": "surfaces are smoothed as meshes now: give smooth=0 for the plain level",
    "method": "all surfaces are by splashsurf",
    "node_limit": "the grid lies around the surface only: give a coarser spacing to save time",
}


class Surface:
    """The surface of a fluid, or of any group of particles, as a closed mesh of triangles.

    By the library splashsurf. Marching cubes follow a level of the particles' colour field

        phi(r) = sum_j V_j W(|r - x_j|),   1 / V_j = sum_k W(|x_j - x_k|)

    with the cubic spline W of support 2 h, in which particles count alike whatever their mass.
    Then steps of Laplacian smoothing, which spare single drops, take away bumps of the size of a
    particle (Löschner, Böttcher, Jeske and Bender 2023, "Weighted Laplacian smoothing for surface
    reconstruction of particle-based fluids"). What is thinner than ``spacing`` may be lost. A
    periodic box counts as open: the surface closes at its sides.

    Args:
        sim: The simulation; each :meth:`mesh` is of its present state.
        group: Whose surface: a Group or its name, several, or indices in the scene; None: the
            fluids of the world's SPH, or all particles where there is none.
        world: Of which world.
        spacing: Of the grid [length], at least h / 100; None: h / 2.6, half a particle spacing of
            water. The grid lies fixed in space, and only where particles are.
        threshold: The level of phi, above 0; None: that which puts a flat face where the fluid
            ends, half a particle spacing above the outermost layer (on a cubic lattice at
            h = 1.3 spacings).
        smoothing_length: h [length]; None: that of the group's SPH, at most 1.3 spacings of its
            particles at rest; else 2.6 mean radii.
        smooth: How much the mesh is smoothed, 0 (not at all) to 1 (10 steps); more takes off more
            of what bulges out: at 0.5, 1/20 of a spacing of a ball of 10 spacings.
        **gone: What is not there any more is refused: ``anisotropic`` (there are no kernels of Yu
            and Turk), ``method`` and ``node_limit``.

    Raises:
        ValueError: A value out of range, a group or world that is not there, particles of no size.
        ImportError: pysplashsurf is not installed.

    Example:
        >>> from particlesim import Scene, Simulation, sample
        >>> scene = Scene()
        >>> ball = scene.add_particles(sample.sphere((0, 0, 0), 1.0, 0.1), radius=0.05)
        >>> points, triangles, normals = Surface(Simulation(scene, device="cpu"), ball).mesh()
        >>> a, b, c = points[triangles].swapaxes(0, 1)
        >>> volume = (a * np.cross(b, c)).sum() / 6
        >>> float(abs(volume / (4 / 3 * np.pi) - 1)) < 0.05
        True
    """

    def __init__(
        self,
        sim: Source,
        group: Any = None,
        world: int = 0,
        *,
        spacing: float | None = None,
        threshold: float | None = None,
        smoothing_length: float | None = None,
        smooth: float = 0.5,
        **gone: Any,
    ):
        for name in gone:
            remedy = GONE.get(name, "look at the arguments that there are")
            raise TypeError(f"Surface: {name} must be left out, got {gone[name]!r}; {remedy}.")
        if validate.whole("Surface", "world", world) >= len(sim.scenes):
            raise validate.fail(
                "Surface", "world", f"be from 0 to {len(sim.scenes) - 1}", world,
                "name a world of this simulation",
            )  # fmt: skip
        self.sim, self.world, self.scene = sim, world, sim.scenes[world]
        self.rows = self._rows(group)
        h = self._smoothing_length() if smoothing_length is None else smoothing_length
        self.smoothing_length = h = validate.number(
            "Surface", "smoothing_length", h, above=0.0, unit="length"
        )
        wanted = h / (2 * SPACINGS) if spacing is None else spacing
        self.spacing = validate.number("Surface", "spacing", wanted, above=0.0, unit="length")
        if self.spacing < h / FINEST:
            raise validate.fail(
                "Surface", "spacing", f"be at least {h / FINEST:g} [length]", spacing,
                f"at most {FINEST} nodes fit into a smoothing length",
            )  # fmt: skip
        level = validate.number(
            "Surface", "threshold", LEVEL if threshold is None else threshold, above=0.0
        )
        smooth = validate.number("Surface", "smooth", smooth, minimum=0.0, maximum=1.0)
        # A step smooths over the length of an edge, and so many over its square.
        steps = MESH_STEPS * (h / (2 * SPACINGS) / self.spacing) ** 2
        self._reconstruct = _splashsurf()
        # Lengths in radii; a particle's volume is not taken from its radius, but from the others.
        self._options = {
            "particle_radius": h, "smoothing_length": 1.0, "cube_size": self.spacing / h,
            "iso_surface_threshold": level,
            # Blocks of cubes are put together in an order of their own, of which sums are free.
            "subdomain_grid": True, "subdomain_grid_auto_disable": False,
            "mesh_smoothing_iters": round(smooth * steps) or None,
            "compute_normals": True,
            "normals_smoothing_iters": NORMAL_STEPS if smooth else None,
        }  # fmt: skip

    def mesh(self) -> Mesh:
        """The surface as it is now.

        Returns:
            Points (p, 3) float32, triangles (t, 3) int32 whose front is outside, and the normals
            of the points (p, 3) float32. Empty where there are no particles. The same state gives
            the same mesh, bit for bit.

        Raises:
            ValueError: A position is not finite, or particles are too far from each other.
        """
        x = self._get("position").astype(np.float64)
        if not len(x):
            none = np.zeros((0, 3), np.float32)
            return none, none.astype(np.int32), none.copy()
        bad = ~np.isfinite(x).all(axis=1)
        if bad.any():
            first = int(np.argmax(bad))
            raise validate.fail(
                "Surface.mesh", "position", "be finite [length]", x[first],
                f"look at particle {int(self.rows[first])} of world {self.world}",
            )  # fmt: skip
        if np.ptp(x, axis=0).max() > FARTHEST * self.spacing:
            raise validate.fail(
                "Surface.mesh", "spacing",
                f"be at least the fluid's extent over {FARTHEST} [length]", self.spacing,
                "use a coarser spacing, or look for a particle that has flown off",
            )  # fmt: skip
        # Whole steps, so that nodes stay where they are from frame to frame.
        origin = self.spacing * np.floor(x.min(axis=0) / self.spacing)
        made, _ = self._reconstruct(x - origin, **self._options)
        normals = made.point_attributes["normals"]
        return _sorted(made.mesh.vertices + origin, made.mesh.triangles, normals)

    def _rows(self, group: Any) -> np.ndarray:
        """The group's particles as indices in the world's scene."""
        scene = self.scene
        if group is None:
            fluids = self._fluids()
            return np.unique(np.concatenate(fluids)) if fluids else np.arange(scene.particle_count)
        return select(scene, _in_scene(group, scene, self.sim.scenes), "Surface")

    def _fluids(self) -> list[np.ndarray]:
        """Members of each SPH of the world."""
        return [select(self.scene, peer.group, "Surface") for peer in self._sph()]

    def _sph(self) -> list[SPH]:
        return [each.peers[self.world] for each in self.sim.interactions if isinstance(each, SPH)]

    def _smoothing_length(self) -> float:
        """By the fluid which most of the particles belong to, or from their mean radius.

        Wide smoothing functions are for the forces; drawn with them, fluids would have no edges.
        """
        shared = [len(np.intersect1d(self.rows, members)) for members in self._fluids()]
        if max(shared, default=0) > 0:
            sph = self._sph()[int(np.argmax(shared))]
            h, densities = self._length_of(sph), sph.fluids.densities
            if densities is None:
                return h
            shared = [len(np.intersect1d(self.rows, select(self.scene, each, "Surface")))
                      for each in sph.fluids.groups]  # fmt: skip
            volume = float(self.scene.mass[self.rows].mean()) / densities[int(np.argmax(shared))]
            return min(h, SPACINGS * volume ** (1 / sph.dimension))
        radius = self.scene.radius[self.rows]
        if not radius.any():
            if not len(self.rows):
                return 1.0  # there will be no particle to draw
            raise validate.fail(
                "Surface", "smoothing_length", "be given for particles without SPH and radius",
                None, "pass smoothing_length=..., or give the particles a radius",
            )  # fmt: skip
        return 2.0 * SPACINGS * float(radius.mean())

    def _length_of(self, sph: SPH) -> float:
        """That of the fluid; of particles' own the one in the middle."""
        if sph.adaptive is None:
            return float(sph.parameters["smoothing_length"])
        return float(np.median(self._get("smoothing_length")))

    def _get(self, name: str) -> np.ndarray:
        """An array of the state for the group's particles."""
        return self.sim.get(name)[self.sim.model.rows(self.world)][self.rows]


def _in_scene(group: Any, scene: Scene, scenes: Sequence[Scene]) -> Any:
    """The groups of that name in this world's scene; what is no group, as it is."""
    if isinstance(group, list | tuple):
        return [_in_scene(each, scene, scenes) for each in group]
    if isinstance(group, str):
        return scene[group]
    if isinstance(group, Group) and any(group.scene is each for each in scenes):
        return scene[group.name]
    return group


def _splashsurf() -> Any:
    """The library's whole way from particles to a mesh."""
    try:
        from pysplashsurf import reconstruction_pipeline
    except ImportError:
        raise ImportError(
            "Surface: pysplashsurf must be installed, got none; pip install 'particlesim[surface]'."
        ) from None
    return reconstruction_pipeline


def _sorted(points: np.ndarray, triangles: np.ndarray, normals: np.ndarray) -> Mesh:
    """The mesh with points and triangles in order: threads leave them in any."""
    order = np.lexsort(points.T)
    place = np.empty(len(order), np.int32)
    place[order] = np.arange(len(order), dtype=np.int32)
    corners = place[triangles]
    first = corners.argmin(axis=1)[:, None]
    corners = np.take_along_axis(corners, (first + np.arange(3)) % 3, axis=1)
    corners = corners[np.lexsort(corners.T)]
    points, normals = points[order], normals[order]
    bad = ~np.isfinite(normals).all(axis=1)
    if bad.any():  # those of a bubble of one node may cancel: take one of its triangles'
        a, b, c = points[corners].swapaxes(0, 1)
        across = np.zeros_like(normals)
        across[corners] = np.cross(b - a, c - a)[:, None]
        length = np.linalg.norm(across[bad], axis=1, keepdims=True)
        normals[bad] = across[bad] / np.maximum(length, np.finfo(float).tiny)
    return points.astype(np.float32), corners, normals.astype(np.float32)
