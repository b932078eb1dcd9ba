"""Faults and controls: nothing wrong goes by in silence, and what is right is left alone.

A fault ends right, told by a warning that names its part, or refused by such an error. A control
ends right, and without a word.
"""

import pytest

from cases.faults import automatic, controls, parts, ready, starts, steps
from cases.faults.judge import REFUSED, RIGHT, TOLD, verdict

FAULTS = [row for each in (steps, starts, parts) for row in each.rows()]
AUTOMATIC = list(automatic.rows())
CONTROLS = [*ready.rows(), *controls.rows()]


def cases(rows):
    """The rows as parameters of a test, by name."""
    for row in rows:
        marks = [pytest.mark.slow] if row.slow else []
        yield pytest.param(row, id=row.name, marks=marks)


@pytest.mark.parametrize("row", cases(FAULTS))
def test_a_fault_does_not_go_by_in_silence(row):
    found, note = verdict(row)
    assert found in (RIGHT, TOLD, REFUSED), note


@pytest.mark.parametrize("row", cases(CONTROLS))
def test_what_is_right_is_left_alone(row):
    found, note = verdict(row)
    assert found == RIGHT, note


@pytest.mark.parametrize("row", cases(AUTOMATIC))
def test_a_step_of_its_own_choice_is_right_or_stops(row):
    """No word is enough here: who asks for a step is not to be told of another."""
    found, note = verdict(row)
    assert found in (RIGHT, REFUSED), note


def test_the_tables_are_whole():
    names = [row.name for row in (*FAULTS, *AUTOMATIC, *CONTROLS)]
    assert len(set(names)) == len(names)
    assert len(FAULTS) >= 110 and len(CONTROLS) >= 67
