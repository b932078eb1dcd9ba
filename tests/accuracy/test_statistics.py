"""Statistics of runs, against closed forms and published tables, and in coverage."""

import math

import numpy as np
import pytest

from particlesim.accuracy import statistics


def ar1(phi, count, rng, rows=1):
    """Series of x_t = phi x_{t-1} + noise, of variance 1, from its steady state."""
    x = np.empty((rows, count))
    x[:, 0] = rng.normal(size=rows)
    noise = math.sqrt(1 - phi**2) * rng.normal(size=(rows, count))
    for t in range(1, count):
        x[:, t] = phi * x[:, t - 1] + noise[:, t]
    return x


def binomial_bounds(count, p, sigmas=3.5):
    """Hits that are within so many standard deviations of count p."""
    spread = sigmas * math.sqrt(count * p * (1 - p))
    return count * p - spread, count * p + spread


# Student's t


@pytest.mark.parametrize(
    ("confidence", "degrees", "t"),
    [
        # Two-sided quantiles: Abramowitz and Stegun 1964, table 26.10 (three decimals).
        (0.95, 1, 12.706), (0.95, 2, 4.303), (0.95, 3, 3.182), (0.95, 5, 2.571),
        (0.95, 10, 2.228), (0.95, 30, 2.042), (0.95, 120, 1.980), (0.95, math.inf, 1.960),
        (0.99, 1, 63.657), (0.99, 4, 4.604), (0.99, 20, 2.845), (0.9, 7, 1.895), (0.5, 1, 1.0),
        (0.998, 3, 10.214), (0.8, 60, 1.296),
    ],
)  # fmt: skip
def test_student_is_that_of_the_tables(confidence, degrees, t):
    assert statistics.student(confidence, degrees) == pytest.approx(t, abs=6e-4)


def test_student_has_the_closed_forms_of_one_and_two_degrees():
    # P(|T| < t) = 2/pi atan(t) of one; t / sqrt(2 + t^2) of two.
    for p in (0.1, 0.5, 0.9, 0.99, 0.9999):
        one, two = math.tan(0.5 * math.pi * p), p * math.sqrt(2 / (1 - p * p))
        assert statistics.student(p, 1) == pytest.approx(one, rel=1e-9)
        assert statistics.student(p, 2) == pytest.approx(two, rel=1e-9)


def test_student_between_whole_degrees_and_at_the_ends():
    # It falls with the degrees of freedom, and joins the normal distribution's where that begins.
    t = [statistics.student(0.95, k) for k in (0.4, 1, 1.5, 2, 7.3, 8, 1e3, 1e5)]
    assert t == sorted(t, reverse=True)
    almost, normal = (statistics.student(0.95, k) for k in (0.99e6, 1e6))
    assert almost == pytest.approx(normal, rel=2e-6)
    assert statistics.student(0.95, 0) == math.inf


# Means


@pytest.mark.parametrize("phi", [0.0, 0.5, 0.9])
def test_autocorrelation_time_is_that_of_ar1(phi):
    tau = (1 + phi) / (1 - phi)
    count, rows = 20_000, 20
    series = ar1(phi, count, np.random.default_rng(1), rows)
    times, windows = zip(*map(statistics.autocorrelation_time, series), strict=True)
    # Relative standard deviation sqrt(2 (2 W + 1) / n) of each (Madras and Sokal 1988), four of
    # them for the mean of 20; summing to 5 tau leaves exp(-5 tau |log phi|) < 5e-5 out.
    expected = math.sqrt(2 * (2 * np.mean(windows) + 1) / count / rows)
    assert np.mean(times) == pytest.approx(tau, rel=4 * expected + 0.03 * (phi == 0))


@pytest.mark.parametrize(("phi", "count"), [(0.0, 100), (0.8, 500), (0.95, 4000)])
def test_interval_of_one_series_covers_the_mean(phi, count):
    runs = 1000
    hits = 0
    for x in ar1(phi, count, np.random.default_rng(2), runs):
        low, high = statistics.mean(x).interval(0.95)
        hits += low <= 0.0 <= high
    low, high = binomial_bounds(runs, 0.95)
    assert low - 0.01 * runs <= hits <= high + 0.01 * runs  # tau itself is an estimate, of t's kind


@pytest.mark.parametrize("count", [2, 3, 8])
def test_interval_of_several_series_covers_the_mean_although_they_remember(count):
    # Each has an offset that it never forgets, beside its own noise: only the scatter of the
    # series' means shows it.
    rng, runs = np.random.default_rng(3), 1000
    hits = 0
    for _ in range(runs):
        x = rng.normal(size=(count, 1)) + 0.1 * rng.normal(size=(count, 50))
        low, high = statistics.mean(x).interval(0.95)
        hits += low <= 0.0 <= high
    low, high = binomial_bounds(runs, 0.95)
    assert low <= hits <= high


