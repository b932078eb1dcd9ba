"""Points and velocities to start from: fillings of shapes, lattices, random points, meshes.

Every function returns float64 rows of three, on the host, and the same ones for the same
arguments: randomness comes from a ``seed``. A length is in the scene's own unit.

Fillings put one point into the middle of each cell of a cubic grid, so that a point stands for
``spacing**3`` of volume and a particle of it weighs ``density * spacing**3``. Their ``jitter``
moves each point along each axis by up to that fraction of the spacing, at most 0.5; the result
stays inside the shape.

Bad arguments (not finite, not of the shape given, lengths that are not positive, jitter out of
range, negative counts) are a ``ValueError``; a function's docstring names only its own others.
"""

from .arrange import links, rotate
from .curves import curve
from .distributions import maxwell_boltzmann, random, stretch, uniform_sphere
from .enclosed import inside
from .files import mesh
from .filling import mesh_points, mesh_tetrahedra
from .meshes import edges, icosphere, rectangle
from .plummer import plummer, plummer_velocity
from .shapes import box, cylinder, lattice, sphere
from .solids import box_tetrahedra, surface

__all__ = [
    "box",
    "box_tetrahedra",
    "curve",
    "cylinder",
    "edges",
    "icosphere",
    "inside",
    "lattice",
    "links",
    "maxwell_boltzmann",
    "mesh",
    "mesh_points",
    "mesh_tetrahedra",
    "plummer",
    "plummer_velocity",
    "random",
    "rectangle",
    "rotate",
    "sphere",
    "stretch",
    "surface",
    "uniform_sphere",
]
