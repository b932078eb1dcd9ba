"""One moment of a history: what is conserved, and by how much densities and constraints are off."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any

import numpy as np

from ... import validate
from ...engine.source import Source
from ...instruments.diagnostics import measure, undisturbed
from ...instruments.residuals import residuals
from ...interactions.fluid.sph import SPH
from ...kernels.tensor import AXES

TEXT = ("limiter",)  # columns of words
Observed = Mapping[str, Callable[[Any], Any]]


def sample(sim: Source, observe: Observed | None = None) -> dict[str, np.ndarray]:
    """One row of a history: name to (worlds,), numbers or ``TEXT``; see ``History``."""
    with undisturbed(sim):
        potentials: list[np.ndarray] = []
        total = measure(sim, potentials)
        values = {"mass": total.mass}
        for name in ("momentum", "angular_momentum"):
            vectors = getattr(total, name)
            values |= {f"{name}_{axis}": vectors[:, k] for k, axis in enumerate("xyz")}
        names = ["kinetic", "potential", "energy", "temperature"]
        boxed = bool(np.isfinite(total.volume).all())
        names += ["pressure"] if boxed else []
        names += ["volume"] if sim.model.flexible else []
        names += ["substeps", *TEXT] if sim.settings.adaptive else []
        values |= {name: getattr(total, name) for name in names}
        for a, b in AXES if boxed else ():
            values[f"stress_{'xyz'[a]}{'xyz'[b]}"] = total.stress[:, a, b]
        for label, part, own in zip(
            _labels(sim.interactions), sim.interactions, potentials, strict=True
        ):
            if getattr(part, "potential", part) is not None:  # a force alone has none
                values[f"potential:{label}"] = own
        for label, part in zip(_labels(sim.interactions), sim.interactions, strict=True):
            if isinstance(part, SPH) and part.fluids.densities:
                values |= _figures("density_error", label, *_density_error(part, sim), sim)
        sim.neighbors.update_for_constraints(sim.state)
        sim.neighbors.grow()
        for label, constraint in zip(_labels(sim.constraints), sim.constraints, strict=True):
            missed = residuals(constraint, sim)
            if missed is not None:
                values |= _figures("residual", label, np.abs(missed[0]), missed[1], sim)
        for name, look in (observe or {}).items():
            values |= _observed(name, look(sim), sim.model.world_count)
    return values


def _observed(name: str, found: Any, worlds: int) -> dict[str, np.ndarray]:
    """A column, or one for each number that a world has."""
    value = np.asarray(found, dtype=np.float64)
    if value.shape[:1] != (worlds,) or value.ndim > 2:
        raise validate.fail(
            "History", f"observe[{name!r}]", f"give one value a world, ({worlds},)", value.shape,
            "return an array with a row for each world",
        )  # fmt: skip
    if value.ndim == 1:
        return {f"observed:{name}": value}
    return {f"observed:{name} {k}": column for k, column in enumerate(value.T)}


def _labels(parts: Iterable[Any]) -> list[str]:
    """A name for each, with a number where several have the same."""
    labels: list[str] = []
    for part in parts:
        name, number = part.name, 1
        while name in labels:
            number += 1
            name = f"{part.name} {number}"
        labels.append(name)
    return labels


def _density_error(fluid: SPH, sim: Source) -> tuple[np.ndarray, np.ndarray]:
    """rho / rho0 - 1 of the fluid's particles, and their worlds."""
    fluid.update_density()
    members = fluid.pairs.members_host
    world = sim.model.world_of[members]
    density = sim.state.density.numpy()[members].astype(np.float64)
    return density / fluid.by_member()["rest_density"] - 1.0, world


def _figures(
    name: str, label: str, values: np.ndarray, world: np.ndarray, sim: Source
) -> dict[str, np.ndarray]:
    """The largest and the root mean square of each world; 0 where there is none."""
    count = np.bincount(world, minlength=sim.model.world_count)
    largest = np.full(sim.model.world_count, -np.inf)
    np.maximum.at(largest, world, values)
    square = np.bincount(world, values**2, sim.model.world_count) / np.maximum(count, 1)
    return {
        f"{name}_max:{label}": np.where(count > 0, largest, 0.0),
        f"{name}_rms:{label}": np.sqrt(square),
    }
