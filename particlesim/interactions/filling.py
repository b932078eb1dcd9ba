"""Fluids from a call: particles, masses, sound and viscosity that fit each other."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from .. import validate
from ..scene import sample
from ..scene.scene import Scene
from .fluid.density.continuity import START, ContinuityDensity
from .fluid.equations_of_state import Tait
from .fluid.smoothing import SmoothingFunction
from .fluid.sph import SPH
from .fluid.starts import STIFF, gravity
from .fluid.viscosities import ArtificialViscosity, Viscosity

OWNER = "Scene.add_fluid"
REACH = 1.3  # h in spacings
VISCOSITY = ArtificialViscosity(0.05)


def fill(
    scene: Scene, shape: Any, spacing: float, rest_density: float, speed: float | None,
    hydrostatic: bool, velocity: Any, smoothing_length: float | None,
    smoothing: str | SmoothingFunction, viscosity: Viscosity | Sequence[Viscosity] | None,
    density: ContinuityDensity | None, dimension: int, group: str | None,
    color: Sequence[float] | None,
) -> SPH:  # fmt: skip
    """See :meth:`particlesim.Scene.add_fluid`."""
    s = validate.number(OWNER, "spacing", spacing, above=0.0, unit="length")
    rho_0 = validate.number(OWNER, "rest_density", rest_density, above=0.0, unit="mass/length^d")
    x = _points(shape, s)
    g = gravity(scene)
    pull = float(np.linalg.norm(g))
    # A particle stands for a cell about it: the surface is half a spacing above the highest.
    height = -(x @ g) / pull if pull > 0 else np.zeros(len(x))
    depth = height.max(initial=-np.inf) + 0.5 * s - height
    if speed is None:
        if pull == 0.0:
            raise validate.fail(
                OWNER, "speed", "be given [length/time] in a scene without gravity", None,
                "give the largest that is expected, or add a UniformGravity before the fluid",
            )  # fmt: skip
        speed = float(np.sqrt(2.0 * pull * (depth.max(initial=0.0) + 0.5 * s)))
    c = STIFF * validate.number(OWNER, "speed", speed, above=0.0, unit="length/time")
    law = Tait(sound_speed=c)
    # Made first: what it refuses leaves no particles behind.
    options: dict[str, Any] = {
        "smoothing_length": REACH * s if smoothing_length is None else smoothing_length,
        "rest_density": rho_0, "equation_of_state": law, "smoothing": smoothing,
        "viscosity": viscosity, "density": density, "dimension": dimension,
    }  # fmt: skip
    SPH(**options)
    rho, start = np.full(len(x), rho_0), dict[str, np.ndarray]()
    if hydrostatic:
        if pull == 0.0:
            raise validate.fail(
                OWNER, "hydrostatic", "be False in a scene without gravity", hydrostatic,
                "add a UniformGravity before the fluid",
            )  # fmt: skip
        rho *= compression(law, pull * depth)
        if density is not None:
            start[START] = rho
    particles = scene.add_particles(
        x, velocity=velocity, mass=rho * s**dimension, radius=0.5 * s, group=group, color=color,
        **start,
    )  # fmt: skip
    fluid = SPH(particles, **options)
    scene.add_interaction(fluid)
    return fluid


def compression(law: Tait, energy: Any) -> Any:
    """rho / rho0 at rest, where what is above weighs g z = int dP / rho.

    That is c^2 / (gamma - 1) ((rho / rho0)^(gamma - 1) - 1) for Tait's law.

    Args:
        law: With c and gamma.
        energy: g z [length^2/time^2].
    """
    c, power = law.parameters["sound_speed"], law.parameters["exponent"] - 1.0
    return (1.0 + power * energy / c**2) ** (1.0 / power)


def _points(shape: Any, spacing: float) -> np.ndarray:
    """The points given, or those that fill the box of two corners."""
    x = validate.rows(OWNER, "shape", shape, None, 3)
    return sample.box(x[0], x[1], spacing) if len(x) == 2 else x
