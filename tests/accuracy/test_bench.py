"""Benchmarks: what is made of the times, and the cases themselves at small sizes."""

import math
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from particlesim.accuracy.bench.case import Case, Command, Entry, Place
from particlesim.accuracy.bench.files import cases_in, load_case, title_of
from particlesim.accuracy.bench.race import race
from particlesim.accuracy.bench.result import Result
from particlesim.accuracy.bench.row import Row
from particlesim.accuracy.stopwatch import Span, Stopwatch

FOLDER = Path(__file__).parents[1] / "benchmarks"
# Sizes at which a block is nothing. What starts processes is left out.
SMALL = {
    "cloth": {"side": 5},
    "cloth_10": {"side": 5},
    "cost": {"largest": 1000, "side": 2, "frames": 1},
    "grains": {"side": 3},
    "grains_200k": {"side": 3},
    "gravity": {"count": 20, "steps": 1},
    "gravity_tree": {"count": 20, "steps": 1},
    "lennard_jones": {"count": 500, "frames": 1},
    "lennard_jones_256k": {"count": 500, "frames": 1},
    "memory": {"count": 500, "side": 5},
    "triple_pendulum": {"frames": 1},
    "wcsph": {"side": 5},
    "wcsph_splash": {"side": 5, "start": 0.003},
    "worlds": {"worlds": 3, "frames": 1},
}
# With other programs: as many particles as the answers of a case need to agree.
WITH_PEERS = {
    "cloth": {"side": 11},
    "gravity": {"count": 500, "steps": 5},
    "gravity_tree": {"count": 500, "steps": 5},
    "grains": {"side": 8},
    "lennard_jones": {"count": 2048, "frames": 10},
    "memory": {"count": 2048, "side": 5},
    "wcsph": {"side": 16, "frames": 1},
    "wcsph_splash": {"side": 16, "start": 0.1, "frames": 1},
}
PROCESSES = {"dam_break", "startup"}


def row(walls, switches=0, work=10.0, **more):
    """A row whose blocks took so long."""
    found = Row("ours", False, "float32", 1, work=work, **more)
    switches = np.broadcast_to(switches, len(walls)).tolist()
    found.spans += [Span(*each) for each in zip(walls, walls, switches, strict=True)]
    return found


def test_a_rate_is_that_of_the_median_block():
    found = row([2.0, 1.0, 3.0, 2.5, 1.5])
    assert found.block == 2.0 and found.rate == 5.0
    assert found.spread == 0.5  # quartiles 1.5 and 2.5


def test_a_block_with_far_more_switches_does_not_count():
    found = row([1.0, 1.0, 9.0, 1.0], [4, 5, 40, 3])
    assert found.dropped == 1 and found.block == 1.0
    # Where all were disturbed alike there is nothing to drop.
    assert row([1.0, 2.0, 3.0], [300, 320, 280]).dropped == 0


def test_ratios_are_taken_round_by_round():
    # Rounds in which the machine was twice and four times as slow slow both alike.
    ours, theirs = row([1.0, 2.0, 4.0]), row([3.0, 6.0, 12.0])
    assert ours.times(theirs) == 3.0
    assert row([1.0, 2.0, 4.0], work=5.0).times(theirs) == 1.5


def test_answers_that_differ_are_told():
    case = Case(title="a case", unit="steps", ours={}, agree={"energy": 0.01})
    rows = [row([1.0], answers={"energy": energy}) for energy in (1.0, 1.005, 1.02, math.nan)]
    rows.append(row([1.0]))  # who has no such answer is not compared
    found = Result("case", case, "cpu", rows, {}, ["gmx"])
    assert not found.good
    assert [text.split(" is ")[1].split(",")[0] for text in found.differences] == ["1.02", "nan"]
    text = str(found)
    assert text.count("DIFFERENT") == 2 and "not installed: gmx" in text
    assert Result("case", case, "cpu", rows[:2], {}, []).good


def test_who_fails_is_told_and_not_counted():
    case = Case(title="a case", unit="steps", ours={})
    failed = Row("theirs", True, "float64", 1, failure="ended with exit code -11")
    found = Result("case", case, "cpu", [row([1.0]), failed], {}, [])
    assert not found.good and "theirs on 1 failed: ended with exit code -11" in str(found)
    assert found.plain["rows"][1]["failure"] == failed.failure


def test_a_stopwatch_counts_processor_time_of_its_own_process():
    watch = Stopwatch()
    while watch.read().cpu < 0.01:
        pass
    assert watch.read().wall >= 0.009 and watch.read().switches >= 0


def test_an_entry_knows_whether_what_it_needs_is_there():
    entries = [Entry(lambda place: None, needs=name) for name in ("", "numpy", "sh", "no_such")]
    assert [each.there for each in entries] == [True, True, True, False]


def test_every_case_says_what_it_is():
    found = cases_in(FOLDER)
    assert set(found) == SMALL.keys() | PROCESSES
    assert all(title_of(path) for path in found.values())


ALIKE = {"cloth_10", "grains_200k", "lennard_jones_256k"}  # others' work, in other numbers
LONG = {
    "worlds",
    "triple_pendulum",
    "cloth",
    "cost",
    "grains",
    "gravity",
    "gravity_tree",
    "lennard_jones",
    "memory",
    "wcsph",
    "wcsph_splash",
}


@pytest.mark.parametrize(
    "name",
    [pytest.param(name, marks=[pytest.mark.slow] * (name in ALIKE | LONG)) for name in SMALL],
)
def test_the_cases_run(name):
    case = load_case(FOLDER / f"{name}.py", SMALL[name])
    assert case.title and case.unit and case.ours
    answered = set()
    for entry in case.ours.values():
        running = entry.start(Place(1, "cpu"))
        running.advance()
        assert running.work > 0
        found = running.answers()
        assert all(math.isfinite(value) for value in found.values())
        answered |= found.keys()
    assert case.agree.keys() <= answered
    assert all(each.needs for each in case.peers.values())


def test_a_command_is_a_whole_process_with_an_empty_cache_if_it_is_cold():
    look = "import os, sys; sys.exit(len(os.listdir(os.environ['WARP_CACHE_PATH'])))"
    Command([sys.executable, "-c", look], cold=True).advance()
    with pytest.raises(subprocess.CalledProcessError):
        Command([sys.executable, "-c", "raise SystemExit(3)"]).advance()


@pytest.mark.slow
@pytest.mark.parametrize("name", WITH_PEERS)
def test_other_programs_find_the_same(name):
    """Those that are installed; at sizes at which the cases' tolerances hold."""
    asked = {"threads": [1], "device": "cpu", "peers": True, "repeats": 1}
    found = race(FOLDER / f"{name}.py", WITH_PEERS[name], **asked)
    if not found.versions:
        pytest.skip(f"none is installed of {', '.join(found.missing)}")
    assert found.good, str(found)


@pytest.mark.slow
def test_whole_processes_run():
    for name, options in {"dam_break": {"frames": 2, "spacing": 0.1}, "startup": {}}.items():
        case = load_case(FOLDER / f"{name}.py", options)
        for entry in case.ours.values():
            running = entry.start(Place(1, "cpu"))
            running.advance()
            assert all(math.isfinite(value) for value in running.answers().values())


def test_a_case_knows_its_options():
    with pytest.raises(TypeError, match="side"):
        load_case(FOLDER / "cloth.py", {"sid": 3})
