"""Costs: what counts of a disturbed clock, what is foretold, and how much faster one way is."""

import math
import subprocess
import sys

import numpy as np
import pytest

import particlesim as ps
from cases.closed_forms import harmonic, two_turns
from particlesim.accuracy.run import LEAST, Run
from particlesim.accuracy.stopwatch import Pass, undisturbed
from particlesim.accuracy.study import Study
from particlesim.accuracy.table import duration
from particlesim.accuracy.tradeoff.row import Row
from particlesim.accuracy.tradeoff.table import Tradeoff
from particlesim.scenes import dam_break, three_body


def passes(*walls, disturbed=(), cpu=None):
    """One pass for each list of wall times of blocks; (pass, block) of those that are disturbed."""
    return [
        Pass(
            list(wall), list(wall if cpu is None else cpu[k]),
            [(k, b) in disturbed for b in range(len(wall))], len(wall),
        )
        for k, wall in enumerate(walls)
    ]  # fmt: skip


def test_blocks_that_were_disturbed_do_not_count():
    own = passes([1, 9, 1], [8, 2, 1], [1, 2, 7], disturbed={(0, 1), (1, 0), (2, 2)})
    assert undisturbed(own, own) == (1 + 2 + 1, 1 + 2 + 1)


def test_a_block_takes_the_median_of_its_passes():
    own = passes([1.0], [1.2], [5.0])
    assert undisturbed(own, own) == (1.2, 1.2)


def test_what_another_repeat_saw_undisturbed_helps():
    every = passes([1, 9], [1, 2], disturbed={(0, 1)})
    assert undisturbed(every[:1], every) == (3, 3)


def test_where_all_are_disturbed_it_is_the_time_of_the_processor():
    own = passes([9], [7], disturbed={(0, 0), (1, 0)}, cpu=[[2], [2.2]])
    assert undisturbed(own, own) == pytest.approx((2.1, 2.1))
    # Of two threads at work at once, as a block that was not disturbed shows.
    own = passes([9, 1], disturbed={(0, 0)}, cpu=[[4, 2]])
    assert undisturbed(own, own) == pytest.approx((2 + 1, 6))


@pytest.mark.slow
def test_a_row_is_measured_for_long_enough():
    table = ps.tradeoff(
        harmonic, {"substeps": [1]}, frames=24, settings=two_turns(), repeats=2, device="cpu",
        error=lambda sim: 0.0,
    )  # fmt: skip
    (row,) = table.rows
    # Runs of 24 frames of some microseconds, of which 50 ms take many.
    assert len(row.costs) == len(row.cpu_costs) == 2
    assert row.cost > 0 and row.set_up > 0 and row.compiling >= 0
    study = Study("test", harmonic, two_turns(), frames=24, device="cpu")
    run = Run(study, study.plan({}))
    run.warm_up()
    run.least = LEAST
    run.advance(None, lambda: None)
    (repeat,) = run.repeats
    assert sum(sum(each.wall) for each in repeat) >= LEAST


# What was not run ------------------------------------------------------------------------------


def row(cost, error=1.0, particles=100, costs=None, **values):
    settings = ps.Settings(dt=0.5, substeps=values.get("substeps", 10))
    options = {name: value for name, value in values.items() if name == "spacing"}
    return Row(values, settings, options, error, "", costs or (cost,), particles, 0)


def of(rows):
    names = rows[0].values
    vary = {name: list(dict.fromkeys(each.values[name] for each in rows)) for name in names}
    return Tradeoff("test", "", rows, vary)


def test_the_model_foretells_what_was_not_run():
    # Frames of 3 ms and 2 ms a substep, in double twice as much, two frames a second.
    rows = [
        row(2 * k * (3e-3 + 2e-3 * n), substeps=n, precision=name)
        for n in (1, 4, 16)
        for k, name in ((1, "float32"), (2, "float64"))
    ]
    table = of(rows)
    assert table.cost_of(substeps=100, precision="float32") == pytest.approx(2 * 0.203)
    assert table.cost_of(substeps=100, precision="float64", dt=1.0) == pytest.approx(2 * 0.203)
    words = "a frame of precision=float32 costs 3 ms + 2 ms a substep, within 1 %"
    assert words in str(table)


def test_the_model_of_particles():
    rows = [
        row(2 * (1e-3 + n * (1e-4 + 1e-7 * count)), particles=count, substeps=n, spacing=spacing)
        for spacing, count in ((0.1, 1000), (0.05, 8000))
        for n in (10, 20)
    ]
    table = of(rows)
    assert table.cost_of(substeps=40, particles=64_000) == pytest.approx(2 * 0.261)
    assert "+ 100 ns a substep and particle" in str(table)


