"""Surfaces by splashsurf, where its Python package is installed."""

from __future__ import annotations

from typing import Any

import numpy as np

THRESHOLD = 0.6  # splashsurf's own
MESH_STEPS, NORMAL_STEPS = 25, 10  # of smoothing; what its authors advise


class Splashsurf:
    """The surface by the program splashsurf (Löschner, Böttcher, Jeske and Bender 2023).

    Args:
        smoothing_length: h [length].
        spacing: Of the grid [length].
        threshold: Level of the colour field; None: splashsurf's own.
        smoothed: Smooth the mesh by weighted Laplacian steps.

    Raises:
        ImportError: It is not installed.
    """

    def __init__(
        self, smoothing_length: float, spacing: float, threshold: float | None, smoothed: bool
    ):
        try:
            import pysplashsurf
        except ModuleNotFoundError:
            raise ImportError(
                "Surface: method must be one that is installed, got 'splashsurf'; "
                "pip install 'particlesim[surface]'."
            ) from None
        self.library: Any = pysplashsurf
        # Lengths in radii, of which splashsurf takes a particle's spacing to be two.
        self.radius = smoothing_length / 2.6
        self.options: dict[str, Any] = {
            "particle_radius": self.radius,
            "smoothing_length": 2.6,
            "cube_size": spacing / self.radius,
            "iso_surface_threshold": THRESHOLD if threshold is None else threshold,
            "mesh_smoothing_iters": MESH_STEPS if smoothed else None,
            "mesh_smoothing_weights": smoothed,
            "mesh_cleanup": smoothed,
            "compute_normals": True,
            "normals_smoothing_iters": NORMAL_STEPS if smoothed else None,
        }

    def mesh(self, x: np.ndarray, mass: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Points, triangles and normals; splashsurf takes all particles to be of one mass."""
        origin = x.mean(axis=0)
        made, _ = self.library.reconstruction_pipeline(x - origin, **self.options)
        points = (made.mesh.vertices + origin).astype(np.float32)
        normals = np.asarray(made.point_attributes["normals"]).astype(np.float32)
        return points, made.mesh.triangles.astype(np.int32), normals
