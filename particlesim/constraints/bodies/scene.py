"""The scene that people write: particles and parts one by one, or whole bodies by a call."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ...interactions.filling import VISCOSITY, fill
from ...interactions.fluid.density.continuity import ContinuityDensity
from ...interactions.fluid.smoothing import SmoothingFunction
from ...interactions.fluid.sph import SPH
from ...interactions.fluid.viscosities import Viscosity
from ...scene import scene
from .cloth import add_cloth
from .rigid import add_rigid_body
from .rope import add_rope
from .soft import add_soft_body


class Scene(scene.Scene):
    __doc__ = scene.Scene.__doc__

    add_rope = add_rope
    add_cloth = add_cloth
    add_rigid_body = add_rigid_body
    add_soft_body = add_soft_body

    def add_fluid(
        self,
        shape: Any,
        *,
        spacing: float,
        rest_density: float = 1000.0,
        speed: float | None = None,
        hydrostatic: bool = False,
        velocity: Any = 0.0,
        smoothing_length: float | None = None,
        smoothing: str | SmoothingFunction = "wendland_c2",
        viscosity: Viscosity | Sequence[Viscosity] | None = VISCOSITY,
        density: ContinuityDensity | None = None,
        dimension: int = 3,
        group: str | None = None,
        color: Sequence[float] | None = None,
    ) -> SPH:
        """Add a liquid that rests at its rest density: particles and the :class:`SPH` of them.

        Particles weigh rho0 s^d and have half a spacing s for their radius, by which boundaries
        hold them. The liquid is a :class:`Tait` whose sound is ten times as fast as the fluid,
        for which it is compressed by about a percent (Monaghan 1994).

        Args:
            shape: Points of a lattice of that spacing, (n, 3) [length], as of ``sample.box`` or
                ``sample.sphere``; or two corners of a box, (2, 3), which is filled.
            spacing: s, distance of neighbouring particles [length].
            rest_density: rho0 [mass/length^d].
            speed: The largest that is expected [length/time]. None: that of a fall from the surface
                to the bottom, sqrt(2 g H) by the gravity of by then; what is thrown is faster.
            hydrostatic: Start under the pressure of the weight above, up to the highest particle:
                masses are of the density there; all weigh g H / (2 c^2), a quarter of 1 %, more.
            velocity: (3,) for all, or (n, 3) [length/time].
            smoothing_length: h [length]. None: 1.3 spacings.
            smoothing: As of :class:`SPH`.
            viscosity: As of :class:`SPH`.
            density: As of :class:`SPH`; by continuity a hydrostatic start has its densities too.
            dimension: d, as of :class:`SPH`; a flat box has one layer.
            group: As of ``add_particles``.
            color: As of ``add_particles``.

        Returns:
            The interaction, whose ``group`` the particles are.

        Raises:
            ValueError: Neither speed nor gravity, and what ``add_particles`` and ``SPH`` refuse.

        Example:
            >>> from particlesim import BoxBoundary, Scene, UniformGravity
            >>> scene = Scene()
            >>> gravity = scene.add_interaction(UniformGravity((0, -9.81, 0)))
            >>> fluid = scene.add_fluid([(0, 0, 0), (1, 1, 1)], spacing=0.1, hydrostatic=True)
            >>> tank = scene.add_constraint(BoxBoundary((0, 0, 0), (1, 2, 1)))
            >>> len(fluid.group), f"{scene.mass.sum():.1f} kg"
            (1000, '1002.5 kg')
        """
        return fill(
            self, shape, spacing, rest_density, speed, hydrostatic, velocity, smoothing_length,
            smoothing, viscosity, density, dimension, group, color,
        )  # fmt: skip
