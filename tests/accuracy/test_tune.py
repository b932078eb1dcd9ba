"""Tuning: the cheapest settings under a tolerance."""

import importlib
import math
import subprocess
import sys

import numpy as np
import pytest

import particlesim as ps
from particlesim.accuracy.reference import settled
from particlesim.accuracy.study import Study
from particlesim.accuracy.tune.bench import Bench
from particlesim.accuracy.tune.report import Trial, line
from particlesim.accuracy.tune.search import Search, levels

# Scene: tolerance, frames, options, and what makes another of the same kind. Small and short, so
# that a reference can be had: chaos comes later. The error is the known one of the pendulum [rad],
# else the distance from the reference [length]. (The pendulum's is that of one instant, when its
# first order is about to change sign: it is no measure of pendulums let go elsewhere.)
SCENES = {
    "bouncing_block": (1e-3, 9, {"size": 3, "height": 0.1}, {"tilt": 0.42}),
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


def oscillator(seed=0):
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0)], pinned=True)
    amplitude = 0.2 if seed == 0 else np.random.default_rng(seed).uniform(0.19, 0.2)
    scene.add_particles([(1 + amplitude, 0, 0)])
    scene.add_interaction(ps.Springs([(0, 1)], 100.0, 1.0))
    return scene


def swung(sim):
    """Distance from x = 1 + a cos(omega t)."""
    a = sim.scenes[0].position[1, 0] - 1
    return sim.position[1, 0] - (1 + a * math.cos(10 * sim.time))


def tuned(error=1e-3, build=oscillator, **arguments):
    arguments = {
        "by": swung, "frames": 4, "settings": ps.Settings(dt=0.1), "device": "cpu", **arguments,
    }  # fmt: skip
    return ps.tune(build, error, **arguments)


# The search, on errors and costs that are made up


class Paper:
    """A bench on paper: error = (scale / substeps)^order + floor."""

    def __init__(self, laws):
        self.laws, self.trials = laws, []

    def trial(self, values):
        scale, order, floor, _ = self.laws[values["integrator"]]
        error = (scale / values["substeps"]) ** order + floor
        made = Trial(dict(values), ps.Settings(), {}, error, self.cost(values))
        if all(made.values != each.values for each in self.trials):
            self.trials.append(made)
        return made

    def cost(self, values):
        return values["substeps"] * self.laws[values["integrator"]][3]

    def costs(self, chosen, repeats):
        return [self.cost(values) for values in chosen]


EULER, VERLET = "symplectic_euler", "velocity_verlet"


def search(laws, target, start=10, most=100000, least=1):
    bench = Paper(laws)
    found = Search(bench, target, {"integrator": list(laws)}, levels(least, most))
    return found.run(start), bench.trials


@pytest.mark.parametrize("target", [0.3, 1e-2, 1e-3])
@pytest.mark.parametrize("start", [1, 10, 3000])
def test_least_substeps_of_one_mode(target, start):
    best, trials = search({EULER: (1.0, 1, 0.0, 1.0)}, target, start)
    # Levels are a tenth apart, or one, and the least that suffices is bracketed to one of them.
    assert 1 / target <= best.values["substeps"] <= 1.21 / target + 1
    assert len(trials) <= 10


def test_order_decides_where_to_start():
    laws = {EULER: (1.0, 1, 0.0, 1.0), VERLET: (1.0, 2, 0.0, 1.1)}
    best, trials = search(laws, 1e-6, most=10**7)
    assert best.values["integrator"] == VERLET
    assert 1000 <= best.values["substeps"] <= 1210
    assert max(trial.cost for trial in trials) < 5000  # not the 10^6 that Euler needs


def test_a_mode_that_is_dominated_costs_one_trial():
    laws = {VERLET: (1.0, 2, 0.0, 1.0), EULER: (1.0, 1, 0.0, 0.9)}
    _, trials = search(laws, 1e-4)
    assert sum(trial.values["integrator"] == EULER for trial in trials) <= 3


def test_a_floor_above_the_target_is_seen():
    best, trials = search({EULER: (1.0, 1, 0.1, 1.0)}, 0.01)
    assert best is None and len(trials) < 8
    best, _ = search({EULER: (1.0, 1, 0.1, 1.0), VERLET: (50.0, 2, 0.0, 9.0)}, 0.01)
    assert best.values["integrator"] == VERLET and 500 <= best.values["substeps"] <= 605


