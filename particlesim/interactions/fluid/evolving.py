"""What a fluid has of its own that changes in time: heat, densities, lengths, slack of walls."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from contextlib import AbstractContextManager, nullcontext
from typing import Any

import numpy as np
import warp as wp

from ... import validate
from ...engine.model import Model
from ...engine.state import State
from ...scene.part import Interaction, Part
from .density.continuity import Continuity, ContinuityDensity
from .equations_of_state import EquationOfState
from .heat import ENERGY, Heat
from .interfaces.fluids import Fluids
from .lengths import LENGTH, AdaptiveSmoothing, Lengths
from .smoothing.smoothing_function import Smoothing
from .viscosities import Viscosity
from .walls import Walls


class Evolving(Interaction):
    """The base of a fluid: each of these where it was asked for."""

    model: Model
    state: State
    hot: bool
    dimension: int
    smoothing: Smoothing
    fluids: Fluids
    pairs: Any  # the list, once prepared
    parameters: dict[str, Any]
    equation_of_state: EquationOfState
    viscosity: tuple[Viscosity, ...]
    adaptive: AdaptiveSmoothing | None = None
    density: ContinuityDensity | None = None
    continuity: Continuity | None = None  # once prepared
    heat: Heat | None = None  # once attached
    lengths: Lengths | None = None  # once prepared
    walls: Walls

    def sum_density(self, state: State, sounds: bool = False) -> None:
        """Density and pressure at the present positions."""
        raise validate.undefined(self, "sum_density(self, state, sounds)")

    def keep_heat(self) -> None:
        """It has an internal energy."""
        self.requires |= {ENERGY, "inverse_mass"}
        self.evolves = frozenset({ENERGY})
        self.reads_velocity = self.conservative = True

    def check_density(self) -> None:
        """By continuity goes what has one length and one rest density, and moves as it is fast."""
        if self.density is None:
            return
        if not isinstance(self.density, ContinuityDensity):
            raise TypeError(
                f"{self.name}: density must be a ContinuityDensity or None, got {self.density!r}; "
                "give ContinuityDensity(0.1)."
            )
        drifting = [each.name for each in self.viscosity if each.drifts]
        for bad, what, got in (
            (self.adaptive, "with one smoothing length", "an AdaptiveSmoothing"),
            (self.fluids.several, "with one fluid", f"{len(self.fluids.groups)} fluids"),
            (self.hot, "without internal energy", self.equation_of_state.name),
            (drifting, "with viscosities that move no particles", drifting),
            (not self.fluids.densities, "with a rest_density", None),
        ):
            if bad:
                raise validate.fail(
                    self.name, "density", f"be a ContinuityDensity only {what}", got,
                    "leave one of both out" if got else "give it, for densities start there",
                )  # fmt: skip
        self.parameters |= {"density_diffusion": self.density.diffusion}
        self.requires |= {"time"}
        self.reads_velocity = True
        self.conservative = self.conservative and not self.density.diffusion

    def still(self) -> AbstractContextManager[None]:
        """Forces are taken at other velocities, and densities by continuity stay."""
        return nullcontext() if self.continuity is None else self.continuity.still()

    def take_length(self, given: Any) -> dict[str, float]:
        """The parameter that smoothing lengths follow from."""
        if isinstance(given, AdaptiveSmoothing):
            self.adaptive = given
            self.cutoff = self.smoothing.support * (given.largest or np.inf)
            self.requires |= {LENGTH}
            return {"eta": given.eta}
        h = validate.number(self.name, LENGTH, given, above=0.0, unit="length")
        self.cutoff = self.smoothing.support * h
        return {LENGTH: h}

    def check_range(self, h: np.ndarray, closest_squared: np.ndarray) -> None:
        """Powers of h must be normal numbers of the precision."""
        limits = np.finfo(self.model.precision.numpy)
        with np.errstate(divide="ignore", over="ignore", under="ignore"):
            sigma = self.smoothing.sigma / h**self.dimension
        for power in (sigma, closest_squared):
            bad = ~((power > limits.tiny) & (power < limits.max))
            if bad.any():
                raise validate.fail(
                    self.name, "smoothing_length",
                    f"have h^2 and h^-{self.dimension} within {limits.dtype}",
                    float(h[np.argmax(bad)]),
                    "choose another unit of length, or precision=\"float64\"",
                )  # fmt: skip

    def begin(self, state: State, dt: float) -> None:
        if self.lengths is not None:
            self.lengths.reach.flag()
        if self.heat is not None:
            self.heat.begin(dt)

    def advance(self, state: State, dt: float) -> None:
        if self.continuity is not None:
            self.continuity.advance()
        if self.heat is not None:
            self.heat.advance(dt)
        if self.walls:
            self.walls.ease(dt)

    def carry(self, state: State, dt: float) -> None:
        if self.heat is not None:
            self.heat.carry(dt)

    def carried(self) -> list[wp.array]:
        return [] if self.heat is None else self.heat.carried()

    def persistent(self) -> dict[str, wp.array]:
        kept = {} if self.heat is None else self.heat.persistent()
        if self.continuity is not None:
            kept |= self.continuity.persistent()
        return {**kept, **self.walls.persistent()} if self.walls else kept

    def worlds(self, name: str, array: wp.array) -> np.ndarray | None:
        of_sides = name in ("slack", "closing")
        return self.walls.worlds if of_sides else super().worlds(name, array)

    def reset(self, worlds: Sequence[int]) -> None:
        self.forget(self.persistent(), worlds)
        if self.continuity is not None:
            self.continuity.reset(worlds)
        if self.lengths is not None:
            self.lengths.reset(worlds)
        if self.walls:
            self.walls.easing.mark(worlds)

    def placed(self, worlds: Iterable[int]) -> None:
        if self.lengths is not None:
            self.lengths.settle(list(worlds))
        if self.walls:
            self.walls.easing.mark(worlds)

    def presses(self, wall: Part) -> tuple[np.ndarray, np.ndarray] | None:
        return self.walls.pressed(wall) if self.walls else None

    def fluid_numbers(self) -> np.ndarray:
        """Of every particle of the worlds which of several fluids it is of, (n,)."""
        each = zip(self.peers, self.model.scenes, strict=True)
        return np.concatenate([peer.fluids.numbers(scene) for peer, scene in each])

    def by_member(self) -> dict[str, np.ndarray]:
        """Parameters of each member, (m,); of those by fluids that of its own."""
        rows = self.pairs.members_host
        world, number = self.model.world_of[rows], self.fluid_numbers()[rows]
        columns = {name: values[world] for name, values in self.columns(self.parameters).items()}
        return self.fluids.by_particle(columns, number)

    def smoothing_lengths(self, rows: np.ndarray) -> np.ndarray:
        """h of these members at the last forces [length]."""
        if self.lengths is not None:
            return self.state[LENGTH].numpy()[rows].astype(np.float64)
        return self.columns({LENGTH: None})[LENGTH][self.model.world_of[rows]]

    def look_at_density(self, state: State) -> None:
        """Without changing what the next substep starts from."""
        kept = None if self.lengths is None else wp.clone(state[LENGTH])
        self.sum_density(state)
        if kept is not None:
            wp.copy(state[LENGTH], kept)
