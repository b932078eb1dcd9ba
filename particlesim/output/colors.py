"""Colour maps: numbers to colours, in linear light as USD and renderers take them.

``viridis`` and ``magma`` are polynomials of degree 7 and 6, fitted to the maps of these names
(within 0.025 of every channel); ``cubehelix`` is the formula of Green (2011), ``coolwarm`` that of
Moreland (2009). All are made in the sRGB encoding that they were designed in, and then decoded.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any

import numpy as np

from .. import validate

STEPS = 256
NEARLY_ALL = (0.01, 0.99)  # that a map spans: single particles fly off
# Coefficients of 1, x, x^2, ... of each channel.
POLYNOMIALS = {
    "viridis": (
        (0.257, 1.162, -14.789, 76.315, -217.080, 326.814, -238.181, 66.500),
        (0.004, 1.504, -1.256, 2.471, -8.554, 19.004, -19.029, 6.763),
        (0.323, 1.962, -7.804, 24.885, -65.250, 110.516, -100.802, 36.307),
    ),
    "magma": (
        (-0.002, 0.250, 8.346, -27.667, 52.171, -50.759, 18.664),
        (-0.001, 0.694, -3.596, 14.254, -27.945, 29.054, -11.490),
        (-0.010, 2.495, 0.329, -13.647, 12.881, 4.270, -5.571),
    ),
}
# Ends of the diverging map, sRGB (Moreland 2009, table 1).
COOL, WARM = (0.230, 0.299, 0.754), (0.706, 0.016, 0.150)
# From linear sRGB to CIE XYZ, and the white of both (D65).
XYZ = np.array(
    [[0.4124564, 0.3575761, 0.1804375], [0.2126729, 0.7151522, 0.0721750],
     [0.0193339, 0.1191920, 0.9503041]]
)  # fmt: skip
WHITE = XYZ.sum(axis=1)


def colored(values: Any, color_map: Any, lower: float, upper: float) -> np.ndarray:
    """Colours (n, 3) of numbers (n,), linear, float32; beyond the ends, those of the ends.

    Args:
        values: (n,) numbers.
        color_map: Name of a map (see ``MAPS``), or the colours themselves, (k, 3) linear.
        lower: The number with the first colour.
        upper: The number with the last colour; where it is not above ``lower``, all have the
            first colour.

    Example:
        >>> colored([0.0, 0.5, 2.0], [(0, 0, 0), (1, 1, 1)], 0.0, 1.0)[:, 0].round(1).tolist()
        [0.0, 0.5, 1.0]
    """
    steps, numbers = table(color_map), np.asarray(values)
    if not upper > lower:
        return np.repeat(steps[:1], len(numbers), axis=0)
    # The nearest of many fine steps: much faster than blending three channels for each number.
    at = (np.clip(numbers, lower, upper) - lower) * ((len(steps) - 1) / (upper - lower))
    return np.take(steps, np.rint(at).astype(np.int32), axis=0)


def spanned(values: np.ndarray) -> tuple[float, float]:
    """Numbers that nearly all of some are between; all, where these would be one number."""
    lower, upper = map(float, np.quantile(values, NEARLY_ALL))
    return (lower, upper) if upper > lower else (float(values.min()), float(values.max()))


def table(color_map: Any) -> np.ndarray:
    """A map as fine steps, (STEPS, 3) linear float32.

    Raises:
        ValueError: A name that is not known, colours of another shape or outside 0..1.
    """
    if isinstance(color_map, str):
        return _named(validate.choice("colors", "color_map", color_map, MAPS))
    given = np.asarray(color_map, dtype=np.float64)
    if given.ndim != 2 or given.shape[1] != 3 or len(given) < 2:
        raise validate.fail(
            "colors", "color_map", f"be one of {', '.join(MAPS)} or have shape (k, 3)", color_map,
            "give a name or two colours",
        )  # fmt: skip
    if not (given.min() >= 0 and given.max() <= 1):
        raise validate.fail("colors", "color_map", "be in 0..1", given, "give (r, g, b), linear")
    steps, knots = np.linspace(0, 1, STEPS), np.linspace(0, 1, len(given))
    return np.stack([np.interp(steps, knots, c) for c in given.T], axis=1).astype(np.float32)


def decoded(encoded: np.ndarray) -> np.ndarray:
    """Linear light of sRGB values in 0..1 (IEC 61966-2-1)."""
    return np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)


def encoded(linear: np.ndarray) -> np.ndarray:
    """sRGB values of linear light in 0..1 (IEC 61966-2-1)."""
    root = np.maximum(linear, 0.0) ** (1.0 / 2.4)
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * root - 0.055)


@functools.cache
def _named(name: str) -> np.ndarray:
    srgb = np.clip(MAPS[name](np.linspace(0.0, 1.0, STEPS)), 0.0, 1.0)
    return decoded(srgb).astype(np.float32)


def _polynomial(name: str, x: np.ndarray) -> np.ndarray:
    rows = np.array(POLYNOMIALS[name])
    return (x[:, None, None] ** np.arange(rows.shape[1]) * rows).sum(axis=-1)


def _cubehelix(x: np.ndarray) -> np.ndarray:
    """Green (2011), eq. 2, with start 0.5, rotations -1.5, hue 1 and gamma 1."""
    angle = 2.0 * np.pi * (0.5 / 3.0 - 1.5 * x)
    amplitude = 0.5 * x * (1.0 - x)
    turn = np.array([[-0.14861, 1.78277], [-0.29227, -0.90649], [1.97294, 0.0]])
    return (x + amplitude * (turn @ np.array([np.cos(angle), np.sin(angle)]))).T


def _coolwarm(x: np.ndarray) -> np.ndarray:
    """Moreland (2009), sec. 5: straight in (magnitude, saturation, hue), through white."""
    cool, warm = (_to_msh(np.array(end)) for end in (COOL, WARM))
    middle = max(cool[0], warm[0], 88.0)
    half = np.where(x < 0.5, 2.0 * x, 2.0 - 2.0 * x)[:, None]
    ends = np.where((x < 0.5)[:, None], cool, warm)
    # White has no hue of its own: it takes one that lets equal steps look equal.
    hues = [_turned(end, middle) for end in (cool, warm)]
    white = np.stack([np.full_like(x, middle), np.zeros_like(x), np.where(x < 0.5, *hues)], axis=1)
    return _from_msh((1.0 - half) * ends + half * white)


def _turned(msh: np.ndarray, magnitude: float) -> float:
    """Hue of an unsaturated colour of this magnitude that a saturated one runs into."""
    m, s, h = msh
    if m >= magnitude:
        return float(h)
    turn = s * np.sqrt(magnitude**2 - m**2) / (m * np.sin(s))
    return float(h + turn if h > -np.pi / 3.0 else h - turn)


def _to_msh(srgb: np.ndarray) -> np.ndarray:
    """CIELAB in polar coordinates: magnitude, saturation and hue."""
    t = XYZ @ decoded(srgb) / WHITE
    f = np.where(t > (6 / 29) ** 3, np.cbrt(t), t * (29 / 6) ** 2 / 3 + 4 / 29)
    lab = np.array([116.0 * f[1] - 16.0, 500.0 * (f[0] - f[1]), 200.0 * (f[1] - f[2])])
    m = np.linalg.norm(lab)
    return np.array([m, np.arccos(lab[0] / m), np.arctan2(lab[2], lab[1])])


def _from_msh(msh: np.ndarray) -> np.ndarray:
    m, s, h = msh.T
    light, a, b = m * np.cos(s), m * np.sin(s) * np.cos(h), m * np.sin(s) * np.sin(h)
    y = (light + 16.0) / 116.0
    f = np.stack([y + a / 500.0, y, y - b / 200.0], axis=1)
    t = np.where(f > 6 / 29, f**3, 3 * (6 / 29) ** 2 * (f - 4 / 29))
    return encoded(np.clip(t * WHITE @ np.linalg.inv(XYZ).T, 0.0, 1.0))


def _gray(x: np.ndarray) -> np.ndarray:
    return np.repeat(x[:, None], 3, axis=1)


MAPS: dict[str, Callable[[np.ndarray], np.ndarray]] = {
    "viridis": functools.partial(_polynomial, "viridis"),
    "magma": functools.partial(_polynomial, "magma"),
    "cubehelix": _cubehelix,
    "coolwarm": _coolwarm,
    "gray": _gray,
}
