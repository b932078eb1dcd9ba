"""Measuring: numbers with their errors, what they are made of, and refusals."""

import math

import numpy as np
import pytest

import particlesim as ps
from cases.measured import aside, plucked, spring, string
from cases.measured_many import gas, gases, jets
from particlesim.accuracy.measure import over
from particlesim.accuracy.observables import sizes

VERLET = "velocity_verlet"


def measure(build=spring, observe=aside, error=1e-3, **arguments):
    arguments = {"settings": ps.Settings(dt=0.05), "frames": 9, "device": "cpu", **arguments}
    return ps.measure(build, observe, error, **arguments)


# Time


@pytest.mark.parametrize(("integrator", "order"), [("symplectic_euler", 1), (VERLET, 2)])
def test_limit_of_no_step(integrator, order):
    found = measure(settings=ps.Settings(dt=0.05, integrator=integrator), error=1e-4)
    assert found.low <= 1 + 0.2 * math.cos(10 * 0.45) <= found.high
    assert found.order == order
    assert found.error <= 1e-4
    assert found.error == pytest.approx(sum(part.error for part in found.parts.values()))
    assert found.cost == sum(part.cost for part in found.parts.values())


def test_order_is_found_where_the_nominal_one_does_not_hold():
    # However the integrator treats a damped spring: what is found is a limit, and it is right.
    g, w = 1.5, math.sqrt(100 - 1.5**2)
    wave = math.exp(-g * 0.45) * (math.cos(w * 0.45) + g / w * math.sin(w * 0.45))
    settings = ps.Settings(dt=0.05, integrator=VERLET)
    found = measure(error=2e-4, options={"damping": 3.0}, settings=settings)
    assert found.low <= 1 + 0.2 * wave <= found.high


def test_same_arguments_give_the_same_number():
    assert measure().value == measure().value


def test_more_confidence_and_less_error_are_kept():
    wide = ps.measure(*_gas(), 0.5, 0.8, frames=2, settings=ps.Settings(dt=2.0), device="cpu")
    assert wide.confidence == 0.8
    fine = measure(error=1e-6, settings=ps.Settings(dt=0.05, integrator=VERLET))
    assert fine.error <= 1e-6
    assert fine.low <= 1 + 0.2 * math.cos(10 * 0.45) <= fine.high


def _gas():
    case = gases(0)
    return case.build, case.observe


@pytest.mark.slow
def test_chaos_of_one_start_is_refused(refused):
    def three():
        scene = ps.Scene()
        scene.add_particles(
            [(0, 0, 0), (1, 0, 0), (0.3, 0.8, 0)], velocity=[(0, 0, 0), (0, 0.5, 0), (-0.5, 0, 0.1)]
        )
        scene.add_interaction(ps.Gravity(G=1.0, softening=0.1))
        return scene

    with refused("time must converge"):
        measure(three, lambda sim: sim.position[0, 0], 1e-4, frames=400,
                settings=ps.Settings(dt=0.1, integrator=VERLET))  # fmt: skip


def test_budget_is_kept(refused):
    with refused("budget must suffice for time"):
        measure(budget=1e-9)


# Over


def test_over_a_run():
    # The start and all frames, of 1 + 0.2 cos(10 t) over a whole period and more.
    times = 0.05 * np.arange(31)
    x = 1 + 0.2 * np.cos(10 * times)
    settings = ps.Settings(dt=0.05, integrator=VERLET)
    for name, truth in (("max", x.max()), ("rms", math.sqrt((x**2).mean()))):
        found = measure(over=name, frames=30, settings=settings)
        assert found.low <= truth <= found.high
    found = measure(over=lambda t, v: float(v.min()), frames=30, settings=settings)
    assert found.low <= x.min() <= found.high


def test_period_between_frames():
    times = 0.07 * np.arange(60)
    found = over.period(times, 3.0 + np.sin(5 * times + 1))
    # The cubic's error is at most 3/128 h^4 5^4 = 4e-4 of the amplitude, 7e-5 of time, at a
    # crossing; two of them over three periods.
    assert found == pytest.approx(2 * math.pi / 5, abs=2 * 7e-5 / 3)


def test_frames_too_few_for_a_period_are_refused(refused):
    with refused("frames must hold two upward crossings"):
        measure(over="period", frames=12)
    with refused("settings.dt must be short enough"):
        measure(over="period", frames=60, error=1e-7, settings=ps.Settings(dt=0.15))


@pytest.mark.slow
def test_average_over_time_leaves_the_start_out():
    settings = ps.Settings(dt=0.25, integrator=VERLET)

    def share(sim):
        v = sim.velocity.astype(float) ** 2
        return float(v[:, 0].sum() / v.sum())

    found = measure(jets, share, 0.02, over="mean", frames=60, settings=settings,
                    options={"seed": 3})  # fmt: skip
    assert found.low <= 1 / 3 <= found.high
    assert "of time" in found.parts["chance"].how


