"""Chance: seeds as worlds of one batch, what can be told apart, and orders that are none."""

import numpy as np
import pytest

import particlesim as ps
from cases.closed_forms import harmonic, off_harmonic, two_turns
from particlesim.accuracy.statistics import Interval
from particlesim.accuracy.tradeoff.row import Row
from particlesim.accuracy.tradeoff.table import Tradeoff


def seeded(seed=0):
    return harmonic(seed=seed)


def sweep(build=seeded, vary=None, **arguments):
    arguments = {
        "frames": 24, "settings": two_turns(), "repeats": 1, "device": "cpu", **arguments,
    }  # fmt: skip
    return ps.tradeoff(build, vary or {"substeps": [2, 4, 8]}, **arguments)


@pytest.mark.parametrize(
    "by", [{"error": off_harmonic}, {"error": off_harmonic, "over": "max"}, {},
           {"observe": "energy", "over": "max"}, {"error": "energy"}],
)  # fmt: skip
def test_seeds_are_worlds_that_go_as_they_go_alone(by):
    reference = {} if "error" in by else {"reference": {"substeps": 100}}
    table = sweep(seeds=8, **by, **reference)
    assert table.seeds == 8 and table.rows[0].particles == 1
    for seed in (0, 5):
        alone = sweep(options={"seed": seed}, **by, **reference)
        for row, single in zip(table.rows, alone.rows, strict=True):
            if by.get("error") == "energy":  # of a scale that is world by world, as the error
                assert row.errors[seed] == pytest.approx(single.error, rel=1e-9)
            else:
                assert row.errors[seed] == single.error
    assert all(row.error == np.median(row.errors) for row in table.rows)


def test_seeds_by_name():
    table = sweep(seeds=[7, 3], error=off_harmonic)
    assert table.rows[0].errors[1] == sweep(options={"seed": 3}, error=off_harmonic).rows[0].error


def test_the_interval_of_a_median():
    table = sweep(seeds=12, error=off_harmonic, over="max")
    # Amplitudes lie between 0.9 and 1, and errors are as large as these.
    low, high = table.rows[0].interval
    assert 0.9 <= low / table.rows[0].errors[0] <= high / table.rows[0].errors[0] <= 1 / 0.9
    assert low < table.rows[0].error < high
    assert "95 %" in str(table) and "12 seeds" in str(table)


def test_the_order_of_seeds():
    table = sweep(seeds=6, error=off_harmonic, over="max")
    fit = table.order_fit("substeps")
    assert fit.interval().low < 2.0 < fit.interval().high + 0.05
    assert table.orders()["substeps"] == pytest.approx(2.0, abs=0.05)


def test_what_one_world_lacks_is_said():
    with pytest.raises(AttributeError, match="run is not to be had of one world of several"):
        sweep(seeds=2, error=lambda sim: sim.run(1))


# What is told apart ----------------------------------------------------------------------------


def row(errors, cost=1.0, **values):
    settings = ps.Settings(dt=1.0, substeps=values.get("substeps", 1))
    errors = tuple(float(each) for each in errors)
    return Row(values, settings, {}, float(np.median(errors)), "", (cost,), 1, 0, errors=errors)


def noise(seeds, level, seed):
    return level * np.random.default_rng(seed).lognormal(0.0, 0.5, seeds)


def table_of(rows, **about):
    values = [each["substeps"] for each in rows]
    return Tradeoff("test", "", rows, {"substeps": values}, **about)


def test_no_front_and_no_order_of_noise():
    rows = [row(noise(10, 1.0, n), cost=n, substeps=n) for n in (1, 2, 4, 8)]
    table = table_of(rows, seeds=10)
    assert table.pareto() == rows[:1] and table.orders() == {}
    text = str(table)
    assert "no front and no order: all errors differ by chance only" in text
    assert "errors cannot be told apart (95 %): " in text and "*" not in text.split("\n\n")[1]


