"""Surface: a fluid's surface as a mesh of triangles."""

from __future__ import annotations

from typing import Any

import numpy as np

from ... import validate
from ...engine.execution.executors import available_threads
from ...engine.source import Source
from ...interactions.fluid.sph import SPH
from ...scene.group import Group, select
from ...scene.scene import Scene
from .marching import Marching, Shape
from .splashsurf import Splashsurf

Mesh = tuple[np.ndarray, np.ndarray, np.ndarray]
METHODS = ("marching_cubes", "splashsurf")
SPACINGS = 1.3  # particle spacings in a smoothing length, where only the particles' size is known


class Surface:
    """The surface of a fluid, or of any group of particles, as a closed mesh of triangles.

    The particles' volumes are smeared out by kernels, and marching cubes follow the level where
    their sum ends (Yu and Turk 2013, "Reconstructing surfaces of particle-based fluids using
    anisotropic kernels"):

        phi(r) = sum_j V_j det(G_j) W(|G_j (r - c_j)|),   V_j = m_j / rho_j

    with Wendland's C2 function W. Anisotropic kernels are flattened along the surface by G_j, from
    the covariance of the particles within 2 h, and their centres c_j lie ``smooth`` of the way to
    the mean of these: bumps of the size of a particle vanish. Isotropic ones are SPH's own,
    c_j = x_j and G_j = 1 / h. Particles with fewer than six others around them are drops of about
    their own volume. What is thinner than ``spacing`` may be lost. A periodic box counts as open:
    the surface closes at its sides.

    Args:
        sim: The simulation; each :meth:`mesh` is of its present state.
        group: Whose surface: a Group or its name, several, or indices in the scene; None: the
            fluids of the world's SPH, or all particles where there is none.
        world: Of which world.
        spacing: Of the grid [length], above 0; None: h / 2.6, half a particle spacing of water.
            The grid lies fixed in space, and only where particles are.
        threshold: The level of phi, above 0; None: that which puts a flat face where the fluid
            ends, half a particle spacing above the outermost layer (on a cubic lattice at
            h = 1.3 spacings); 0.6 for splashsurf.
        smoothing_length: h [length]; None: that of the group's SPH, else 2.6 mean radii.
        anisotropic: Flatten the kernels; with splashsurf, smooth the mesh.
        smooth: How far centres move to the mean around them, 0 to 1. Faces are smoothest at about
            a half; more rounds edges further.
        method: ``"marching_cubes"``, on the simulation's device; or ``"splashsurf"``, the program
            of that name (``pip install particlesim[surface]``), on the CPU.
        node_limit: Most nodes that the grid may have, about 30 bytes each.

    Raises:
        ValueError: A value out of range, a group or world that is not there, particles of no size.
        ImportError: splashsurf is not installed.

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
        anisotropic: bool = True,
        smooth: float = 0.5,
        method: str = "marching_cubes",
        node_limit: int = 2**26,
    ):
        self.sim, self.world = sim, sim.world(world)
        self.rows = self._rows(group)
        h = self._smoothing_length() if smoothing_length is None else smoothing_length
        self.smoothing_length = validate.number(
            "Surface", "smoothing_length", h, above=0.0, unit="length"
        )
        self.spacing = validate.number(
            "Surface", "spacing", self.smoothing_length / 2.6 if spacing is None else spacing,
            above=0.0, unit="length",
        )  # fmt: skip
        if threshold is not None:
            threshold = validate.number("Surface", "threshold", threshold, above=0.0)
        smooth = validate.number("Surface", "smooth", smooth, minimum=0.0, maximum=1.0)
        limit = validate.whole("Surface", "node_limit", node_limit, minimum=1)
        validate.choice("Surface", "method", method, METHODS)
        self.method: Marching | Splashsurf
        if method == "splashsurf":
            self.method = Splashsurf(
                self.smoothing_length, self.spacing, threshold, smoothed=anisotropic
            )
        else:
            isotropic = Shape.isotropic(threshold)
            shape = Shape.anisotropic(smooth, threshold) if anisotropic else isotropic
            threads = sim.settings.threads or available_threads()
            self.method = Marching(
                self.smoothing_length, self.spacing, shape, limit, sim.model.device, threads
            )

    def mesh(self) -> Mesh:
        """The surface as it is now.

        Returns:
            Points (p, 3) float32, triangles (t, 3) int32 whose front is outside, and the normals
            of the points (p, 3) float32. Empty where there are no particles. The same state gives
            the same mesh, bit for bit; that of splashsurf may come in another order.

        Raises:
            ValueError: A position is not finite, or the grid would have too many nodes.
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
                f"look at particle {int(self.rows[first])} of world {self.world.index}",
            )  # fmt: skip
        return self.method.mesh(x, self._mass())

    def _rows(self, group: Any) -> np.ndarray:
        """The group's particles as indices in the world's scene."""
        scene = self.world.scene
        if group is None:
            fluids = self._fluids()
            return np.unique(np.concatenate(fluids)) if fluids else np.arange(scene.particle_count)
        return select(scene, _in_scene(group, scene, self.sim.scenes), "Surface")

    def _fluids(self) -> list[np.ndarray]:
        """Members of each SPH of the world."""
        return [select(self.world.scene, peer.group, "Surface") for peer in self._sph()]

    def _sph(self) -> list[SPH]:
        index = self.world.index
        return [each.peers[index] for each in self.sim.interactions if isinstance(each, SPH)]

    def _smoothing_length(self) -> float:
        """That of the fluid which most of the particles belong to, or from their mean radius."""
        shared = [len(np.intersect1d(self.rows, members)) for members in self._fluids()]
        if max(shared, default=0) > 0:
            return self._sph()[int(np.argmax(shared))].parameters["smoothing_length"]
        radius = self.world.scene.radius[self.rows]
        if not radius.any():
            if not len(self.rows):
                return 1.0  # there will be no particle to draw
            raise validate.fail(
                "Surface", "smoothing_length", "be given for particles without SPH and radius",
                None, "pass smoothing_length=..., or give the particles a radius",
            )  # fmt: skip
        return 2.0 * SPACINGS * float(radius.mean())

    def _mass(self) -> np.ndarray:
        """Masses over their mean, to stay within float32."""
        known = "mass" in self.sim.state
        mass = self._get("mass") if known else self.world.scene.mass[self.rows]
        return mass.astype(np.float64) / mass.mean()

    def _get(self, name: str) -> np.ndarray:
        """An array of the state for the group's particles."""
        return self.sim.get(name)[self.world.rows][self.rows]


def _in_scene(group: Any, scene: Scene, scenes: list[Scene]) -> Any:
    """The groups of that name in this world's scene; what is no group, as it is."""
    if isinstance(group, list | tuple):
        return [_in_scene(each, scene, scenes) for each in group]
    if isinstance(group, str):
        return scene[group]
    if isinstance(group, Group) and any(group.scene is each for each in scenes):
        return scene[group.name]
    return group
