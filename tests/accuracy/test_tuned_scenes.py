"""Tuning of ready scenes: against a full grid, and with another seed."""

import importlib
import math

import pytest

import particlesim as ps
from particlesim.accuracy.observe import observable
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
        return {**grid, "iterations": [1, 2, 4, 8]}
    return {**grid, "integrator": ["symplectic_euler", "velocity_verlet"]}


def judged_by(name, module, frames, options, tolerance):
    """The largest error over time: against a reference, or of the pendulum's known answer."""
    if name == "pendulum":
        return {"error": "known", "over": "max"}
    study = Study("test", module.build, module.settings, options, frames, "cpu")
    forces = not module.build(**options).constraints
    finest = {"integrator": "velocity_verlet"} if forces else {"iterations": 8}
    finest["substeps"] = 2 * module.settings.substeps
    seen = [observable("test", "position")]
    return {"reference": settled(study, finest, tolerance, seen, "max", frames)}


def check(name, apart=1.5):
    """Tune a scene; its error with another seed, and its cost over the best of a full grid's.

    Errors are the largest of all frames of a run that is 13 % longer than what it was tuned for. Of
    the grid too, what counts is what meets the tolerance with either seed.
    """
    tolerance, frames, options, other = SCENES[name]
    module = importlib.import_module(f"particlesim.scenes.{name}")
    found = ps.tune(module.build, tolerance, frames=frames, options=options, device="cpu")
    grid, longer = grid_of(found, module, apart), math.ceil(1.13 * frames)
    tables = [
        ps.tradeoff(
            module.build, grid, options=chosen, repeats=repeats, frames=longer,
            settings=found.settings, device="cpu",
            **judged_by(name, module, longer, chosen, tolerance),
        )
        for chosen, repeats in ((options, 3), ({**options, **other}, 1))
    ]  # fmt: skip
    pairs = list(zip(tables[0].rows, tables[1].rows, strict=True))
    (mine,) = [pair for pair in pairs if pair[0].settings == found.settings]
    meeting = [
        first
        for first, second in pairs
        if not first.diverged and max(first.error, second.error) <= tolerance
    ]
    error, cost = mine[1].error, min(mine[0].costs)
    best = min(meeting, key=lambda row: min(row.costs))
    print(
        f"{name}: {found.line}, error {found.error:.3g} of {tolerance:g}, other {error:.3g}, "
        f"cost {cost / min(best.costs):.2f} of the best of {len(tables[0].rows)} "
        f"({best.label()}), {len(found.trials)} trials"
    )
    return error / tolerance, cost / min(best.costs)


@pytest.mark.parametrize("name", ["triple_pendulum", "three_body"])
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
    assert cost <= 1.5
