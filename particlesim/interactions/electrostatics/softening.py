"""What a softening length s makes of the smooth part of an Ewald sum.

    1 / R = erfc(a R) / R + 2 / sqrt(pi) int_0^a exp(-t^2 R^2) dt,   R^2 = r^2 + s^2,

of which the second is smooth (Plummer 1911; Ewald 1921). Its transform is

    w(k) = 4 pi int_(1/4a^2)^inf exp(-k^2 y - s^2 / 4 y) dy

and without softening 4 pi exp(-k^2 / 4 a^2) / k^2.
"""

from __future__ import annotations

import math

import numpy as np

STEP = 0.25  # of the logarithm of what is summed over: an error below rounding
POINTS = np.exp(np.arange(-34.0, 4.0, STEP))


def shares(k2: np.ndarray, damping: float, softening: float) -> tuple[np.ndarray, np.ndarray]:
    """w(k), and 3 w + k dw/dk, both in parts of w without softening.

    The second is what the wave has of the virial, as its energy by volume goes as w / V when box
    and places are scaled.

    Args:
        k2: Squares of waves [1/length^2].
        damping: a [1/length].
        softening: s [length].
    """
    near = k2 / (4.0 * damping**2)
    if softening == 0.0:
        return np.ones_like(k2), 1.0 - 2.0 * near
    energy, virial = np.zeros_like(k2), np.zeros_like(k2)
    for u in POINTS:  # y = (k^2 / 4 a^2 + u) / k^2
        each = STEP * u * np.exp(-u - 0.25 * k2 * softening**2 / (near + u))
        energy += each
        virial += each * (3.0 - 2.0 * (near + u))
    return energy, virial


def waves_of(box: np.ndarray, nodes: np.ndarray) -> np.ndarray:
    """k^2 of the waves of a real transform on a mesh [1/length^2]."""
    x, y, z = (2.0 * np.pi * n / L * np.fft.fftfreq(n) for n, L in zip(nodes, box, strict=True))
    return x[:, None, None] ** 2 + y[:, None] ** 2 + z[: nodes[2] // 2 + 1] ** 2


def own(damping: float, softening: float) -> float:
    """The smooth part at r = 0: erf(a s) / s; 2 a / sqrt(pi) without softening [1/length]."""
    x = damping * softening
    return damping * (math.erf(x) / x if x > 1e-8 else 2.0 / math.sqrt(math.pi))


def outside(damping: float, softening: float) -> float:
    """The integral over space of the near part, pi / a^2 int_0^1 exp(-a^2 s^2 / v) dv [length^2].

    By the trapezoidal rule for v = (1 + tanh(pi/2 sinh t)) / 2 (Takahasi and Mori 1974).
    """
    t = np.arange(-4.0, 4.0, 1.0 / 32.0)
    x = 0.5 * math.pi * np.sinh(t)
    v = 1.0 / (1.0 + np.exp(-2.0 * x))
    slope = 0.25 * math.pi * np.cosh(t) / np.cosh(x) ** 2
    part = float((np.exp(-((damping * softening) ** 2) / v) * slope).sum()) / 32.0
    return math.pi / damping**2 * part
