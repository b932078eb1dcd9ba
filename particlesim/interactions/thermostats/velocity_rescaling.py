"""Velocity rescaling: a bath that all particles share, by one factor."""

from __future__ import annotations

from typing import Any

import numpy as np
import warp as wp

from ... import validate
from ...engine.blocks import blocks
from ...engine.execution.launch import launch
from ...engine.model import Model
from ...engine.neighbors.lists import Neighbors
from ...engine.state import State
from ...kernels.interactions import thermostat as kernels
from .bath import Bath

BLOCK_CPU, BLOCK_CUDA = 256, 16  # members that a thread sums


class VelocityRescaling(Bath):
    """Scales the velocities of a group so that its kinetic energy is canonical.

    In the middle of every drift, by the exact solution over dt of

        dK = (K_0 - K) dt / tau + 2 sqrt(K K_0 / (N_f tau)) dW,   K_0 = N_f T / 2

    (Bussi, Donadio and Parrinello 2007, eq. 7 and A7). The direction of motion is kept, so that
    paths and diffusion are hardly disturbed, and a total momentum of 0 stays 0. Where nothing moves
    there is nothing to scale. Pinned particles are left out, and methods of which stages go back in
    time do not take it.

    Args:
        group: Which particles, as one; None: all.
        temperature: As of :class:`Langevin`, k_B T [energy].
        relaxation_time: tau [time], above 0.
        degrees_of_freedom: N_f; None: 3 for each particle. Give 3 n - 3 where the momentum is 0 and
            stays so, as in a periodic box, and one less for each constraint that always holds.
        seed: As of :class:`Langevin`.

    Raises:
        ValueError: Numbers out of range, times that do not rise.

    Example:
        >>> from particlesim import Scene, Settings, Simulation
        >>> scene = Scene()
        >>> gas = scene.add_particles([(0, 0, 0)] * 500, velocity=(1, 0, 0))
        >>> bath = VelocityRescaling(gas, temperature=2.0, relaxation_time=0.1)
        >>> bath = scene.add_thermostat(bath)
        >>> sim = Simulation(scene, Settings(dt=10.0), device="cpu")
        >>> sim.step()
        >>> abs(float(sim.diagnostics().kinetic[0]) / 1500 - 1) < 0.15  # 4 of sqrt(2 / 1500)
        True
    """

    def __init__(
        self, group: Any = None, *, temperature: Any, relaxation_time: float,
        degrees_of_freedom: int | None = None, seed: int = 0,
    ):  # fmt: skip
        super().__init__(group, temperature, seed)
        self.relaxation_time = validate.number(
            self.name, "relaxation_time", relaxation_time, above=0.0, unit="time"
        )
        self.degrees_of_freedom = degrees_of_freedom
        if degrees_of_freedom is not None:
            self.degrees_of_freedom = validate.whole(
                self.name, "degrees_of_freedom", degrees_of_freedom, minimum=1
            )

    def rates(self) -> np.ndarray:
        return np.array([1.0 / peer.relaxation_time for peer in self.peers])

    def prepare(self, model: Model, neighbors: Neighbors) -> None:
        super().prepare(model, neighbors)
        counts = np.bincount(self.world_host, minlength=model.world_count)
        given = [peer.degrees_of_freedom for peer in self.peers]
        degrees = [3 * n if own is None else own for n, own in zip(counts, given, strict=True)]
        offsets = np.concatenate([[0], np.cumsum(counts)])
        size = BLOCK_CPU if model.device.is_cpu else BLOCK_CUDA
        begin, end, world = blocks(offsets, size)
        of_world = np.searchsorted(world, np.arange(model.world_count + 1))
        self.edges = model.array(np.append(begin, end[-1:]), wp.int32)
        self.blocks = model.array(of_world, wp.int32)
        self.degrees = model.array(np.array(degrees), wp.int32)
        self.sums = wp.zeros(len(begin), dtype=wp.float64, device=model.device)
        self.kernel = kernels.rescaling_kernel(model.precision, model.settings.compensated)

    def exchange(self, state: State, dt: float) -> None:
        model, moving = self.model, (state.inverse_mass, state.velocity)
        kernel = kernels.rescaling_sum_kernel(model.precision)
        inputs = [self.members, self.edges, *moving, self.sums]
        launch(kernel, len(self.sums), inputs, model.device)
        inputs = [dt, self.time, self.bath, self.blocks, self.degrees, self.sums]
        launch(kernels.rescaling_begin_kernel(), model.world_count, inputs, model.device)
        inputs = [self.members, self.world, self.bath, *moving, self.error]
        launch(self.kernel, self.count, inputs, model.device)