def test_never_below_the_least_nor_above_the_most():
    best, trials = search({EULER: (1.0, 1, 0.0, 1.0)}, 0.5, least=40)
    assert best.values["substeps"] == 40
    assert min(trial.values["substeps"] for trial in trials) == 40
    best, trials = search({EULER: (1e9, 1, 0.0, 1.0)}, 0.5, most=100)
    assert best is None and max(trial.values["substeps"] for trial in trials) <= 110


def test_levels():
    assert levels(1, 12) == [*range(1, 13)]
    assert levels(100, 150) == [100, 110, 121, 133, 146, 161]


# References


def test_reference_is_exact_to_a_tenth_of_the_tolerance():
    study = Study("test", oscillator, ps.Settings(dt=0.1), frames=4, device="cpu")
    for integrator in ("symplectic_euler", "velocity_verlet"):
        x = settled(study, {"substeps": 4, "integrator": integrator}, 1e-3)
        # Of two particles one is exact: rms over both.
        assert abs(x[1, 0] - (1 + 0.2 * math.cos(4.0))) / math.sqrt(2) < 1e-4


def test_a_reference_that_does_not_settle_says_so():
    rng = np.random.default_rng(0)

    def chaos():
        scene = ps.Scene()
        scene.add_particles(rng.random((3, 3)), mass=1.0)  # another start each time
        scene.add_interaction(ps.Gravity(softening=0.1))
        return scene

    study = Study("test", chaos, ps.Settings(dt=0.1), frames=2, device="cpu")
    with pytest.warns(UserWarning, match="must change by less than"):
        settled(study, {"substeps": 2}, 1e-6)


# tune


def test_it_finds_the_better_integrator():
    found = tuned(1e-4)
    assert found.error <= 1e-4 and found.cost > 0 and found.seeds == 3
    assert found.settings.integrator == "velocity_verlet"
    # Leapfrog's phase is off by omega^3 h^2 t / 24: h = 0.0036 for 0.2 * phase = 1e-4 at t = 0.4,
    # so 28 substeps; ten per cent of margin and of a level more, and sin(4) is 0.76.
    assert 18 <= found.settings.substeps <= 40
    assert found.options == {} and found.measure == "against the known answer"


def test_the_line_can_be_pasted():
    found = tuned(1e-3)
    assert eval(found.line, {"ps": ps}) == found.settings
    assert found.line in str(found)
    for settings in (ps.Settings(), ps.Settings(dt=0.3, substeps=7, skin=0.1, compensated=False)):
        assert eval(line(settings), {"ps": ps}) == settings
    assert line(ps.Settings(substeps=3)) == "ps.Settings(dt=1 / 60, substeps=3)"


def test_other_seeds_meet_it_too():
    found = tuned(1e-3)
    for seed in range(10):
        sim = ps.Simulation(oscillator(seed), found.settings, device="cpu")
        for _ in range(4):
            sim.step()
        assert abs(swung(sim)) <= 1e-3


def test_never_past_the_stability_limit():
    found = tuned(10.0)
    sim = ps.Simulation(oscillator(), found.settings, device="cpu")
    assert sim.stability().safe
    assert found.settings.substeps == sim.stability().substeps == 1


def test_what_varies_can_be_said():
    shown = []
    found = tuned(
        1e-3, vary={"integrator": ["symplectic_euler"], "precision": ["float64"],
                    "substeps": [300, 10, 100, 1000]}, progress=shown.append,
    )  # fmt: skip
    assert found.settings.integrator == "symplectic_euler"
    assert found.settings.precision == "float64"
    # First order: 0.2 omega h / 2 * sin: 1e-3 needs h = 0.1 / 76.
    assert found.settings.substeps == 100
    assert list(found.trials) == shown
    assert {trial.values["substeps"] for trial in shown} <= {300, 10, 100, 1000}


def test_options_of_build_are_searched_too():
    def falling(drag=1.0, unused=0):
        scene = ps.Scene()
        scene.add_particles([(0, 0, 0)], velocity=(1, 0, 0))
        scene.add_interaction(ps.Drag(linear=drag))
        return scene

    found = tuned(
        0.05, falling, vary={"drag": [4.0, 2.0, 1.0]}, settings=ps.Settings(dt=0.5),
        by=lambda sim: sim.velocity[0, 0] - math.exp(-sim.time),
    )  # fmt: skip
    assert found.options["drag"] == 1.0


def test_drift_as_the_error():
    found = tuned(0.02, by="energy")
    assert found.error <= 0.02 and "energy" in found.measure


