"""Fixtures of the tests of the renderer."""

import pytest

from particlesim.output import colors
from particlesim.pictures.render.renderer import Renderer

from .shapes import CAMERA, HEIGHT, MASK, WIDTH


@pytest.fixture(scope="module")
def renderer():
    return Renderer("cpu")


@pytest.fixture
def draw(renderer):
    def picture(geometry, look=MASK, camera=CAMERA, width=WIDTH, height=HEIGHT):
        return renderer.draw(geometry, camera, width, height, look)

    return picture


@pytest.fixture
def cover(draw):
    """How much of each pixel is covered by white shapes, (height, width)."""

    def measure(geometry, **options):
        return colors.decoded(draw(geometry, **options).array[:, :, 0] / 255.0)

    return measure
