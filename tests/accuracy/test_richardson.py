"""Richardson's extrapolation: limits, orders, and how far they are believed."""

import math

import numpy as np
import pytest

from particlesim.accuracy.measure.richardson import found_order, limit

HALVED = 0.1 / 2.0 ** np.arange(5)


@pytest.mark.parametrize("p", [1, 2, 4])
def test_a_power_has_its_limit_and_its_order(p):
    found = limit(HALVED[:3], 3.0 + 2.0 * HALVED[:3] ** p, nominal=p)
    assert found.value == pytest.approx(3.0, abs=1e-10)
    assert found.order == p
    # What is left is held to be a tenth of the last correction, at least.
    assert found.bias == pytest.approx(2.0 * HALVED[2] ** p, rel=1e-6)
    assert found.unsure == pytest.approx(0.1 * found.bias, rel=1e-3)


def test_steps_need_not_be_halved():
    steps = 1.0 / np.array([10, 14, 21, 33])
    found = limit(steps, 1.0 - steps**2, nominal=2)
    assert found.value == pytest.approx(1.0, abs=1e-9)
    assert found_order(steps, np.diff(-(steps**2))) == pytest.approx(2.0, abs=1e-6)


@pytest.mark.parametrize(("p", "q"), [(1, 2), (2, 3), (2, 4)])
def test_the_next_term_is_within(p, q):
    rng = np.random.default_rng(0)
    for _ in range(200):
        a, b = rng.normal(size=2)
        steps = 0.3 * HALVED / HALVED[0]
        found = limit(steps, a * steps**p + b * steps**q, nominal=p)
        assert abs(found.value) <= found.unsure * (1 + 1e-9)


def test_an_order_that_is_not_the_nominal_one_takes_two_more_values():
    values = HALVED**1.0
    assert limit(HALVED[:3], values[:3], nominal=2).order is None
    assert limit(HALVED, values, nominal=2).order == 1


def test_what_follows_no_order_is_unsure_by_three_times_its_change():
    found = limit(HALVED, [1.0, 1.3, 0.9, 1.05, 1.0], nominal=2)
    assert found.order is None
    assert found.value == 1.0
    assert found.unsure == pytest.approx(3 * 0.075)  # half of the change before is more than 0.05


def test_what_does_not_change_has_converged():
    found = limit(HALVED[:3], [2.0, 2.0, 2.0])
    assert found.order == math.inf
    assert found.unsure < 1e-12
    assert found.step_for(1e-3) == math.inf  # any will do


def test_two_values_say_nothing():
    assert limit(HALVED[:2], [1.0, 1.0]).unsure == math.inf


def test_the_step_for_an_error_has_that_error():
    found = limit(HALVED[:3], 1.0 + HALVED[:3] ** 2, nominal=2)
    step = found.step_for(1e-5)
    assert step**2 == pytest.approx(1e-5, rel=1e-6)
    assert found.off_at(step) == pytest.approx(1e-5, rel=1e-6)
