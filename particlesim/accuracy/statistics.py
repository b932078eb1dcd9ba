"""Statistics of runs: means with errors, intervals, orders of convergence, start-up transients.

A number that a run gives is a sample. What is here says how far it may be from what endless runs
would give, with nothing assumed but what each docstring names.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from statistics import NormalDist
from typing import Any, NamedTuple

import numpy as np

WINDOW = 5.0  # autocorrelation times that are summed over: 1/e^5 is left out (Sokal 1997, sec. 3.3)
BATCH = 5  # values that MSER averages first: MSER-5 (White, Cobb and Spratt 2000)
NORMAL = 1e6  # degrees of freedom from which Student's t is the normal distribution, to 1e-6
TINY = 1e-300  # in the place of a zero denominator, in Lentz's continued fraction


class Interval(NamedTuple):
    """Bounds of a value; infinite where the sample is too small to tell."""

    low: float
    high: float


@dataclass(frozen=True)
class Mean:
    """A mean, and how well it is known.

    Args:
        value: The mean.
        error: Its standard error; infinite where the sample is too small to tell.
        degrees: Degrees of freedom of ``error``, for Student's t.
        effective: How many independent values it is worth.
        time: Integrated autocorrelation time, in steps of the series; 1 if independent.
    """

    value: float
    error: float
    degrees: float
    effective: float
    time: float = 1.0

    def interval(self, confidence: float = 0.95) -> Interval:
        """Student's interval: value -+ t error."""
        reach = self.reach(confidence)
        return Interval(self.value - reach, self.value + reach)

    def reach(self, confidence: float = 0.95) -> float:
        """Half the width of the interval."""
        return reach(self.error, self.degrees, confidence)


@dataclass(frozen=True)
class Order:
    """An order of convergence p, error = c step^p, by least squares on logarithms.

    Args:
        value: p.
        error: Its standard error, from how the points lie about the line; infinite of two points.
        degrees: Points less two.
        off: Factor by which the worst point misses the line; 1 if it is straight.
    """

    value: float
    error: float
    degrees: int
    off: float

    def interval(self, confidence: float = 0.95) -> Interval:
        """Student's interval: value -+ t error."""
        half = reach(self.error, self.degrees, confidence)
        return Interval(self.value - half, self.value + half)


def mean(values: Any) -> Mean:
    """The mean of a correlated series, or of several independent ones, with its error.

    Of one series the error is sqrt(C(0) tau / n), tau = 1 + 2 sum rho(t) (see
    :func:`autocorrelation_time`). It has n / (2 W + 1) degrees of freedom, W the window, since the
    relative variance of tau is 2 (2 W + 1) / n (Madras and Sokal 1988, eq. C.19), and chi^2 of k
    degrees has 2 / k. This rather than batch means, which need to be told how long a batch is.

    Of k series it is that of their k means, with k - 1 degrees of freedom: true however long the
    memory of a series is, also where a series never forgets its start, as one of constant energy.

    Args:
        values: (n,) in the order of time; or (k, n), a row for each series.
    """
    x = np.atleast_2d(np.asarray(values, dtype=np.float64))
    if len(x) > 1:
        return independent(x.mean(axis=1))
    row = x[0]
    time, window = autocorrelation_time(row)
    effective = len(row) / time
    known = len(row) > 1 and effective > 0
    error = math.sqrt(float(row.var(ddof=1)) / effective) if known else math.inf
    return Mean(float(row.mean()), error, len(row) / (2 * window + 1), effective, time)


def independent(values: Any) -> Mean:
    """The mean of independent values (k,), with k - 1 degrees of freedom."""
    x = np.asarray(values, dtype=np.float64)
    count = len(x)
    error = float(x.std(ddof=1)) / math.sqrt(count) if count > 1 else math.inf
    return Mean(float(x.mean()), error, count - 1, count)


def difference(a: Mean, b: Mean) -> Mean:
    """a - b of independent means, with the degrees of freedom of Welch (1947, eq. 28).

    Where its interval holds 0, the two cannot be told apart.
    """
    squares = [a.error**2, b.error**2]
    total = sum(squares)
    parts = sum(
        square**2 / each.degrees
        for square, each in zip(squares, (a, b), strict=True)
        if each.degrees > 0
    )
    degrees = total**2 / parts if 0 < parts < math.inf else min(a.degrees, b.degrees)
    effective = min(a.effective, b.effective)
    return Mean(a.value - b.value, math.sqrt(total), degrees, effective)


