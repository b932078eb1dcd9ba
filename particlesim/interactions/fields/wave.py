"""A damped wave on a grid."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import warp as wp

from ... import validate
from ...engine.execution.launch import launch
from ...engine.limit import Limit
from ...engine.model import Model
from ...kernels.interactions.grid import wave_kernels
from .grid import Coupling, Field

EDGES = ("free", "held")


class GridField(Field):
    """A wave on a regular grid: u_tt = c^2 lap u - gamma u_t - s / rho.

    s is what particles put on it, by volume. With them it has the energy

        H = sum over nodes of rho V / 2 (u_t^2 + c^2 |grad u|^2) + sum_i q_i u(x_i)

    where V is the volume of a node, and so particles excite what they ride on: waves reflect at
    free edges, and change sign at held ones. What is outside of it feels nothing. It goes by
    symplectic Euler with the particles, of first order.

    Args:
        lower, upper, spacing: As of :class:`Field`.
        speed: c [length/time], above 0.
        density: rho, mass by volume, of what moves by u, above 0.
        damping: gamma [1/time], at least 0.
        edges: ``"free"`` or ``"held"`` at 0, along open axes.
        start: u at the start: None for 0, or a function of places (n, 3) that returns (n,).

    Example:
        >>> pond = GridField((0, None, 0), (4, None, 3), spacing=0.1, speed=1.5, density=2.0)
        >>> pond.nodes((False, False, False)).tolist()
        [41, 1, 31]
    """

    def __init__(
        self,
        lower: Any,
        upper: Any,
        spacing: float,
        *,
        speed: float,
        density: float = 1.0,
        damping: float = 0.0,
        edges: str = "free",
        start: Callable[[np.ndarray], Any] | None = None,
    ):
        super().__init__(lower, upper, spacing)
        name = type(self).__name__
        self.speed = validate.number(name, "speed", speed, above=0.0, unit="length/time")
        self.density = validate.number(name, "density", density, above=0.0)
        self.damping = validate.number(name, "damping", damping, minimum=0.0, unit="1/time")
        self.edges = validate.choice(name, "edges", edges, EDGES)
        self.start = start
        self.conservative = self.damping == 0.0

    def columns(self) -> dict[str, float]:
        return {
            "speed_squared": self.speed**2, "damping": self.damping, "mass": self.density,
            "held": self.edges == "held",
        }  # fmt: skip

    def live(self, coupling: Coupling) -> LiveWave:
        """What moves in a simulation."""
        return LiveWave(coupling)

    def values(self, places: np.ndarray) -> np.ndarray:
        """u at the start."""
        if self.start is None:
            return np.zeros(len(places))
        found = np.asarray(self.start(places), dtype=np.float64)
        return validate.rows(type(self).__name__, "start", found, len(places), None)


class LiveWave:
    """The waves of all worlds.

    Args:
        coupling: With the grids.
    """

    part = 1.0  # of q u that is energy

    def __init__(self, coupling: Coupling):
        self.coupling = coupling
        self.u, self.rate = coupling.zeros(), coupling.zeros()
        self.shares = coupling.shares()
        self.own = wp.zeros_like(self.shares)
        self.reset(range(coupling.model.world_count))

    @property
    def model(self) -> Model:
        """Of the simulation."""
        return self.coupling.model

    def reset(self, worlds: Any) -> None:
        """Back to the start."""
        u, rate = self.u.numpy().copy(), self.rate.numpy().copy()
        coupling = self.coupling
        for w in worlds:
            rows = slice(int(coupling.first[w]), int(coupling.first[w + 1]))
            n = np.moveaxis(np.indices(coupling.nodes[w]), 0, -1).reshape(-1, 3)
            places = coupling.columns["lower"][w] + n * coupling.steps[w]
            field = coupling.fields[w]
            assert isinstance(field, GridField)
            u[rows], rate[rows] = field.values(places), 0.0
        self.u.assign(u)
        self.rate.assign(rate)

    def settle(self) -> None:
        """After particles have put on it: nothing until it goes on."""

    def advance(self, dt: float) -> None:
        """Go on by ``dt``."""
        coupling, device = self.coupling, self.model.device
        kernels = wave_kernels(self.model.precision)
        inputs = [coupling.node_world, coupling.grids, coupling.sums, self.u, dt, self.rate]
        launch(kernels.hasten, coupling.rows, inputs, device)
        launch(kernels.go_on, coupling.rows, [dt, self.rate, self.u], device)

    def energy(self) -> wp.array:
        """Of the fields by themselves, by world, a particle's share."""
        kernels, worlds = wave_kernels(self.model.precision), self.model.world_count
        inputs = [self.coupling.grids, self.u, self.rate, self.shares, self.own]
        launch(kernels.energy, worlds, inputs, self.model.device)
        return self.own

    def persistent(self) -> dict[str, wp.array]:
        """What outlives a substep."""
        return {"value": self.u, "rate": self.rate}

    def limits(self, part: str) -> list[Limit]:
        """By its shortest wave."""
        return self.coupling.limit(np.sqrt(self.coupling.columns["speed_squared"]), part)
