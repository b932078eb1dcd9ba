"""What tests of sampled distributions share: tolerances that follow from the size of a sample.

Seeds are fixed, so that a test that passes passes always. At 4 standard deviations, or at a
probability of 1e-4, one seed in some ten thousand would fail where nothing is wrong.
"""

import math

import numpy as np

SIGMAS = 4.0
DISTANCE = 2.23  # of Kolmogorov and Smirnov times the root of the sample: 2 exp(-2 d^2) = 1e-4


def normal(x):
    """The normal distribution's cumulative function."""
    return 0.5 * (1.0 + np.vectorize(math.erf)(np.asarray(x) / math.sqrt(2.0)))


def gamma(x, degrees):
    """That of half the sum of squares of ``degrees`` normal numbers.

    By P(a + 1, x) = P(a, x) - x^a e^-x / Gamma(a + 1), from erf(sqrt(x)) or 1.
    """
    x, a = np.asarray(x, dtype=float), 0.5 * (degrees % 2)
    found = np.vectorize(math.erf)(np.sqrt(x)) if degrees % 2 else np.ones_like(x)
    while a < 0.5 * degrees:
        found = found - x**a * np.exp(-x) / math.gamma(a + 1.0)
        a += 1.0
    return found


def distributed(sample, cumulative):
    """The Kolmogorov-Smirnov test: whether independent values are of that distribution."""
    ordered = np.sort(np.ravel(sample))
    n, expected = len(ordered), cumulative(ordered)
    rank = np.arange(n)
    distance = max((expected - rank / n).max(), ((rank + 1) / n - expected).max())
    assert distance < DISTANCE / math.sqrt(n), (distance, DISTANCE / math.sqrt(n))


def mean_of(sample, expected, deviation=None):
    """The mean of independent values, each with that standard deviation, or their own."""
    sample = np.ravel(sample)
    spread = sample.std() if deviation is None else deviation
    assert abs(sample.mean() - expected) < SIGMAS * spread / math.sqrt(len(sample))


def variance_of(sample, expected):
    """The variance of independent normal numbers of mean 0: its own has 2 sigma^4 / n."""
    sample = np.ravel(sample)
    assert abs((sample**2).mean() / expected - 1.0) < SIGMAS * math.sqrt(2.0 / len(sample))
