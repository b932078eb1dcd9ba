"""Further values that a recording holds of every particle: fields of the state, and colours."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from .. import validate
from ..engine.source import Source
from ..engine.state import OF_WORLDS
from ..interactions.fluid.sph import SPH
from . import colors

OWNER = "UsdRecorder"
DERIVED = ("speed", "unwrapped")
OF_THE_FLUID = frozenset({"density", "pressure"})


class ParticleFields:
    """Reads per-particle values of a simulation by name.

    A name is an array of the state (``"density"``, ``"force"``), an attribute that the particles
    were given, ``"mass"``, ``"radius"``, ``"speed"``, the length of the velocity, or
    ``"unwrapped"``, the position as without a periodic box, in float64. In a periodic scene
    ``"image"`` counts the boxes in between, so that unwrapped = position + image * box length.

    Args:
        sim: The simulation.
        names: What to read.
        owner: Whom an error names.

    Raises:
        ValueError: A name that the simulation has no such values for.
    """

    def __init__(self, sim: Source, names: Iterable[str], owner: str = OWNER):
        self.sim = sim
        self.names = list(dict.fromkeys([names] if isinstance(names, str) else names))
        for name in self.names:
            validate.choice(owner, "field", name, readable(sim))
        self.fluids: list[tuple[SPH, np.ndarray]] = []
        if OF_THE_FLUID & set(self.names):
            self.fluids = [
                (part, sim.model.members([peer.group for peer in part.peers], part.name))
                for part in sim.interactions
                if isinstance(part, SPH)
            ]

    def kind(self, name: str) -> int | str:
        """How the writer has to write it: 1, 3 or ``"int"``."""
        values = self._read(name)
        if values.ndim == 2:
            return 3
        return "int" if np.issubdtype(values.dtype, np.integer) else 1

    def read(self) -> dict[str, np.ndarray]:
        """Present values, (n,) or (n, 3), copies on the host."""
        self._complete_density()
        return {name: self._read(name) for name in self.names}

    def _read(self, name: str) -> np.ndarray:
        if name in self.sim.state:
            return self.sim.get(name)
        if name == "speed":
            v = self.sim.get("velocity")
            return np.sqrt(np.einsum("ij,ij->i", v, v))
        if name == "unwrapped":
            return self.sim.state.unwrapped()
        return self.sim.model.column(name)

    def _complete_density(self) -> None:
        """Densities before the first substep, which nobody has asked for so far."""
        for fluid, rows in self.fluids:
            # A particle is in its own density, so that a known one is never 0.
            if len(rows) and not self.sim.get("density")[rows].all():
                fluid.update_density()


def readable(sim: Source) -> list[str]:
    """Names of the values that there is one of for each particle."""
    held = {
        name
        for name, array in sim.state.arrays.items()
        if len(array) == sim.model.particle_count and name not in OF_WORLDS
    }
    return sorted(held | set(sim.model.attributes) | set(DERIVED))


class ParticleColors:
    """Colours of particles by a value, through a colour map.

    Args:
        sim: The simulation.
        by: Name of the value (see :class:`ParticleFields`); vectors are coloured by their length.
        color_map: See :func:`particlesim.output.colors.colored`.
        color_range: (lower, upper) numbers with the first and the last colour. None: those
            that nearly all values of the frames so far are between; before any differ, all have
            the first. So what starts from rest is not of one colour later.
        rows: The particles whose values make that range.

    Raises:
        ValueError: A name or a colour map that is not known, a range that is none.
    """

    def __init__(self, sim: Source, by: str, color_map: Any, color_range: Any, rows: np.ndarray):
        self.by, self.color_map, self.rows = by, color_map, rows
        self.values = ParticleFields(sim, [by])
        colors.table(color_map)
        self.range: tuple[float, float] | None = None
        self.grows = color_range is None
        if color_range is not None:
            self.range = _checked_range(color_range)

    def read(self) -> np.ndarray:
        """Present colours, (n, 3), linear."""
        values = self.values.read()[self.by]
        if values.ndim == 2:
            values = np.sqrt(np.einsum("ij,ij->i", values, values))
        if self.grows:
            self._grow(values[self.rows])
        return colors.colored(values, self.color_map, *(self.range or (0.0, 0.0)))

    def _grow(self, drawn: np.ndarray) -> None:
        """Let the range hold nearly all of these too; all, where most are the same."""
        if not len(drawn) or not drawn.max() > drawn.min():
            return
        lower, upper = colors.spanned(drawn)
        if self.range is not None:
            lower, upper = min(lower, self.range[0]), max(upper, self.range[1])
        self.range = lower, upper

    def notes(self) -> dict[str, Any]:
        """What the colours mean, for legends and for going on with the same range."""
        found: dict[str, Any] = {"colorBy": self.by}
        if self.range is not None:
            found |= {"colorLower": self.range[0], "colorUpper": self.range[1]}
        return found

    def restore(self, notes: Mapping[str, Any]) -> None:
        """Go on with the range of an earlier frame, from its notes."""
        if self.grows and "colorLower" in notes:
            self.range = (float(notes["colorLower"]), float(notes["colorUpper"]))


def _checked_range(given: Any) -> tuple[float, float]:
    try:
        lower, upper = given
    except (TypeError, ValueError):
        raise validate.fail(
            OWNER, "color_range", "be (lower, upper)", given, "give two numbers"
        ) from None
    lower = validate.number(OWNER, "color_range lower", lower)
    return lower, validate.number(OWNER, "color_range upper", upper, above=lower)