def test_no_steady_state_is_refused(refused):
    def flight():
        scene = ps.Scene()
        scene.add_particles([(0, 0, 0)], velocity=(1, 0, 0))
        return scene

    with refused("frames must reach a steady state"):
        measure(flight, lambda sim: sim.position[0, 0], over="mean", frames=20)


# Space


def test_limit_of_a_resolution():
    arguments = dict(over="period", frames=90, settings=ps.Settings(dt=0.06, integrator=VERLET))
    found = measure(string, plucked, 5e-3, **arguments)
    assert found.low <= 2.0 <= found.high
    assert found.parts["space"].error > 0
    assert found.options["particles"] > 6
    # Without: six pieces have the frequency 2 n sin(pi / 2 n) / pi of the string.
    found = measure(string, plucked, 1e-3, space=None, **arguments)
    truth = 2.0 * math.pi / (12 * math.sin(math.pi / 12))
    assert found.low <= truth <= found.high


def test_resolutions_are_numbers_of_build(refused):
    with refused("space must be one of"):
        measure(space="spacing")
    with refused("space must name a number above 0"):
        measure(options={"damping": 0.0}, space="damping")


# Chance


def test_seeds_are_added_until_they_suffice():
    build, observe = _gas()
    settings = ps.Settings(dt=2.0)
    some = ps.measure(build, observe, 0.3, frames=2, settings=settings, device="cpu")
    more = ps.measure(build, observe, 0.1, frames=2, settings=settings, device="cpu")
    assert more.error <= 0.1 < some.error <= 0.3
    # (0.3 / 0.1)^2 times as many, by half to either side for what few seeds say of their scatter.
    assert 4 < more.worlds / some.worlds < 18
    assert more.options["seed"] == 0


def test_a_seed_that_is_given_is_the_only_one():
    build, observe = _gas()
    found = ps.measure(build, observe, 0.1, frames=2, settings=ps.Settings(dt=2.0), device="cpu",
                       options={"seed": 4})  # fmt: skip
    assert found.parts["chance"].error == 0.0
    assert found.worlds == 1


def test_seeds_are_a_batch_only_where_worlds_are_told_apart():
    # A number of the whole simulation is no number of a world: then each seed runs by itself.
    build, observe = _gas()
    arguments = dict(frames=2, settings=ps.Settings(dt=2.0), device="cpu")
    batch = ps.measure(build, observe, 0.3, **arguments)
    alone = ps.measure(build, lambda sim: float(observe(sim)[0]), 0.3, **arguments)
    assert alone.value == pytest.approx(batch.value, rel=1e-12)
    assert alone.work == batch.work


# Arguments and results


def test_ready_observables():
    sim = ps.Simulation([gas(seed=0), gas(seed=1)], device="cpu")
    now = sim.diagnostics()
    for name, truth in {
        "energy": now.energy, "kinetic": now.kinetic, "potential": now.potential,
        "momentum": np.linalg.norm(now.momentum, axis=1), "temperature": now.kinetic / 45,
        "pressure": now.kinetic / 12,
    }.items():  # fmt: skip
        np.testing.assert_allclose(sizes("measure", name)(sim), truth, rtol=1e-12)


def test_arguments_that_do_not_fit_are_refused(refused):
    with refused("observe must be one of energy"):
        measure(observe="enrgy")
    with refused("observe must return a number"):
        measure(observe=lambda sim: sim.position)
    with refused("pressure must be of a scene that is periodic on all axes"):
        measure(observe="pressure")
    with refused("over must be one of final"):
        measure(over="median")
    with refused("error must be above 0"):
        measure(error=0.0)
    with refused("confidence must be at most"):
        measure(confidence=1.0)


def test_what_is_not_finite_is_refused(refused):
    with refused("time must converge .* not finite"):
        measure(observe=lambda sim: math.nan)


def test_report_says_number_parts_and_plain_run():
    found = measure(error=1e-4)
    text = str(found)
    for word in (
        "aside, final of",
        "(95 %: ",
        "time",
        "space",
        "chance",
        "round-off",
        "sum",
        "extrapolated",
        "float32 differs by",
        "enough: ps.Settings(dt=0.05, substeps=",
    ):
        assert word in text
    low, _, high = text.partition("(95 %: ")[2].partition(")")[0].partition(" to ")
    assert float(low) == pytest.approx(found.low)
    assert float(high) == pytest.approx(found.high)


def test_a_number_has_as_many_digits_as_its_error_leaves():
    found = measure(error=1e-4)
    value, _, error = found.number.partition(" +- ")
    assert abs(float(value) - found.value) <= 0.05 * found.error
    assert len(error.replace(".", "").lstrip("0")) == 2


def test_progress_tells_of_every_run():
    lines = []
    measure(progress=lines.append)
    assert lines[0].startswith("time: 9 frames, precision=float64, substeps=1")
    assert lines[-1].startswith("round-off: 9 frames, precision=float32")


def test_float32_is_enough_where_it_is():
    assert measure(error=1e-3).settings.precision == "float32"
    fine = measure(error=1e-8, settings=ps.Settings(dt=0.05, integrator=VERLET), frames=3)
    assert fine.settings.precision == "float64"