def test_a_cost_is_never_below_nothing():
    table = of([row(cost, substeps=n) for n, cost in ((1, 1.0), (2, 2.3), (4, 4.9))])
    (model,) = table.cost_models()
    assert model.frame == 0.0 and model.substep > 0 and model.off < 0.2


def test_what_cannot_be_foretold(refused):
    table = of([row(1.0, substeps=1, precision=name) for name in ("float32", "float64")])
    with refused("names must choose one model of costs"):
        table.cost_of(substeps=5)
    with refused("substeps must be a whole number"):
        table.cost_of(substeps=0)


# Which way is faster ---------------------------------------------------------------------------


def races(euler=1.0, costs=None):
    """Errors 0.01 / n and 0.01 / n^2 at costs n and 1.5 n."""
    rows = []
    for n in (1, 2, 4, 8, 16, 32):
        rows.append(row(euler * n, 0.01 / n, substeps=n, integrator="euler"))
        rows.append(row(1.5 * n, 0.01 / n**2, substeps=n, integrator="verlet"))
    return of(rows)


def test_speedups_in_words():
    table = races()
    # 1e-3 at n = 10, and at n = sqrt(10) at 1.5 a piece.
    (words,) = table.speedups()
    wanted = 10 / (1.5 * math.sqrt(10))
    assert words == (
        f"integrator=verlet is {wanted:.2g} times as fast as integrator=euler at an error of 1e-3"
    )
    assert words in str(table)
    # 1e-4: n = 100, which was not run, and 10.
    (words,) = table.speedups(1e-4)
    assert words.endswith("is 6.7 times as fast as integrator=euler at an error of 1e-4, "
                          "by extrapolation")  # fmt: skip
    assert table.speedups(1e-9) == [] and table.speedups(1.0) == []


def test_what_is_as_fast_as_told_is_said_so():
    rows = [row(0, 1.0 / n, costs=(n, 1.3 * n), substeps=n, way="a") for n in (1, 2, 4)]
    rows += [row(0, 1.0 / n, costs=(1.1 * n, 1.2 * n), substeps=n, way="b") for n in (1, 2, 4)]
    (words,) = of(rows).speedups()
    assert "costs as much as" in words and "as far as told" in words


def test_rows_near_the_front_are_marked():
    rows = [
        row(0, 1.0, costs=(0.9, 1.0, 1.1), substeps=1),
        row(0, 1.0, costs=(1.0, 1.05, 1.1), substeps=2),
        row(0, 1.0, costs=(1.9, 2.0, 2.1), substeps=3),
    ]
    table = of(rows)
    assert table.pareto() == rows[:1] and table.contenders() == [rows[1]]
    assert "~: as far as told" in str(table)


@pytest.mark.parametrize(
    "seconds, text", [(2.5, "2.5 s"), (0.0125, "12.5 ms"), (3e-6, "3 us"), (4e-9, "4 ns")]
)
def test_durations(seconds, text):
    assert duration(seconds) == text


# On a busy machine -----------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(__import__("os"), "sched_setaffinity"), reason="needs a core")
def test_costs_agree_beside_a_busy_process():
    """The same table twice, on one core that another process has half of."""
    import os

    before = os.sched_getaffinity(0)
    core = {min(before)}
    os.sched_setaffinity(0, core)
    busy = subprocess.Popen([sys.executable, "-c", "while True: pass"])
    try:
        first, second = costs_of_rows(), costs_of_rows()
    finally:
        busy.kill()
        busy.wait()
        os.sched_setaffinity(0, before)
    print(np.round(first / second - 1.0, 3))
    np.testing.assert_allclose(first, second, rtol=0.1)


def costs_of_rows():
    """Of rows of 0.1 to 10 ms a run, measured for 50 ms, and of one of 0.1 s."""
    arguments = {"error": lambda sim: 0.0, "device": "cpu"}
    tables = [
        ps.tradeoff(
            three_body.build, {"substeps": [40, 60, 80, 160]}, frames=200,
            settings=three_body.settings, **arguments,
        ),
        ps.tradeoff(
            dam_break.build, {"spacing": [0.1]}, frames=6,
            settings=dam_break.settings.replace(threads=1), **arguments,
        ),
    ]  # fmt: skip
    return np.array([[row.cost, row.cpu_cost] for table in tables for row in table.rows])
