"""Tune: from a scene and a tolerance to settings."""

from __future__ import annotations

import dataclasses
import math
import sys
from collections.abc import Callable, Iterable, Mapping
from typing import Any

import numpy as np

from ... import validate
from ...scene.settings import INTEGRATORS, PRECISIONS, Settings
from ..reference import settled
from ..study import KNOBS, Study
from .report import Trial, Tuned
from .search import BETTER, Bench, Search, levels

OWNER = "tune"
FINEST = 4096  # times the fewest substeps, and at least as many: what is tried at most
ITERATIONS = (1, 2, 4, 8)
SKINS = (0.05, 0.2, 0.35)  # of the cutoff, beside what is set


def tune(
    build: Callable[..., Any],
    error: float = 1e-3,
    *,
    by: Callable[[Any], float] | str | None = None,
    vary: Mapping[str, Iterable[Any]] | None = None,
    reference: Any = None,
    margin: float = 0.9,
    seeds: int = 3,
    repeats: int = 3,
    frames: int | None = None,
    settings: Settings | None = None,
    options: Mapping[str, Any] | None = None,
    device: Any = None,
    progress: bool | Callable[[Trial], None] = False,
) -> Tuned:
    """The cheapest settings whose error is at most ``error``, found by searching.

    Substeps are sought between the stability limit (``Simulation.stability``) and where more stop
    to help; integrator, precision, iterations, skin and compensation, and what ``vary`` names, are
    changed one by one as long as that makes it cheaper. The largest error of all seeds tried, and
    as much as they differ on top of it, must be within ``margin`` of the tolerance.

    Args:
        build: ``build(**options) -> Scene``. Of a scene module, that module's ``settings``,
            ``frames`` and ``error`` hold where None is given. With an option ``seed`` it is tried
            with several.
        error: The tolerance, in units of what it is measured by.
        by: What the error is: ``error=`` of :func:`particlesim.tradeoff`.
        vary: Values of further knobs and of options of ``build`` by name, or other values of those
            above; a list of one holds a knob as it is.
        reference: For ``"converged"``, positions (n, 3), where one seed is tried; None: found by
            refining until it changes by less than a tenth of the tolerance.
        margin: Part of the tolerance to stay under, above 0, at most 1.
        seeds: How many seeds to try everything with, at least 1.
        repeats: Timed runs, in turn, of the best and what differs from it only in cost.
        frames: Frames of ``settings.dt``; 240 where nothing says how many.
        settings: Where to start.
        options: Options of ``build`` that do not vary.
        device: As for Simulation.
        progress: True to print every trial to stderr, or a function of it.

    Raises:
        ValueError: Nothing meets the tolerance (the message says how small the error got), or
            arguments that do not fit.

    Example:
        >>> ball = Scene()
        >>> _ = ball.add_particles([(0, 0, 0)], velocity=(1, 0, 0))
        >>> _ = ball.add_interaction(Drag(linear=1.0))
        >>> tune(lambda: ball, 1e-3, frames=5, settings=Settings(dt=0.1), device="cpu").error < 1e-3
        True
    """
    validate.whole(OWNER, "seeds", seeds, minimum=1)
    study = Study(OWNER, build, settings, options, frames, device)
    studies = study.seeded(1 if reference is not None else seeds)
    show = _print if progress is True else progress if callable(progress) else None
    return _search(studies, error, by, dict(vary or {}), reference, margin, repeats, show)


def _search(
    studies: list[Study],
    tolerance: float,
    by: Any,
    vary: dict[str, Iterable[Any]],
    reference: Any,
    margin: float,
    repeats: int,
    show: Callable[[Trial], None] | None,
) -> Tuned:
    """The best of the studies of one scene (see :func:`tune`)."""
    tolerance = validate.number(OWNER, "error", tolerance, above=0.0)
    margin = validate.number(OWNER, "margin", margin, above=0.0, maximum=1.0)
    validate.whole(OWNER, "repeats", repeats, minimum=1)
    first = studies[0]
    ladders, substeps, polish = _ladders(first, vary)
    references = [reference] * len(studies)
    if reference is None and (by == "converged" or (by is None and not first.known_here)):
        finest = _finest(ladders, first.settings)
        references = [settled(each, finest, tolerance) for each in studies]
        by = "converged"
    bench = Bench(studies, by, references, show)
    best = Search(bench, margin * tolerance, ladders, substeps).run(first.settings.substeps)
    if best is None:
        least = min((each.bound for each in bench.trials), default=math.inf)
        raise validate.fail(
            OWNER, "error", f"be at least {least / margin:.3g}, the smallest found over margin",
            tolerance, "allow more, or vary what the error depends on",
        )  # fmt: skip
    return Tuned(
        scene=first.label, tolerance=tolerance, measure=bench.words,
        best=_polished(bench, best, polish, margin * tolerance, repeats),
        trials=tuple(bench.trials), seeds=len(studies), device=bench.device,
    )  # fmt: skip


def _ladders(
    study: Study, given: dict[str, Iterable[Any]]
) -> tuple[dict[str, list[Any]], list[int], dict[str, list[Any]]]:
    """Values of modes, substeps to choose from, and values of knobs that are but polish."""
    settings, vary = study.settings, study.lists(given)
    study.split({name: values[0] for name, values in vary.items()}, "vary")
    start = {name: values[0] for name, values in vary.items() if name != "substeps"}
    sim = study.simulation(study.plan(start))
    found: dict[str, list[Any]] = {"precision": _first(settings.precision, PRECISIONS)}
    if sim.constraints:
        found["iterations"] = _first(settings.iterations, ITERATIONS)
    else:
        found["integrator"] = _first(settings.integrator, INTEGRATORS)
    polish: dict[str, list[Any]] = {}
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


def _first(value: Any, values: Iterable[Any]) -> list[Any]:
    """``values`` with the one that is set in front."""
    return [value, *(each for each in values if each != value)]


def _finest(ladders: Mapping[str, list[Any]], settings: Settings) -> dict[str, Any]:
    """What a reference starts from."""
    finest: dict[str, Any] = {"substeps": 2 * settings.substeps}
    if "integrator" in ladders:
        finest["integrator"] = "velocity_verlet"
    if "iterations" in ladders:
        finest["iterations"] = max(ladders["iterations"])
    for name, values in ladders.items():
        if name not in KNOBS:
            if len(values) > 1:
                raise validate.fail(
                    OWNER, "by", f"be a function of the simulation where {name} varies",
                    "converged", "which of its values is the most accurate is not known",
                )  # fmt: skip
            finest[name] = values[0]
    return finest


def _polished(
    bench: Bench, best: Trial, polish: Mapping[str, list[Any]], target: float, repeats: int
) -> Trial:
    """The best with those knobs that change hardly more than the cost, all timed in turn."""
    rivals: list[dict[str, Any]] = [dict(best.values)]
    for name, values in polish.items():
        rivals += [{**best.values, name: value} for value in values]
    costs = bench.costs(rivals, repeats)
    for k in np.argsort(costs, kind="stable"):
        if k == 0 or costs[k] > BETTER * costs[0]:
            break
        trial = bench.trial(rivals[k])
        if trial.bound <= target:
            return dataclasses.replace(trial, cost=costs[k])
    return dataclasses.replace(best, cost=costs[0])


def _print(trial: Trial) -> None:
    print(trial, file=sys.stderr, flush=True)
