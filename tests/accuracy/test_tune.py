"""Tuning: the cheapest settings under a tolerance."""

import math

import numpy as np
import pytest

import particlesim as ps
from cases.closed_forms import along, harmonic, off_harmonic, two_turns
from particlesim.accuracy.observables import observable
from particlesim.accuracy.refining import settled
from particlesim.accuracy.study import Study
from particlesim.accuracy.tune.bench import Bench
from particlesim.accuracy.tune.report import line


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


# References


def test_reference_is_exact_to_a_tenth_of_the_tolerance():
    study = Study("test", oscillator, ps.Settings(dt=0.1), frames=4, device="cpu")
    for integrator in ("symplectic_euler", "velocity_verlet"):
        seen = [observable("test", "position")]
        found = settled(study, {"substeps": 4, "integrator": integrator}, 1e-3, seen)
        x = found.values[0][0][-1]
        assert abs(x[1, 0] - (1 + 0.2 * math.cos(4.0))) < 1e-4
        assert found.own_error < 1e-4


def test_a_reference_that_does_not_settle_is_refused(refused):
    rng = np.random.default_rng(0)

    def chaos():
        scene = ps.Scene()
        scene.add_particles(rng.random((3, 3)), mass=1.0)  # another start each time
        scene.add_interaction(ps.Gravity(softening=0.1))
        return scene

    study = Study("test", chaos, ps.Settings(dt=0.1), frames=2, device="cpu")
    with refused("reference must be known to 1e-07, a tenth of the tolerance"):
        settled(study, {"substeps": 2}, 1e-6, [observable("test", "position")])


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
    bench = Bench(study, swung)
    first = bench.trial({"substeps": 5})
    assert bench.trial({"substeps": 5}) is first and len(bench.trials) == 1
    failed = bench.trial({"substeps": 1, "dt": 0.4})  # omega h = 4
    assert failed.error > 1


# Over time --------------------------------------------------------------------------------------


def slow(sim):
    """v less its closed form -sin t."""
    return sim.velocity[0, 0] + math.sin(sim.time)


@pytest.mark.parametrize(
    "arguments, error",
    [({"by": off_harmonic}, off_harmonic), ({}, off_harmonic), ({"observe": "velocity"}, slow)],
)
def test_it_holds_at_every_frame_and_longer(arguments, error):
    frames = 24
    found = ps.tune(
        harmonic, 1e-4, frames=frames, settings=two_turns(frames), device="cpu", **arguments
    )
    # At the end of two whole periods a single step of a frame would do, for the first of these.
    longer = math.ceil(1.13 * frames)
    assert along(harmonic, found.settings, longer, error).max() <= 1e-4
    assert found.longer == pytest.approx(longer / frames - 1) and found.margin == 0.8
    # Verlet's phase is off by h^2 t / 24: h = sqrt(24e-4 / 13.6) for 1e-4, 40 a frame. (Symplectic
    # Euler's velocity too is of second order, where it starts at rest.)
    assert 38 <= found.settings.substeps <= 60


def test_an_answer_that_is_known_at_the_end_only_is_taken_there():
    shown = []

    def back(sim):
        shown.append(sim.frame)
        return sim.position[0, 0] - 1.0

    found = ps.tune(harmonic, 1e-4, by=back, frames=24, settings=two_turns(), device="cpu")
    # After two periods it is back, and half way too. In between it is no error at all. Longer than
    # that it is as wrong, of 13 % more.
    assert set(shown) > {24, 28}
    assert found.error <= 1e-4 and found.settings.substeps <= 20


def test_an_answer_that_fails_elsewhere():
    def at_the_end(sim):
        if sim.frame != 24:
            raise ValueError("not known")
        return off_harmonic(sim)

    found = ps.tune(harmonic, 1e-4, by=at_the_end, frames=24, settings=two_turns(), device="cpu")
    assert found.error <= 1e-4

    def never(sim):
        raise ValueError("not known at all")

    with pytest.raises(ValueError, match="not known at all"):
        ps.tune(harmonic, 1e-4, by=never, frames=24, settings=two_turns(), device="cpu")


# In a time --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "arguments", [{"by": off_harmonic}, pytest.param({}, marks=pytest.mark.slow)]
)
def test_the_best_that_a_time_buys(arguments):
    found = ps.tune(
        harmonic, budget="20 ms", frames=24, settings=two_turns(), device="cpu", **arguments
    )
    # A substep takes microseconds, also where others share the machine: of hundreds in a frame the
    # second order leaves h^2 t / 24 at most; symplectic Euler's first order would leave h / 2.
    assert found.settings.integrator == "velocity_verlet"
    assert 8 <= found.settings.substeps <= 8000
    h = found.settings.substep
    assert found.error <= 1.2 * h**2 * 13.7 * math.pi / 24
    assert found.budget == 0.02 and found.seconds > 0.0
    assert "a run of" in str(found) and "of 0.02 s" in str(found)


def test_budgets(refused):
    with refused("budget must be a number and a unit, ms, s, min, h, got 'soon'"):
        tuned(budget="soon")
    with refused("budget must be above 0"):
        tuned(budget=0.0)
    with refused("budget must suffice for the fewest substeps that are stable"):
        tuned(budget=1e-7)
