"""Checks of arguments: what passes, and errors in one form."""

import numpy as np
import pytest
import warp as wp

from particlesim import validate


@pytest.mark.parametrize("value", [3, 3.0, np.float32(3), np.array(3.0)])
def test_numbers_in_whatever_guise(value):
    assert validate.number("Owner", "argument", value, above=0) == 3.0


@pytest.mark.parametrize(
    ("value", "bounds", "says"),
    [
        (np.nan, {}, "must be finite, got nan"),
        (np.inf, {}, "must be finite, got inf"),
        (-1, {"minimum": 0.0, "unit": "kg"}, r"at least 0 \[kg\], got -1.0"),
        (0, {"above": 0.0}, "above 0, got 0.0"),
        (3, {"maximum": 2.0}, "at most 2, got 3.0"),
        ("heavy", {}, "must be a number, got 'heavy'"),
        (None, {}, "got None"),
        ([1, 2], {}, r"got \[1, 2\]"),
        ("x" * 200, {}, r"got 'x{76}\.\.\.;"),  # long values are cut
    ],
)
def test_numbers_refused(value, bounds, says, refused):
    with refused(says):
        validate.number("Owner", "argument", value, **bounds)


def test_infinity_where_it_is_allowed():
    assert validate.number("Owner", "argument", np.inf, infinite=True) == np.inf


@pytest.mark.parametrize("value", [True, 1.0, "1", -1, None])
def test_whole_numbers_refused(value, refused):
    with refused("whole number of at least 0"):
        validate.whole("Owner", "argument", value)


def test_rows_are_broadcast():
    np.testing.assert_array_equal(validate.rows("O", "a", 2, 3, None), [2, 2, 2])
    np.testing.assert_array_equal(validate.rows("O", "a", (1, 2, 3), 2, 3), [[1, 2, 3]] * 2)
    assert validate.rows("O", "a", [], None, 3).shape == (0, 3)


def test_rows_are_copies():
    given = np.ones((2, 3))
    validate.rows("O", "a", given, 2, 3)[:] = 0
    assert given.all()


def test_warp_arrays_are_taken():
    given = wp.array([[1.0, 2.0, 3.0]], dtype=wp.vec3, device="cpu")
    np.testing.assert_array_equal(validate.rows("O", "a", given, None, 3), [[1, 2, 3]])


@pytest.mark.parametrize(
    ("value", "says"),
    [
        ([1, 2], r"have shape \(3,\) or \(4, 3\), got \(2,\)"),
        (np.zeros((3, 3)), r"got \(3, 3\)"),
        ([[0, 0, np.nan]] * 4, r"argument\[0, 2\] must be finite, got nan"),
        ([[0, 0], [0]], "must be numbers"),
    ],
)
def test_rows_refused(value, says, refused):
    with refused(says):
        validate.rows("Owner", "argument", value, 4, 3)


def test_names_refused_with_what_was_meant(refused):
    with refused("must be one of graph, threads, got 'thread'; did you mean 'threads'"):
        validate.choice("Owner", "argument", "thread", ("graph", "threads"))
    with refused("must be one of stiffness, got 'stifness'; did you mean", kind=TypeError):
        validate.known("Owner", ["stifness"], ["stiffness"])
    with refused("one of \\(none\\), got 'k'; choose one of these", kind=TypeError):
        validate.known("Owner", ["k"], [])
