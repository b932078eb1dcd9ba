"""What a mesh makes of a charge: the influence function of its potential, and the error it leaves.

Charges are put on a mesh, and forces taken from it, by B-splines of order p, whose transform is
U(k) = prod sinc(k_a h_a / 2 pi)^p. A mesh of spacings h takes k and k_m = k + 2 pi m / h for the
same wave. The influence function for which forces, as slopes of the splines, have the least error
over all places of two charges is (Hockney and Eastwood 1988; Ballenegger, Cerda and Holm 2012)

    G(k) = sum_m U_m^2 R_m . k_m / (sum_m U_m^2  sum_m k_m^2 U_m^2),  R_m = k_m w(k_m)

where w is the transform of the smooth part of the law; and the mean square of what is left is

    chi^2 = 1 / V^2 sum_k (sum_m R_m^2 - G sum_m U_m^2 R_m . k_m)

Every sum over m is a product of sums along the axes, or three of them.
"""

from __future__ import annotations

import functools
import math

import numpy as np

ALIASES = 4  # to either side; what is beyond falls as m^-2p
BLOCK, SHORTEST = 20, 11.0  # waves along half an axis by which an error is estimated, to k = 11 a


def influence(
    box: np.ndarray, nodes: np.ndarray, order: int, damping: float
) -> tuple[np.ndarray, list[np.ndarray]]:
    """What a mesh makes of 1/r, by wave of a real transform, for unit charges in this volume.

    First G; 0 of the mean. Then by axis sum_m U_m U_(m+1), times what the others have: its sum with
    G over all waves is C of the energy C cos(2 pi s_a) that a charge has with itself by where it is
    between the nodes (Ballenegger, Cerda and Holm 2012), the only harmonic that counts.

    Args:
        box: Sides, (3,) [length].
        nodes: Along each axis, (3,).
        order: Of the splines.
        damping: a: w(k) = 4 pi exp(-k^2 / 4 a^2) / k^2 [1/length].
    """
    sums: list[list[np.ndarray]] = []
    for a in range(3):
        whole = np.fft.fftfreq(nodes[a])[: nodes[2] // 2 + 1 if a == 2 else None]
        u = whole[:, None] + np.arange(-ALIASES, ALIASES + 1)
        with np.errstate(divide="ignore", invalid="ignore"):
            U = np.where(u == 0, 1.0, (np.sin(np.pi * whole) / np.pi)[:, None] / u) ** order
        k2 = (2.0 * np.pi * u * nodes[a] / box[a]) ** 2
        seen = U**2 * np.exp(-k2 / (4.0 * damping**2))
        shape = [-1 if a == b else 1 for b in range(3)]
        kinds = U**2, U**2 * k2, seen, U[:, 1:] * U[:, :-1]
        sums.append([each.sum(axis=1).reshape(shape) for each in kinds])
    (x, dx, gx, ax), (y, dy, gy, ay), (z, dz, gz, az) = sums
    slope = dx * y * z + x * dy * z + x * y * dz
    slope[0, 0, 0] = np.inf  # of the mean there is no force
    G = 4.0 * np.pi / float(np.prod(box)) * gx * gy * gz / (x * y * z * slope)
    twice = np.full(len(z.ravel()), 2.0)  # waves that a real transform has for -k too
    twice[0] = 1.0
    if nodes[2] % 2 == 0:
        twice[-1] = 1.0
    return G, [ax * y * z * twice, x * ay * z * twice, x * y * az * twice]


@functools.cache
def finest(order: int, tolerance: float) -> float:
    """The largest a h at which a mesh leaves no more of the forces than the near pairs beyond
    their cutoff do.

    These leave 4 exp(-2 s^2) / (r_c V) of the square of the force of a unit charge (Kolafa and
    Perram 1992, eq. 16). As r_c = s / a, and chi^2 V / a is a function of a h alone where a box has
    many waves, neither box nor charges are in it.

    Args:
        order: Of the splines.
        tolerance: exp(-s^2).
    """
    low, high = math.log(1e-3), math.log(2.0)
    allowed = 4.0 * tolerance**2 / math.sqrt(-math.log(tolerance))
    for _ in range(40):
        middle = 0.5 * (low + high)
        if _error(order, math.exp(middle)) > allowed:
            high = middle
        else:
            low = middle
    return math.exp(low)


def _error(order: int, ah: float) -> float:
    """chi^2 V / a of a cubic mesh of spacing h = ah / a, in a box of many waves.

    What is left of a wave that the mesh has is R^2 (1 - 1 / ((1 + A) (1 + B))), 1 + A and 1 + B the
    two sums over those that it takes for the same, in parts of the first; of what it does not have
    all, 8 / V int_(pi / h)^inf exp(-k^2 / 2 a^2) dk outside a sphere.
    """
    step = min(0.5, SHORTEST * ah / (2.0 * np.pi)) / BLOCK
    u = step * (np.arange(BLOCK) + 0.5)  # k h / 2 pi along half an axis
    m = np.concatenate([np.arange(-ALIASES, 0), np.arange(1, ALIASES + 1)])
    others = u[:, None] + m
    share = (np.sinc(others) / np.sinc(u)[:, None]) ** (2 * order)
    more = np.log1p(share.sum(axis=1))
    steep = (others**2 * share).sum(axis=1)
    x, y, z = np.meshgrid(more, more, more, indexing="ij", sparse=True)
    B = np.expm1(x + y + z)
    A = np.zeros_like(B)
    squares = np.zeros_like(B)
    for a, rest in enumerate((y + z, x + z, x + y)):
        shape = [-1 if a == b else 1 for b in range(3)]
        A = A + (u**2).reshape(shape) * np.expm1(rest) + steep.reshape(shape) * np.exp(rest)
        squares = squares + (u**2).reshape(shape)
    A = A / squares
    k2 = (2.0 * np.pi / ah) ** 2 * squares  # in a^2
    R2 = 16.0 * np.pi**2 * np.exp(-0.5 * k2) / k2
    cell = 8.0 * (step / ah) ** 3  # of all octants, in a^3 / (2 pi)^3
    kept = float((R2 * (A + B + A * B) / ((1.0 + A) * (1.0 + B))).sum()) * cell
    return kept + 8.0 * math.sqrt(0.5 * math.pi) * math.erfc(math.pi / ah / math.sqrt(2.0))