def autocorrelation_time(series: Any) -> tuple[float, int]:
    """The integrated autocorrelation time of a series (n,), and the window W that it is summed to.

    tau = 1 + 2 sum_{t=1}^{W} rho(t), W the smallest that is at least 5 tau (Sokal 1997, eq. 3.10),
    times 1 + (2 W + 1) / n for what taking the mean off removes (Wolff 2004, eq. 49). At least 1:
    of a series that alternates the mean is better than this says. Infinite where there is no such
    W within a quarter of the series, because that is less than 20 times as long as its memory.
    """
    x = np.asarray(series, dtype=np.float64)
    count = len(x)
    x = x - x.mean()
    size = float(np.abs(x).max(initial=0.0))
    if size == 0.0:
        return 1.0, 1
    spectrum = np.fft.rfft(x / size, 2 * count)
    correlation = np.fft.irfft(spectrum * spectrum.conj())[:count] / (count - np.arange(count))
    times = 1.0 + 2.0 * np.cumsum(correlation[1:]) / correlation[0]
    windows = np.arange(1, count // 4 + 1)
    wide = np.flatnonzero(windows >= WINDOW * np.maximum(times[: len(windows)], 1.0))
    if not len(wide):
        return math.inf, count
    window = int(windows[wide[0]])
    return max(1.0, float(times[wide[0]]) * (1.0 + (2 * window + 1) / count)), window


def transient(series: Any) -> int | None:
    """How many values of the beginning to leave out of a mean: the start-up transient.

    Where the standard error of the rest, sum_{i>=d} (x_i - mean)^2 / (n - d)^2, is least (MSER,
    White 1997), of averages of five (White, Cobb and Spratt 2000).

    Args:
        series: (n,), or (k, n), whose rows are averaged first (Welch 1983).

    Returns:
        None where it is more than half of all: no steady state is to be seen.
    """
    x = np.atleast_2d(np.asarray(series, dtype=np.float64)).mean(axis=0)
    batch = BATCH if len(x) >= 10 * BATCH else 1
    count = len(x) // batch
    if count < 4:
        return 0
    over = len(x) - count * batch  # too few for a batch: of the beginning, and left out
    x = x[over:].reshape(count, batch).mean(axis=1)
    x = (x - x.mean())[::-1]  # sums from the end are over what is left
    left = np.arange(1, count + 1)
    squares = np.cumsum(x**2) - np.cumsum(x) ** 2 / left
    least = (squares / left**2)[::-1][: count // 2 + 1]
    out = int(np.argmin(least))
    return None if out == count // 2 else over + out * batch


def drift(series: Any) -> Mean:
    """The mean of the second half less that of the first; of (k, n), row by row."""
    x = np.asarray(series, dtype=np.float64)
    half = x.shape[-1] // 2
    first, second = x[..., :half], x[..., half:]
    if x.ndim > 1:
        return independent(second.mean(axis=1) - first.mean(axis=1))
    return difference(mean(second), mean(first))


def median(values: Any, confidence: float = 0.95) -> tuple[float, Interval]:
    """The median of independent values, and its interval, whatever they are distributed like.

    The median lies between the j-th smallest and the j-th largest with probability
    1 - 2 P(B < j), B binomial of n and 1/2 (Thompson 1936); the largest j that leaves at least
    ``confidence``. Below six values there is none for 0.95, and the interval is infinite.
    """
    x = np.sort(np.asarray(values, dtype=np.float64))
    count, below, rank = len(x), 0.0, 0
    for k in range((count + 1) // 2):
        below += math.exp(
            math.lgamma(count + 1) - math.lgamma(k + 1) - math.lgamma(count - k + 1)
            - count * math.log(2.0)
        )  # fmt: skip
        if 2.0 * below > 1.0 - confidence:
            break
        rank = k + 1
    middle = float(np.median(x))
    if not rank:
        return middle, Interval(-math.inf, math.inf)
    return middle, Interval(float(x[rank - 1]), float(x[count - rank]))


def order(steps: Sequence[float], errors: Sequence[float]) -> Order:
    """The order of convergence of errors (m,) at steps (m,), all above 0, at least two."""
    h, e = np.log(np.asarray(steps, float)), np.log(np.asarray(errors, float))
    h = h - h.mean()
    spread = float(h @ h)
    slope = float(h @ e) / spread
    left = e - e.mean() - slope * h
    degrees = len(h) - 2
    error = math.sqrt(float(left @ left) / degrees / spread) if degrees > 0 else math.inf
    return Order(slope, error, degrees, math.exp(float(np.abs(left).max())))


# Student's t --------------------------------------------------------------------------------


def reach(error: float, degrees: float, confidence: float) -> float:
    """How far Student's interval reaches to either side: t error; 0 of no error at all."""
    return error * student(confidence, degrees) if error else 0.0


def student(confidence: float, degrees: float) -> float:
    """t, such that |T| < t with probability ``confidence``; infinite of no degree of freedom.

    By bisection of the distribution, for any number of degrees above 0, whole or not.
    """
    if degrees <= 0:
        return math.inf
    if degrees >= NORMAL:
        return NormalDist().inv_cdf(0.5 + 0.5 * confidence)
    low, high = 0.0, 1.0
    while _beyond(high, degrees) > 1.0 - confidence and high < 1e150:
        low, high = high, 2.0 * high
    while high - low > 1e-14 * high:
        middle = 0.5 * (low + high)
        if middle in (low, high):
            break
        if _beyond(middle, degrees) > 1.0 - confidence:
            low = middle
        else:
            high = middle
    return high


def _beyond(t: float, degrees: float) -> float:
    """P(|T| > t) = I_x(k/2, 1/2), x = k / (k + t^2) (Abramowitz and Stegun 1964, eq. 26.5.27)."""
    a, b = 0.5 * degrees, 0.5
    x, rest = degrees / (degrees + t * t), t * t / (degrees + t * t)
    if rest == 0.0:
        return 1.0
    front = math.exp(
        math.lgamma(a + b) - math.lgamma(a) - math.lgamma(b) + a * math.log(x) + b * math.log(rest)
    )
    # The fraction converges on this side of the mean, and on the other for the complement.
    if x < (a + 1.0) / (a + b + 2.0):
        return front * _fraction(a, b, x) / a
    return 1.0 - front * _fraction(b, a, rest) / b


def _fraction(a: float, b: float, x: float) -> float:
    """The continued fraction of the incomplete beta function (ibid., eq. 26.5.8), by Lentz."""
    c, d = 1.0, 1.0 / (1.0 - (a + b) * x / (a + 1.0) or TINY)
    value = d
    for m in range(1, 10_000):
        for numerator in (
            m * (b - m) * x / ((a + 2 * m - 1) * (a + 2 * m)),
            -(a + m) * (a + b + m) * x / ((a + 2 * m) * (a + 2 * m + 1)),
        ):
            d = 1.0 / (1.0 + numerator * d or TINY)
            c = 1.0 + numerator / c or TINY
            value *= c * d
        if abs(c * d - 1.0) < 1e-15:
            break
    return value
