"""Colour maps against matplotlib's, and against what makes a map a good one."""

import numpy as np
import pytest

from particlesim.output import colors

# How far the maps are from matplotlib's, in any channel of sRGB. Polynomials: as fitted. Cubehelix:
# single precision. Coolwarm: matplotlib draws straight lines in sRGB between 33 colours.
DISTANCE = {"viridis": 0.011, "magma": 0.024, "cubehelix": 1e-6, "coolwarm": 0.02, "gray": 1e-6}


def srgb(name):
    return colors.encoded(colors.table(name).astype(np.float64))


@pytest.mark.parametrize("name", colors.MAPS)
def test_maps_are_those_of_matplotlib(name):
    matplotlib = pytest.importorskip("matplotlib")
    expected = matplotlib.colormaps[name](np.linspace(0, 1, colors.STEPS))[:, :3]
    assert np.abs(srgb(name) - expected).max() < DISTANCE[name]


def lightness(linear):
    """L* of CIELAB over 100: of the luminance Y of linear sRGB."""
    y = linear.astype(np.float64) @ (0.2126, 0.7152, 0.0722)
    return np.where(y > (6 / 29) ** 3, 1.16 * np.cbrt(y) - 0.16, y * (29 / 3) ** 3 / 100)


@pytest.mark.parametrize("name", ["viridis", "magma", "cubehelix", "gray"])
def test_lightness_grows_all_the_way(name):
    # Over steps of an eighth: the smallest is above a third of the mean.
    steps = np.diff(lightness(colors.table(name))[:: colors.STEPS // 8])
    assert steps.min() > steps.mean() / 3


def test_the_middle_of_the_diverging_map_is_the_lightest():
    light = lightness(colors.table("coolwarm"))
    middle = colors.STEPS // 2
    assert abs(int(light.argmax()) - middle) <= 1
    assert (np.diff(light[: middle - 1]) > 0).all() and (np.diff(light[middle + 1 :]) < 0).all()
    red, green, blue = srgb("coolwarm")[middle]
    assert abs(red - blue) < 0.02 and abs(red - green) < 0.02  # no hue


def test_encoding_is_undone():
    values = np.linspace(0, 1, 101)
    np.testing.assert_allclose(colors.encoded(colors.decoded(values)), values, atol=1e-6)
    # IEC 61966-2-1: half of the light is 188 of 255.
    assert round(float(colors.encoded(np.array(0.5))) * 255) == 188


def test_numbers_become_colors():
    ramp = [(0, 0, 0), (1, 0, 0), (1, 1, 0)]
    found = colors.colored([-9.0, 1.0, 2.0, 3.0, 99.0], ramp, 1.0, 3.0)
    expected = [(0, 0, 0), (0, 0, 0), (1, 0, 0), (1, 1, 0), (1, 1, 0)]
    np.testing.assert_allclose(found, expected, atol=1.01 / 255)
    assert found.dtype == np.float32
    same = colors.colored(np.full(3, 7.0), ramp, 7.0, 7.0)
    np.testing.assert_array_equal(same, np.zeros((3, 3)))
    assert colors.colored(np.zeros(0), "viridis", 0.0, 1.0).shape == (0, 3)


@pytest.mark.parametrize(
    ("given", "match"),
    [
        ("virdis", "color_map must be one of .*did you mean 'viridis'"),
        ([(0, 0, 0)], r"have shape \(k, 3\)"),
        (np.zeros((4, 4)), r"have shape \(k, 3\)"),
        ([(0, 0, 0), (0, 0, 2)], r"be in 0\.\.1"),
        ([(0, 0, 0), (0, 0, np.nan)], r"be in 0\.\.1"),
    ],
)
def test_maps_that_are_none_are_refused(refused, given, match):
    with refused(match):
        colors.table(given)
