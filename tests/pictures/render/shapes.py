"""What the tests of the renderer share: a camera, looks and shapes."""

import numpy as np

import particlesim as ps
from particlesim.pictures.render.geometry import Geometry
from particlesim.pictures.render.look import Look

WIDTH, HEIGHT = 320, 240
CAMERA = ps.Camera((0, 0, 10), (0, 0, 0), field_of_view=40.0)
FOCUS = 0.5 * HEIGHT / np.tan(np.radians(20.0))  # pixels at distance 1
WHITE = (1.0, 1.0, 1.0)
MASK = Look(flat=True, background=(0, 0, 0))
PLAIN = {"gloss": 0.0, "shadows": False, "occlusion": False, "supersample": 1}


def shapes(**kinds):
    geometry = Geometry()
    for kind, arguments in kinds.items():
        getattr(geometry, f"add_{kind}")(*arguments)
    return geometry


def spheres(position, radius, color=WHITE):
    return shapes(spheres=(np.atleast_2d(position), radius, color))
