"""Ladders: the values that a search may give to each knob."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import Any

from ... import validate
from ...scene.settings import PRECISIONS
from ..study import KNOBS, Study
from .search import levels

FINEST = 4096  # times the fewest substeps, and at least as many: what is tried at most
INTEGRATORS = ("symplectic_euler", "velocity_verlet")  # that all forces can go with
ITERATIONS = (1, 2, 4, 8)
SKINS = (0.05, 0.2, 0.35)  # of the cutoff, beside what is set

Ladder = dict[str, list[Any]]


def ladders(study: Study, given: Mapping[str, Iterable[Any]]) -> tuple[Ladder, list[int], Ladder]:
    """Values of modes, substeps to choose from, and values of knobs that are but polish."""
    settings, vary = study.settings, study.lists(given)
    study.split({name: values[0] for name, values in vary.items()}, "vary")
    start = {name: values[0] for name, values in vary.items() if name != "substeps"}
    sim = study.simulation(study.plan(start))
    found: Ladder = {"precision": first(settings.precision, PRECISIONS)}
    if sim.constraints:
        found["iterations"] = first(settings.iterations, ITERATIONS)
    elif not any(part.answers for part in sim.interactions):
        found["integrator"] = first(settings.integrator, INTEGRATORS)
    polish: Ladder = {}
    if sim.neighbors.verlet:
        cutoff = float(max(each.cutoff.max() for each in sim.neighbors.verlet))
        polish["skin"] = [float(f"{share * cutoff:.3g}") for share in SKINS]
    polish["compensated"] = [not settings.compensated]
    polish = {name: vary.pop(name, values) for name, values in polish.items()}
    substeps = vary.pop("substeps", None)
    if substeps is None:
        needed = sim.stability().substeps
        least = int(needed) if math.isfinite(needed) else settings.substeps
        substeps = levels(least, max(FINEST * least, settings.substeps))
    return {**found, **vary}, sorted({int(each) for each in substeps}), polish


def first(value: Any, values: Iterable[Any]) -> list[Any]:
    """``values`` with the one that is set in front."""
    return [value, *(each for each in values if each != value)]


def finest(owner: str, ladder: Mapping[str, list[Any]], substeps: int) -> dict[str, Any]:
    """What a reference starts from, with so many substeps, which it refines."""
    chosen: dict[str, Any] = {"substeps": substeps}
    if "integrator" in ladder:
        chosen["integrator"] = "velocity_verlet"
    if "iterations" in ladder:
        chosen["iterations"] = max(ladder["iterations"])
    for name, values in ladder.items():
        if name not in KNOBS:
            if len(values) > 1:
                raise validate.fail(
                    owner, "by", f"be a function of the simulation where {name} varies",
                    "converged", "which of its values is the most accurate is not known",
                )  # fmt: skip
            chosen[name] = values[0]
    return chosen
