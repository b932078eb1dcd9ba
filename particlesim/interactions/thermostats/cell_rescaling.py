"""Stochastic cell rescaling: a piston that all particles of a periodic box share."""

from __future__ import annotations

from typing import Any

import numpy as np
import warp as wp

from ... import validate
from ...engine.blocks import blocks
from ...engine.execution.launch import call, launch, when
from ...engine.model import Model
from ...engine.neighbors.lists import Neighbors
from ...engine.state import State
from ...kernels.interactions import barostat as kernels
from ...scene.thermostat import Barostat
from .bath import Bath, ramp
from .velocity_rescaling import BLOCK_CPU, BLOCK_CUDA


class CellRescaling(Bath, Barostat):
    """Scales a periodic box, and all that is in it, so that its volume is isobaric.

    Every so many substeps, in the middle of the drift, the logarithm of the volume goes by

        d eps = -(beta / tau) (P_0 - P) dt + sqrt(2 T beta / (V tau)) dW

    (Bernetti and Bussi 2020, eq. 7), with P = (2 K + sum r.F) / (3 V) as of
    :class:`~particlesim.instruments.diagnostics.Diagnostics`; positions, from the box's lower
    corner on, and its sides are multiplied by exp(d eps / 3), velocities divided. With a thermostat
    of the same T states have the probabilities exp(-(H + P_0 V) / T). The step is Euler's, of
    sqrt(V), whose noise is the same everywhere: volumes then vary by about interval dt / (2 tau) of
    their variance too much, where beta is that of what is in the box. Only how fast a volume
    changes depends on beta and tau.

    In a scene with one all axes are periodic, nothing is pinned, there are no constraints, and all
    interactions follow the box: pairs and tuples by laws do. In a ledger its work is what the
    scaling adds to the kinetic energy.

    Args:
        pressure: P_0 [energy/length^3]. Or a ramp, as of :class:`~particlesim.Langevin`.
        compressibility: beta [length^3/energy], about that of what is in the box, above 0.
        relaxation_time: tau [time], above 0; long against ``interval`` substeps.
        temperature: T as of :class:`~particlesim.Langevin`, k_B T [energy]; None: that of the first
            thermostat of the scene.
        interval: Substeps from one change to the next.
        seed: As of :class:`~particlesim.Langevin`.

    Raises:
        ValueError: Numbers out of range, times that do not rise; when a simulation is made, what
            cannot follow the box. A box that becomes shorter than two cutoffs, or that changes by
            more than a third at once, makes its world's numbers not finite, which the watchdog
            tells.

    Example:
        >>> from particlesim import Scene, Settings, Simulation
        >>> scene = Scene(periodic=((0, 0, 0), (20, 20, 20)))
        >>> gas = scene.add_particles([(1, 1, 1)] * 500)
        >>> piston = CellRescaling(
        ...     pressure=1.0, compressibility=1.0, relaxation_time=1.0, temperature=1.0
        ... )
        >>> piston = scene.add_barostat(piston)  # not even a pressure before it shrinks
        >>> sim = Simulation(scene, Settings(dt=1.0, substeps=100), device="cpu")
        >>> sim.run(2)
        >>> 800 < float(sim.diagnostics().volume[0]) < 2000  # 8000 exp(-2) by P_0 alone
        True
    """

    def __init__(
        self, *, pressure: Any, compressibility: float, relaxation_time: float,
        temperature: Any = None, interval: int = 10, seed: int = 0,
    ):  # fmt: skip
        super().__init__(None, 0.0 if temperature is None else temperature, seed)
        name, self.own_temperature = self.name, temperature is not None
        self.pressure_times, self.pressures = ramp(
            name, "pressure", pressure, "energy/length^3", minimum=None
        )
        self.compressibility = validate.number(
            name, "compressibility", compressibility, above=0.0, unit="length^3/energy"
        )
        self.relaxation_time = validate.number(
            name, "relaxation_time", relaxation_time, above=0.0, unit="time"
        )
        self.interval = validate.whole(name, "interval", interval, minimum=1)

    def kind(self) -> tuple[Any, ...]:
        return (type(self), self.interval)

    @property
    def requires(self) -> frozenset[str]:  # type: ignore[override]
        """Of all worlds: the box too."""
        errors = {"position_error"} if self.model.settings.compensated else set()
        return super().requires | {"position", "world", "box"} | errors

    @property
    def ramps(self) -> list[Any]:
        return [self.bath.temperature, self.piston.pressure]

    def heat(self) -> list[tuple[np.ndarray, np.ndarray]]:
        found = []
        for w, (peer, scene) in enumerate(zip(self.peers, self.model.scenes, strict=True)):
            baths = [each for each in scene.thermostats if isinstance(each, Bath)]
            others = [each for each in baths if not isinstance(each, Barostat)]
            if not (peer.own_temperature or others):
                raise validate.fail(
                    self.name, "temperature", "be given without a thermostat [energy]", None,
                    f"give one, or add a thermostat to scene {w}",
                )  # fmt: skip
            bath = peer if peer.own_temperature else others[0]
            found.append((bath.times, bath.temperatures))
        return found

    def rates(self) -> np.ndarray:
        return np.array([peer.compressibility / peer.relaxation_time for peer in self.peers])

    def prepare(self, model: Model, neighbors: Neighbors) -> None:
        super().prepare(model, neighbors)
        self.neighbors = neighbors
        self._refuse_what_stays(model)
        self.piston = kernels.Piston()
        self.piston.bath, self.piston.interval = self.bath, self.interval
        pressures = [(peer.pressure_times, peer.pressures) for peer in self.peers]
        self.piston.pressure = self.ramp("pressure", pressures)
        worlds, device = model.world_count, model.device
        for name in ("due", "some_due", "fault"):
            rows = 1 if name == "some_due" else worlds
            setattr(self.piston, name, wp.zeros(rows, dtype=wp.int32, device=device))
        self.piston.stretch = wp.zeros(worlds, dtype=wp.vec3d, device=device)
        self.piston.side = wp.zeros(worlds, dtype=wp.float64, device=device)
        size = BLOCK_CPU if device.is_cpu else BLOCK_CUDA
        begin, end, world = blocks(model.offsets, size)
        self.edges = model.array(np.append(begin, end[-1:]), wp.int32)
        self.blocks = model.array(np.searchsorted(world, np.arange(worlds + 1)), wp.int32)
        self.sums = wp.zeros(len(begin), dtype=wp.float64, device=device)
        # Comes with the virial, and is not read.
        self.energy = wp.zeros(model.particle_count, dtype=wp.float64, device=device)
        self.virial = wp.zeros_like(self.energy)
        self.kernel = kernels.follow_kernel(model.precision, model.settings.compensated)

    def _refuse_what_stays(self, model: Model) -> None:
        """What does not follow a box."""
        first = model.scenes[0]
        held = [each.name for each in first.constraints]
        held += [each.name for each in first.interactions if not each.follows_box]
        held += ["pinned particles"] if model.column("pinned").any() else []
        if held:
            raise validate.fail(
                self.name, "scene", "hold what follows a box that changes: pairs and tuples by "
                "laws", ", ".join(held), "leave it out, or the barostat",
            )  # fmt: skip

    def attach(self, model: Model, state: State) -> None:
        super().attach(model, state)
        self.place_error = state.position_error if model.settings.compensated else None
        cutoffs = [np.zeros(model.world_count), *(each.cutoff for each in self.neighbors.verlet)]
        self.shortest = 2.0 * np.max(cutoffs, axis=0)
        self.piston.shortest = model.array(self.shortest, wp.float64)

    def exchange(self, state: State, dt: float) -> None:
        model, piston = self.model, self.piston
        call(piston.some_due.zero_)
        launch(kernels.count_kernel(), model.world_count, [piston], model.device)
        with when(piston.some_due):
            self._scale(state, dt)

    def _scale(self, state: State, dt: float) -> None:
        model, piston, device = self.model, self.piston, self.model.device
        self.neighbors.update(state, piston.due)
        call(self.virial.zero_)
        for interaction in self.interactions:
            interaction.measure(state, self.energy, self.virial)
        inputs = [self.edges, state.inverse_mass, state.velocity, self.virial, self.sums]
        launch(kernels.work_kernel(model.precision), len(self.sums), inputs, device)
        inputs = [self.interval * dt, self.time, piston, self.blocks, self.sums, model.box]
        launch(kernels.stretch_kernel(model.precision), model.world_count, inputs, device)
        inputs = [
            state.world, piston, model.box, state.position, self.place_error, state.velocity,
            self.error,
        ]  # fmt: skip
        launch(self.kernel, model.particle_count, inputs, device)

    def fault(self, world: int) -> str:
        """Why it has given up a world."""
        side = self.piston.side.numpy()[world]
        return {
            kernels.FINE: "",
            kernels.WILD: f"{self.name}: the box must change by less than a third at once; use "
            "fewer substeps of an interval or a longer relaxation_time",
            kernels.NARROW: f"{self.name}: the box must stay longer than two cutoffs, "
            f"{self.shortest[world]:g}, got {side:g}; use more particles or a lower pressure",
        }[int(self.piston.fault.numpy()[world])]
