"""Look: what a picture is made of besides the shapes: light, ground, background, quality."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ... import validate

SUPERSAMPLES = (1, 2, 4)
# Directions as (right, up, towards the camera, level); colours linear.
KEY_FROM = (-0.6, 1.2, 0.8)
KEY = (0.68, 0.66, 0.62)
SKY = (0.46, 0.49, 0.54)
BOUNCE = (0.20, 0.19, 0.18)
GLOSS = 0.12
BACKGROUND = (0.83, 0.86, 0.90)
GROUND = (0.80, 0.80, 0.80)


@dataclass(frozen=True, eq=False)
class Look:
    """How shapes are shown.

    Args:
        up: Where the sky is, (3,).
        background: Colour behind everything, linear (r, g, b) in 0..1.
        ground: Height along ``up`` of a ground that catches shadows [length]; None: no ground.
        shadows: Of the key light, by a shadow map.
        occlusion: Darken what is closed in by its surroundings.
        flat: Colours as they are, without any light.
        gloss: Strength of highlights.
        supersample: Samples along each side of a pixel: 1, 2 or 4.

    Raises:
        ValueError: A value out of range.

    Example:
        >>> Look(ground=0.0, supersample=1).shadows
        True
    """

    up: Any = (0.0, 1.0, 0.0)
    background: Any = BACKGROUND
    ground: float | None = None
    shadows: bool = True
    occlusion: bool = True
    flat: bool = False
    gloss: float = GLOSS
    supersample: int = 2

    def __post_init__(self) -> None:
        owner = "Look"
        up = validate.vector(owner, "up", self.up)
        if not up.any():
            raise validate.fail(owner, "up", "have a length", self.up, "give a direction")
        object.__setattr__(self, "up", up / np.linalg.norm(up))
        color = validate.vector(owner, "background", self.background)
        if color.min() < 0 or color.max() > 1:
            raise validate.fail(
                owner, "background", "be in 0..1", self.background, "give (r, g, b)"
            )
        object.__setattr__(self, "background", color)
        if self.ground is not None:
            validate.number(owner, "ground", self.ground, unit="length")
        validate.number(owner, "gloss", self.gloss, minimum=0)
        if self.supersample not in SUPERSAMPLES:
            raise validate.fail(
                owner, "supersample", "be 1, 2 or 4", self.supersample, "choose one of these"
            )

    def key_direction(self, axes: np.ndarray) -> np.ndarray:
        """To the key light, (3,) of length 1: it stands above the camera, to the left.

        Args:
            axes: Right, up and back of the camera, (3, 3).
        """
        level = axes[2] - self.up * np.dot(self.up, axes[2])
        if np.linalg.norm(level) < 1e-6:  # straight down or up
            level = axes[1] * -np.sign(np.dot(self.up, axes[2]))
        level /= np.linalg.norm(level)
        frame = np.array([np.cross(self.up, level), self.up, level])
        direction = np.array(KEY_FROM) @ frame
        return direction / np.linalg.norm(direction)
