"""What some viscosities take beside the pair force: passes of their own over a fluid's pairs."""

from __future__ import annotations

import functools
from typing import Any

import warp as wp

from ... import validate
from ...engine.execution.launch import launch
from ...engine.integrators.integrator import motion_of
from ...engine.state import State
from ...kernels.engine.motion_kernels import go_on_kernel
from ...kernels.interactions.fluid import viscosity as kernels
from .viscosities import ParticleShifting, Viscosity


class Switch:
    """Balsara's factor of every particle, in the slots of the fluid."""

    def __init__(self, fluid: Any) -> None:
        self.fluid = fluid
        self.values = fluid.pairs.array(fluid.model.precision.scalar)

    @functools.cached_property
    def term(self) -> Any:
        precision, loop = self.fluid.model.precision, self.fluid.loop
        slope = self.fluid.smoothing.slope.function(precision)
        return kernels.turning_term(slope, *loop.types)

    def sum(self) -> None:
        """From the velocities, densities and sound speeds of now."""
        self.fluid.loop.sum(self.term, kernels.keep_switch, {"balsara": self.values})


class Drift:
    """By how much the velocity that particles move with differs from their own."""

    def __init__(self, fluid: Any, state: State, part: Viscosity) -> None:
        self.fluid, self.part, model = fluid, part, fluid.model
        if isinstance(part, ParticleShifting) and sum(model.periodic) < fluid.dimension:
            raise validate.fail(
                part.name, "scene", "be periodic along every axis of the fluid, which fills it",
                tuple(model.periodic), "leave it out: it spreads surfaces",
            )  # fmt: skip
        self.drift = wp.zeros_like(state.velocity)
        self.inverse_mass = state.inverse_mass
        self.motion = motion_of(model, state)
        self.motion.v = self.drift
        self.kernel = go_on_kernel(
            model.precision, model.periodic, model.settings.compensated,
            "previous_position" in state,
        )  # fmt: skip

    @functools.cached_property
    def term(self) -> Any:
        fluid, precision, loop = self.fluid, self.fluid.model.precision, self.fluid.loop
        slope = fluid.smoothing.slope.function(precision)
        make = getattr(kernels, f"{self.part.drifts}_term")
        return make(fluid.weight, slope, *loop.types)

    def sum(self) -> None:
        """From the velocities and densities of now."""
        store = getattr(kernels, f"keep_{self.part.drifts}")
        self.fluid.loop.sum(self.term, store, {"w": self.inverse_mass, "drift": self.drift})

    def move(self, dt: float) -> None:
        """x += drift dt, into the periodic box."""
        launch(self.kernel, len(self.drift), [dt, self.motion], self.fluid.model.device)
