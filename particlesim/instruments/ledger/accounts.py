r"""Accounts: the work and impulse of every part, summed on the device substep by substep.

A particle's velocity goes from v0 to v within a substep, and the parts share the difference:
m (v - v0) = sum_k J_k exactly, whatever the integrator, where part k's impulse J_k is

    symplectic Euler    an interaction: f_k dt; a constraint: m c_k / dt, with c_k what it moved the
                        particle by, and m times what it added to the velocity afterwards
    velocity Verlet     f_k dt / 2 at the start and f_k dt / 2 at the end, of every stage
    either              a thermostat: m times what it added to the velocity

Its work is W_k = J_k . (v0 + v) / 2. So the works add up to the change of the kinetic energy,

    sum_k W_k = m (v - v0) . (v + v0) / 2 = m (v^2 - v0^2) / 2,

also to round-off only, and the impulses to that of the momentum. In a step that ends as fast as it
began, as of a block at rest on the ground, neither gravity nor ground has done work.

The angular impulse is x x J with the position at which J acts on the momentum: x0, the substep's
start, for all but what comes after the positions have moved (Verlet's second half, bounces), with x
at its end. A thermostat acts where the drift is half done, on the mean of both but for what is
along its impulse. The drift turns nothing, and the sum is the change of the angular momentum. (Not
in a periodic box, whose wraps move angular momentum about; with constraints and thermostats but for
what the first move a particle by between these.)

All sums are float64, in blocks of fixed bounds; a particle's share is of the state's precision.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
import warp as wp

from ...engine.blocks import blocks
from ...engine.execution.copies import copy, zero
from ...engine.execution.launch import launch, owner
from ...engine.loop import Loop
from ...engine.model import Model, filled
from ...engine.observers import FOLLOW, FORCE, PROJECT, Observer
from ...engine.state import State
from ...kernels.instruments.ledger import TOTALS, account_kernel, change_kernel, ledger_type

INTERACTION, CONSTRAINT, THERMOSTAT = "interaction", "constraint", "thermostat"
BLOCK_CPU, BLOCK_CUDA = 256, 16  # particles that a thread sums


class Account:
    """One part: its changes in a substep, and its totals by blocks."""

    def __init__(self, part: Any, kind: str, early: wp.array, late: wp.array, totals: wp.array):
        self.part, self.kind = part, kind
        self.acts = kind == INTERACTION
        self.early, self.late, self.totals = early, late, totals


class Accounts(Observer):
    """The accounts of all parts of a loop."""

    name = "ledger"

    def __init__(self, loop: Loop):
        model, state = loop.model, loop.state
        state.require({"mass", "inverse_mass"})
        self.model, self.state = model, state
        self.halves = loop.integrator.carries_forces  # kicks at both ends of a substep
        size = BLOCK_CPU if model.device.is_cpu else BLOCK_CUDA
        begin, end, self.world = blocks(model.offsets, size)
        self.x0, self.v0, self.seen = (self._rows() for _ in range(3))
        arrays = {
            "begin": model.array(begin, wp.int32), "end": model.array(end, wp.int32),
            "m": state.mass, "w": state.inverse_mass, "x0": self.x0, "v0": self.v0,
            "x": state.position, "v": state.velocity,
        }  # fmt: skip
        self.read = filled(ledger_type(model.precision), arrays)
        self.accounts = [self._open(part, INTERACTION) for part in loop.interactions]
        self.accounts += [self._open(part, CONSTRAINT) for part in loop.constraints]
        self.accounts += [self._open(part, THERMOSTAT) for part in loop.thermostats]
        self.start = wp.zeros(model.world_count, dtype=TOTALS, device=model.device)
        self.begin_anew(range(model.world_count))

    def _rows(self) -> wp.array:
        count, dtype = self.model.particle_count, self.model.precision.vec3
        return wp.zeros(count, dtype=dtype, device=self.model.device)

    def _open(self, part: Any, kind: str) -> Account:
        early = self._rows()
        one = kind == THERMOSTAT or (kind == INTERACTION and not self.halves)
        late = early if one else self._rows()
        totals = wp.zeros(len(self.world), dtype=TOTALS, device=self.model.device)
        return Account(part, kind, early, late, totals)

    # In a substep -----------------------------------------------------------------------------

    def begin(self, dt: float) -> None:
        with owner("ledger"):
            self._copy(self.state.position, self.x0)
            self._copy(self.state.velocity, self.v0)
            for each in self.accounts:
                if each.acts and self.halves:
                    self._copy(each.late, each.early)
                elif not each.acts:
                    zero(self.model, each.early)
                    zero(self.model, each.late)

    def before(self, part: Any, stage: str) -> None:
        with owner("ledger"):
            self._copy(self._changing(stage), self.seen)

    def after(self, part: Any, stage: str) -> None:
        mine = next(each for each in self.accounts if each.part is part)
        change = mine.early if stage == PROJECT else mine.late
        with owner("ledger"):
            more = int(stage != FORCE)
            inputs = [self._changing(stage), self.seen, more, change]
            launch(change_kernel(self.model.precision), len(change), inputs, self.model.device)

    def end(self, dt: float) -> None:
        with owner("ledger"):
            for each in self.accounts:
                early, late = self._scales(each, dt)
                inputs = [
                    self.read, each.early, each.late, early, late, int(not each.acts), each.totals,
                ]  # fmt: skip
                kernel = account_kernel(self.model.precision)
                launch(kernel, len(each.totals), inputs, self.model.device)

    def _scales(self, each: Account, dt: float) -> tuple[float, float]:
        """What turns a part's changes into impulses, or into velocities for a constraint."""
        if each.acts:
            return (0.5 * dt, 0.5 * dt) if self.halves else (dt, 0.0)
        if each.kind == THERMOSTAT:
            return 0.5, 0.5
        return (1.0 / dt if dt > 0 else 0.0), 1.0

    def _changing(self, stage: str) -> wp.array:
        """What a part writes to."""
        state = self.state
        if stage in (FORCE, FOLLOW):
            return state.force
        return state.correction if stage == PROJECT else state.velocity

    def _copy(self, source: wp.array, target: wp.array) -> None:
        copy(self.model, source, target)

    # What outlives a substep ------------------------------------------------------------------

    def persistent(self) -> dict[str, wp.array]:
        found = {"start": self.start}
        for k, each in enumerate(self.accounts):
            found[f"totals_{k}"] = each.totals
            if each.acts and self.halves:
                found[f"late_{k}"] = each.late
        return found

    def worlds(self, name: str, array: wp.array) -> np.ndarray:
        if name == "start":
            return np.arange(self.model.world_count)
        return self.world if name.startswith("totals") else self.model.world_of

    def carried(self) -> list[wp.array]:
        return [each.late for each in self.accounts if each.acts and self.halves]

    @property
    def memory(self) -> int:
        own = [self.x0, self.v0, self.seen, self.start]
        for each in self.accounts:
            own += [each.early, each.totals] + ([each.late] if each.late is not each.early else [])
        return sum(array.capacity for array in own)

    def begin_anew(self, worlds: Iterable[int]) -> None:
        """These worlds are at a start: nothing has been done to them."""
        chosen = list(worlds)
        start = self.start.numpy().copy()
        start[chosen] = motion(self.model, self.state)[chosen]
        self.start.assign(start)
        for each in self.accounts:
            totals = each.totals.numpy().copy()
            totals[np.isin(self.world, chosen)] = 0.0
            each.totals.assign(totals)

    def written(self, before: np.ndarray) -> None:
        """Something was written from outside, and motion was so ``before``: nobody's work."""
        self.start.assign(self.start.numpy() + motion(self.model, self.state) - before)

    def sums(self) -> np.ndarray:
        """Work, impulse and angular impulse of each part and world, (parts, worlds, 7)."""
        result = np.zeros((len(self.accounts), self.model.world_count, 7))
        for k, each in enumerate(self.accounts):
            np.add.at(result[k], self.world, each.totals.numpy())
        return result

    def change(self) -> np.ndarray:
        """Of kinetic energy, momentum and angular momentum since the start, (worlds, 7)."""
        return motion(self.model, self.state) - self.start.numpy()


def motion(model: Model, state: State) -> np.ndarray:
    """Kinetic energy, momentum and angular momentum of the unpinned of each world, (worlds, 7)."""
    mass = np.where(state.inverse_mass.numpy() > 0, state.mass.numpy().astype(np.float64), 0.0)
    x, v = (array.numpy().astype(np.float64) for array in (state.position, state.velocity))
    p = mass[:, None] * v
    rows = np.concatenate([0.5 * (p * v).sum(axis=1, keepdims=True), p, np.cross(x, p)], axis=1)
    result = np.zeros((model.world_count, 7))
    np.add.at(result, model.world_of, rows)
    return result
