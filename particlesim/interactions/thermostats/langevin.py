"""Langevin's thermostat: friction, and the noise that makes up for it."""

from __future__ import annotations

from typing import Any

import numpy as np
import warp as wp

from ... import validate
from ...engine.execution.launch import launch
from ...engine.model import Model
from ...engine.neighbors.lists import Neighbors
from ...engine.state import State
from ...kernels.interactions import thermostat as kernels
from .bath import Bath


class Langevin(Bath):
    """m dv = f dt - m gamma v dt + sqrt(2 m gamma T) dW: a bath that every particle is in.

    It acts in the middle of every drift, exactly: v -> c v + sqrt((1 - c^2) T / m) xi with
    c = exp(-gamma dt). With velocity Verlet that makes the method BAOAB (Leimkuhler and Matthews
    2013), with symplectic Euler the same with whole kicks (Zhang et al. 2019, "leapfrog middle"):
    both sample the positions of a harmonic oscillator exactly at any stable step, and those of
    other forces with small errors of second order. Velocities are those of the end of a substep:
    with velocity Verlet their temperature is low by (omega dt)^2 / 4 of it, with symplectic Euler,
    where they are half a step behind, by nothing.

    Constraints project what it has moved, so that what they hold has no temperature. Pinned
    particles are left out. The momentum is not conserved. Methods of which stages go back in time
    do not take it.

    Args:
        group: Which particles; None: all.
        temperature: k_B T [energy], at least 0: Boltzmann's constant is 1. Or a ramp, (times,
            temperatures), between which it changes in proportion and beyond which it stays. Worlds
            of a batch have those of their scenes.
        friction: gamma [1/time], at least 0.
        seed: Of the noise, from 0 to 2^64 - 1. Scenes of one seed have the same noise, copies of
            a scene too: build each world with a seed of its own.

    Raises:
        ValueError: Numbers out of range, times that do not rise.

    Example:
        >>> from particlesim import Scene, Settings, Simulation
        >>> scene = Scene()
        >>> gas = scene.add_particles([(0, 0, 0)] * 3000, mass=2.0)
        >>> bath = scene.add_thermostat(Langevin(gas, temperature=1.5, friction=1.0))
        >>> sim = Simulation(scene, Settings(dt=10.0), device="cpu")
        >>> sim.step()
        >>> kinetic = float(sim.diagnostics().kinetic[0])
        >>> abs(kinetic / (1.5 * 3000 * 1.5) - 1) < 0.06  # 4 standard deviations, sqrt(2 / 9000)
        True
    """

    def __init__(self, group: Any = None, *, temperature: Any, friction: float, seed: int = 0):
        super().__init__(group, temperature, seed)
        self.friction = validate.number(self.name, "friction", friction, minimum=0.0, unit="1/time")

    def rates(self) -> np.ndarray:
        return np.array([peer.friction for peer in self.peers])

    def prepare(self, model: Model, neighbors: Neighbors) -> None:
        super().prepare(model, neighbors)
        self.number = model.array(self.members_host - model.offsets[self.world_host], wp.int32)
        self.kernel = kernels.langevin_kernel(model.precision, model.settings.compensated)

    def exchange(self, state: State, dt: float) -> None:
        model = self.model
        begin = kernels.langevin_begin_kernel()
        launch(begin, model.world_count, [dt, self.time, self.bath], model.device)
        inputs = [
            self.members, self.number, self.world, self.bath, state.inverse_mass, state.velocity,
            self.error,
        ]  # fmt: skip
        launch(self.kernel, self.count, inputs, model.device)
