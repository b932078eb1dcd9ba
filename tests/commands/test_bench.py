"""The command ``particlesim bench``."""

import json

import pytest

from particlesim import cli

CASE = '''
"""Counting, which takes no time.

More about it.
"""
from particlesim.accuracy.bench.case import Case, Entry, Running


class Counting(Running):
    def __init__(self, place, by, fails=False):
        self.count, self.by, self.fails, self.work = 0, by, fails, place.threads

    def advance(self):
        if self.fails and self.count >= 3:
            raise ValueError("cannot count on")
        self.count += 1
        print("counting")
        return 0.5 / self.by

    def answers(self):
        return {"count": self.count}


def case(by=2, fails=False, off=False):
    other = Other if off else Counting
    return Case(
        title="counting", unit="counts",
        ours={"one": Entry(lambda place: Counting(place, 1))},
        peers={
            "faster": Entry(lambda place: other(place, by, fails), "exact", "json"),
            "absent": Entry(Counting, needs="no_such_program"),
        },
        agree={"count": 0.1}, repeats=4,
    )


class Other(Counting):
    def answers(self):
        return {"count": 2 * self.count}
'''


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "counting.py").write_text(CASE)
    (tmp_path / "no_case.py").write_text('"""A helper of cases."""\n')
    return str(tmp_path)


def test_cases_are_listed_without_running(folder, capsys):
    assert cli.main(["bench", "--list", "--folder", folder]) == 0
    assert capsys.readouterr().out == "counting  Counting, which takes no time.\n"


def test_a_race_with_a_peer_is_a_table_and_a_file(folder, tmp_path, capsys):
    file = tmp_path / "found.json"
    words = ["bench", "counting", "--folder", folder, "--peers", "--threads", "1", "--json", file]
    assert cli.main([str(word) for word in words]) == 0
    out = capsys.readouterr().out
    assert "counting: counting; cpu" in out and "Python" in out
    assert "the answers agree: count within 10 %" in out
    assert "not installed: no_such_program" in out
    written = json.loads(file.read_text())
    assert written["machine"]["cores"] >= 1
    one, faster = written["cases"][0]["rows"]
    # Three blocks to run warm and four that count; who has a clock of his own is believed.
    assert one["answers"] == faster["answers"] == {"count": 7.0}
    assert one["wall"] == [0.5] * 4 and one["rate"] == 2.0 and faster["rate"] == 4.0
    assert [each["peer"] for each in (one, faster)] == [False, True]


def test_who_differs_or_fails_ends_it_with_1(folder, capsys):
    words = ["bench", "--folder", folder, "--peers", "--threads", "1", "--repeats", "1"]
    assert cli.main([*words, "--set", "off=True"]) == 1
    assert "DIFFERENT: count of faster on 1 is 8, 4 of one" in capsys.readouterr().out
    assert cli.main([*words, "--set", "fails=True"]) == 1
    assert "faster on 1 failed: ValueError: cannot count on" in capsys.readouterr().out


def test_what_cannot_be_is_one_line(folder, tmp_path, particlesim_fails):
    words = ("bench", "--folder", folder)
    assert "NAME must be one of counting" in particlesim_fails(2, *words, "nothing")
    assert "--threads must be numbers from 1" in particlesim_fails(2, *words, "--threads", "0")
    line = particlesim_fails(2, *words, "--json", str(tmp_path / "found.txt"))
    assert ".json" in line
    (tmp_path / "empty").mkdir()
    line = particlesim_fails(2, "bench", "--folder", str(tmp_path / "empty"))
    assert "--folder must hold case files" in line
    assert "by" in particlesim_fails(2, *words, "--set", "buy=1")