def test_effective_number_and_error_of_a_long_series():
    x = ar1(0.9, 200_000, np.random.default_rng(4))[0]
    found = statistics.mean(x)
    # tau = 19; 2 (2 W + 1) / n = (0.044)^2: four of that, and half of it for the error.
    assert found.effective == pytest.approx(200_000 / 19, rel=0.18)
    assert found.error == pytest.approx(math.sqrt(19 / 200_000), rel=0.09)


def test_series_too_short_for_their_memory_say_so():
    assert statistics.mean(np.arange(20.0)).error == math.inf
    assert statistics.mean([1.0]).error == math.inf
    assert statistics.mean([2.0]).interval() == (-math.inf, math.inf)


def test_what_does_not_change_is_known():
    found = statistics.mean(np.full(10, 3.0))
    assert found.interval() == (3.0, 3.0)
    assert statistics.mean(np.full((4, 10), 3.0)).interval() == (3.0, 3.0)


def test_mean_does_not_depend_on_units():
    x = ar1(0.5, 1000, np.random.default_rng(5))[0]
    one, huge = statistics.mean(x), statistics.mean(1e140 * x)
    assert huge.error == pytest.approx(1e140 * one.error)


def test_difference_of_means_is_that_of_welch():
    # Welch 1947 with n = 10 and 5, s^2/n = 1 and 4: degrees (1 + 4)^2 / (1/9 + 16/4) = 6.08.
    a, b = statistics.Mean(3.0, 1.0, 9, 10), statistics.Mean(1.0, 2.0, 4, 5)
    found = statistics.difference(a, b)
    assert found.value == 2.0
    assert found.error == pytest.approx(math.sqrt(5))
    assert found.degrees == pytest.approx(25 / (1 / 9 + 16 / 4))


# Medians


@pytest.mark.parametrize(
    ("count", "rank"), [(6, 1), (8, 1), (9, 2), (10, 2), (20, 6), (30, 10), (50, 18)]
)
def test_ranks_of_the_medians_interval_are_those_of_the_tables(count, rank):
    # Conover 1999, sec. 3.2 and table A3: largest r with P(B < r) <= 0.025, B of n and 1/2.
    middle, (low, high) = statistics.median(np.random.default_rng(6).permutation(count) + 1.0)
    assert (low, high) == (rank, count + 1 - rank)
    assert middle == (count + 1) / 2


def test_interval_of_a_median_covers_it_whatever_the_distribution():
    rng, runs = np.random.default_rng(7), 1000
    hits = 0
    for x in rng.exponential(size=(runs, 20)) ** 3:
        low, high = statistics.median(x)[1]
        hits += low <= math.log(2) ** 3 <= high
    # 1 - 2 P(B < 6), B of 20 and 1/2: 0.9586.
    low, high = binomial_bounds(runs, 0.9586)
    assert low <= hits <= high


def test_few_values_have_no_interval():
    assert statistics.median([1.0, 2.0, 3.0, 4.0, 5.0]) == (3.0, (-math.inf, math.inf))


# Orders


def test_order_of_a_straight_line():
    steps = 0.1 / 2.0 ** np.arange(5)
    found = statistics.order(steps, 3.0 * steps**2)
    assert found.value == pytest.approx(2.0)
    assert found.error < 1e-12
    assert found.off == pytest.approx(1.0)


def test_order_of_two_points_has_no_error_and_one_that_is_crooked_says_so():
    assert statistics.order([1.0, 0.5], [1.0, 0.25]).error == math.inf
    found = statistics.order([1.0, 0.5, 0.25], [1.0, 1e-3, 0.06])
    assert found.off > 10
    assert found.interval()[0] < 0


def test_interval_of_an_order_covers_it():
    rng, runs = np.random.default_rng(8), 1000
    steps = 0.1 / 2.0 ** np.arange(6)
    hits = 0
    for _ in range(runs):
        low, high = statistics.order(steps, steps**2 * rng.lognormal(0, 0.1, 6)).interval(0.95)
        hits += low <= 2.0 <= high
    low, high = binomial_bounds(runs, 0.95)
    assert low <= hits <= high


# Transients


def test_transient_is_found():
    # Three standard deviations that die away over 50 values: after 150 it is 0.15 of one, and below
    # the error of the mean, sqrt(1/850), after 225.
    found = []
    for x in ar1(0.0, 1000, np.random.default_rng(9), 100):
        found.append(statistics.transient(x + 3 * np.exp(-np.arange(1000) / 50)))
    assert 80 < np.median(found) < 250


def test_steady_series_lose_little():
    found = [statistics.transient(x) for x in ar1(0.5, 1000, np.random.default_rng(10), 100)]
    assert np.median(found) < 100
    assert statistics.transient(np.ones(100)) == 0


def test_no_steady_state_is_said():
    assert statistics.transient(np.arange(100.0)) is None


def test_transient_of_several_series_is_that_of_their_mean():
    x = ar1(0.0, 400, np.random.default_rng(11), 50)
    x[:, :100] += np.linspace(2, 0, 100)
    assert 60 <= statistics.transient(x) <= 120