def test_noise_that_is_shared_by_seeds_does_not_hide_a_difference():
    common = noise(10, 1.0, 0)
    rows = [row(common / n, cost=n, substeps=n) for n in (1, 2, 4)]
    table = table_of(rows, seeds=10)
    # Their intervals overlap, seed by seed each is half of the one before.
    assert rows[0].interval.low < rows[1].interval.high
    assert table.pareto() == rows and table.orders()["substeps"] == pytest.approx(1.0)


def test_few_seeds_have_no_interval_of_a_median():
    assert row([1, 2, 3]).interval == Interval(-np.inf, np.inf)
    assert row([1.0]).interval == Interval(1.0, 1.0)


# Orders that are none --------------------------------------------------------------------------


@pytest.mark.parametrize(
    "errors",
    [(2.7e-3, 5e-6, 1.8e-4), (4.3e-3, 6e-4, 2.7e-4, 4.9e-4), (1e-3, 3e-5, 8e-4, 2e-5, 5e-4)],
)
def test_an_order_off_any_line_is_said_to_be_none(errors):
    rows = [row([e], cost=n + 1, substeps=2**n) for n, e in enumerate(errors)]
    table = table_of(rows)
    assert table.orders() == {} and "no order of substeps: " in str(table)
    assert not table.order_fit("substeps").interval().low > 0


def test_an_order_comes_with_its_fit():
    rows = [row([4.0**-n * (1 + 0.01 * (-1) ** n)], cost=n + 1, substeps=2**n) for n in range(6)]
    table = table_of(rows)
    fit = table.order_fit("substeps")
    # Of residuals of 1 % over five halvings: 0.01 / (ln 2 sqrt(17.5)) = 0.0034, to a few tenths.
    assert abs(fit.value - 2.0) < 0.01 and 0.002 < fit.error < 0.006
    assert fit.off == pytest.approx(1.01, abs=0.005)
    assert "fitted within 0.0" in str(table) and "off the line by 1." in str(table)


@pytest.mark.parametrize(
    "errors, said",
    [((0.77, 0.765, 0.76, 0.745), True), ((1.0, 1.05, 1.1, 1.1), True), ((1.0,) * 4, True),
     ((1e-12, 2e-12, 1e-12, 1e-12), False), ((0.4, 0.1, 0.025, 0.00625), False)],
)  # fmt: skip
def test_a_drift_of_what_is_not_conserved_is_said_to_be_none(errors, said):
    rows = [row([e], cost=n + 1, substeps=2**n) for n, e in enumerate(errors)]
    text = str(table_of(rows, conserved=True))
    assert ("error does not fall with substeps: not conserved here" in text) == said
    assert ("; no front" in text) == said


def test_energy_of_a_damped_scene():
    def damped():
        scene = harmonic()
        scene.add_interaction(ps.Drag(linear=0.5))
        return scene

    table = sweep(damped, {"substeps": [4, 8, 16]}, error="energy")
    assert "error does not fall with substeps: not conserved here" in str(table)


# Averages over time ----------------------------------------------------------------------------


def gas(seed=0, count=30):
    rng = np.random.default_rng(seed)
    side = (count / 0.3) ** (1 / 3)
    scene = ps.Scene(periodic=((0, 0, 0), (side,) * 3))
    x = ps.sample.random(
        (0, 0, 0), (side,) * 3, count, seed=seed, minimum_distance=1.0, periodic=True
    )
    scene.add_particles(x, velocity=rng.normal(0, 1.2, (count, 3)))
    scene.add_interaction(ps.LennardJones(cutoff=2.0))
    return scene


@pytest.mark.slow
def test_averages_of_a_chaotic_scene_are_held_against_chance():
    settings = ps.Settings(dt=0.05, integrator="velocity_verlet", precision="float64")
    table = ps.tradeoff(
        gas, {"substeps": [10, 20]}, observe="virial", over="mean", settings=settings,
        frames=200, seeds=4, repeats=1, device="cpu",
    )  # fmt: skip
    # After some ten time units runs of different steps know nothing of each other: their averages
    # differ by chance, by what the memory of their differences leaves them.
    assert all(row.error < 2 * row.parts["chance"] for row in table.rows)
    assert "errors cannot be told apart" in str(table) and table.orders() == {}