def test_what_cannot_be_met_is_refused(refused):
    with refused("error must be at least"):
        tuned(1e-9, by=lambda sim: 1.0)
    with refused("error must be above 0"):
        tuned(0.0)
    with refused("margin must"):
        tuned(margin=1.5)
    with refused(r"vary\['substeps'\] must be a list"):
        tuned(vary={"substeps": "many"})
    with pytest.raises(ValueError, match="vary must name"):
        tuned(vary={"substepz": [1]})
    with refused("by must be a function of the simulation where seed varies"):
        tuned(by="converged", vary={"seed": [0, 1]})


def test_the_bench_tries_a_setting_once():
    study = Study("test", oscillator, ps.Settings(dt=0.1), frames=4, device="cpu")
    bench = Bench([study], swung, [None])
    first = bench.trial({"substeps": 5})
    assert bench.trial({"substeps": 5}) is first and len(bench.trials) == 1
    failed = bench.trial({"substeps": 1, "dt": 0.4})  # omega h = 4
    assert failed.error > 1


def test_command(tmp_path):
    scene = tmp_path / "swing.py"
    scene.write_text(
        "import particlesim as ps\n"
        "settings, frames = ps.Settings(dt=0.1), 4\n"
        "def build(stiffness: float = 100.0):\n"
        "    scene = ps.Scene()\n"
        "    scene.add_particles([(0, 0, 0)], pinned=True)\n"
        "    scene.add_particles([(1.2, 0, 0)])\n"
        "    scene.add_interaction(ps.Springs([(0, 1)], stiffness, 1.0))\n"
        "    return scene\n"
    )
    command = [sys.executable, "-m", "particlesim.cli", "tune", str(scene), "--device", "cpu"]
    done = subprocess.run(
        [*command, "--error", "1e-3", "--set", "stiffness=50", "--vary", "precision=float64"],
        capture_output=True, text=True, timeout=120, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "ps.Settings(dt=0.1, substeps=" in done.stdout and "float64" in done.stdout
    assert "build(stiffness=50)" in done.stdout
    assert "substeps=" in done.stderr  # the trials
    done = subprocess.run(
        [*command, "--by", "guess"], capture_output=True, text=True, timeout=120, check=False
    )
    assert done.returncode == 2 and done.stderr.count("\n") == 1


# Ready scenes: against a full grid, and with another seed


def grid_of(found, module):
    """Knobs of a full grid: substeps 1.5 apart, and all modes."""
    sim = ps.Simulation(module.build(**found.options), found.settings, device="cpu")
    needed, most = sim.stability().substeps, 4 * found.settings.substeps
    substeps = [int(needed)]
    while substeps[-1] < most:
        substeps.append(max(substeps[-1] + 1, round(1.5 * substeps[-1])))
    grid = {
        "substeps": sorted({*substeps, found.settings.substeps}),
        "precision": ["float32", "float64"],
    }
    if sim.constraints:
        return {**grid, "iterations": [1, 2, 4, 8]}
    return {**grid, "integrator": ["symplectic_euler", "velocity_verlet"]}


def reference_of(name, module, frames, options, tolerance):
    """Positions at the end, or None where the answer is known."""
    if name == "pendulum":
        return None
    study = Study("test", module.build, module.settings, options, frames, "cpu")
    forces = not module.build(**options).constraints
    finest = {"integrator": "velocity_verlet"} if forces else {"iterations": 8}
    return settled(study, {"substeps": 2 * module.settings.substeps, **finest}, tolerance)


def check(name):
    """Tune a scene; its error with another seed, and its cost over the best of a full grid's.

    Of the grid too, what counts is what meets the tolerance with either seed.
    """
    tolerance, frames, options, other = SCENES[name]
    module = importlib.import_module(f"particlesim.scenes.{name}")
    found = ps.tune(module.build, tolerance, frames=frames, options=options, device="cpu")
    grid = grid_of(found, module)
    tables = [
        ps.tradeoff(
            module.build, grid, options=chosen, repeats=repeats, frames=frames,
            settings=found.settings, device="cpu",
            reference=reference_of(name, module, frames, chosen, tolerance),
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
    error, cost = check(name)
    assert error <= 1.0
    # The project's bound is 1.5; these runs take milliseconds, and so does what disturbs them.
    assert cost <= 2.0


@pytest.mark.slow
@pytest.mark.parametrize("name", list(SCENES))
def test_tunes_every_ready_scene(name):
    error, cost = check(name)
    assert error <= 1.0
    assert cost <= 1.5
