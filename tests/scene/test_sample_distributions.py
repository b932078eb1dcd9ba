"""Samplers of distributions: profiles, temperatures, links."""

import numpy as np
import pytest

from cases.sample import nearest_distance
from particlesim import sample

# Random points


def test_random_is_uniform():
    points = sample.random((-1, 0, 5), (1, 4, 6), 10_000, seed=1)
    # The mean of n uniform numbers on a length L has deviation L / sqrt(12 n); five of them.
    assert np.all(np.abs(points.mean(axis=0) - (0, 2, 5.5)) < 5 * np.array([2, 4, 1]) / 346.4)
    assert np.all(points >= (-1, 0, 5)) and np.all(points <= (1, 4, 6))
    assert np.array_equal(points, sample.random((-1, 0, 5), (1, 4, 6), 10_000, seed=1))


ORIGIN, ONE = (0, 0, 0), (1, 1, 1)


@pytest.mark.parametrize("upper", [(1, 1, 1), (4, 1, 0.5), (6, 4, 0), (0.15, 2, 2)])
@pytest.mark.parametrize("periodic", [False, True])
def test_random_minimum_distance(upper, periodic):
    points = sample.random((0, 0, 0), upper, 50, minimum_distance=0.15, periodic=periodic)
    # Any period does on the flat axis: all gaps are 0 there.
    period = np.where(np.array(upper) > 0, upper, 1.0) if periodic else None
    assert len(points) == 50
    assert nearest_distance(points, period).min() >= 0.15


def test_random_that_does_not_fit_says_how_many_did():
    with pytest.raises(
        ValueError, match=r"minimum_distance must leave room for 9 .* got 1.1; only"
    ):
        sample.random((0, 0, 0), (1, 1, 1), 9, minimum_distance=1.1)


# Spherical profiles


def test_uniform_sphere_mass_profile_and_directions():
    n, radius = 4000, 2.0
    points = sample.uniform_sphere((1, 1, 1), radius, n) - 1
    r = np.linalg.norm(points, axis=1)
    for fraction in (0.1, 0.5, 0.9):
        # Shells of equal mass: the enclosed count is exact to one shell.
        inside = np.count_nonzero(r < fraction * radius)
        assert abs(inside - n * fraction**3) <= 1
    # A component of a random direction has variance 1/3: five deviations of its mean.
    assert np.all(np.abs((points / r[:, None]).mean(axis=0)) < 5 / np.sqrt(3 * n))


def test_stretch_gives_the_polytrope():
    # n = 1: rho = sin(xi)/xi, xi = pi r/R, so m(r) is (sin(xi) - xi cos(xi)) / pi.
    radius, center = 3.0, np.array([10.0, 0.0, -5.0])
    ball = sample.uniform_sphere(center, radius, 2000)
    star = sample.stretch(ball, center, radius, lambda r: np.sinc(r / radius))
    before, after = (np.linalg.norm(p - center, axis=1) for p in (ball, star))
    xi = np.pi * after / radius
    # The error of r is about R / intervals^2 = 6e-8 R, and dm/dr at most 1.8 / R here.
    assert np.allclose((np.sin(xi) - xi * np.cos(xi)) / np.pi, (before / radius) ** 3, atol=2e-7)
    # Directions are kept, to the round-off of coordinates of 10 over the least radius of 0.1.
    cosine = ((ball - center) * (star - center)).sum(axis=1) / (before * after)
    assert np.allclose(cosine, 1.0, atol=1e-13)


def test_stretch_in_a_plane_and_on_a_line():
    # rho = 1 - r^2: m(r) / m(1) = 2 r^2 - r^4 and 1.5 r - 0.5 r^3; R / intervals^2 as above.
    line = np.linspace(-1, 1, 50)[:, None] * [1.0, 0, 0]
    disc = sample.box((-1, -1, 0), (1, 1, 0), 0.1)
    disc = disc[np.linalg.norm(disc, axis=1) < 1]
    for points, dimension in ((line, 1), (disc, 2)):
        star = sample.stretch(points, (0, 0, 0), 1.0, lambda r: 1 - r**2, dimension)
        before, after = np.linalg.norm(points, axis=1), np.linalg.norm(star, axis=1)
        within = {1: 1.5 * after - 0.5 * after**3, 2: 2 * after**2 - after**4}[dimension]
        assert np.allclose(within, before**dimension, atol=2e-7)


def test_stretch_keeps_a_uniform_ball_and_its_centre():
    ball = sample.sphere((1, 2, 3), 1.0, 0.2)
    assert np.allclose(sample.stretch(ball, (1, 2, 3), 1.0, np.ones_like), ball, atol=1e-6)


def test_stretch_works_where_the_core_is_empty():
    # rho = 0 for r < R/2: a shell.
    ball = sample.uniform_sphere((0, 0, 0), 1.0, 500)
    shell = sample.stretch(ball, (0, 0, 0), 1.0, lambda r: np.where(r < 0.5, 0.0, 1.0))
    r = np.linalg.norm(shell, axis=1)
    # m = (r^3 - 1/8) / (7/8); the jump falls within one interval, at most 2 R / 4096 wide.
    assert np.allclose((r**3 - 0.125) / 0.875, (np.arange(500) + 0.5) / 500, atol=2e-3)


# Velocities


def test_plummer_sphere_is_in_equilibrium():
    n = 20_000
    x = sample.plummer((1, 2, 3), 2.0, n)
    v = sample.plummer_velocity(x, (1, 2, 3), 2.0, mass=3.0, G=5.0)
    r = np.linalg.norm(x - (1, 2, 3), axis=1)
    # Half the mass is within 1.304766 a (to 1 / n), and 2 K = 3 pi / 32 G M^2 / a: squares of
    # speeds scatter by about their mean over the cluster, 1 / sqrt(n).
    assert np.median(r) == pytest.approx(2 * 1.304766, rel=2 / n)
    assert (v**2).sum(axis=1).mean() == pytest.approx(3 * np.pi / 32 * 15 / 2, rel=4 / np.sqrt(n))
    # As fast along the radius as across it, and never as fast as would leave.
    along = ((x - (1, 2, 3)) * v).sum(axis=1) / r
    assert (along**2).mean() / (v**2).sum(axis=1).mean() == pytest.approx(1 / 3, abs=4 / np.sqrt(n))
    assert ((v**2).sum(axis=1) < 2 * 15 / np.sqrt(r**2 + 4)).all()


def test_maxwell_boltzmann_temperature_and_drift():
    n, temperature, boltzmann = 20_000, 2.5, 1.3
    mass = np.linspace(0.5, 4.0, n)
    v = sample.maxwell_boltzmann(n, temperature, mass, boltzmann=boltzmann, seed=3)
    momentum = (mass[:, None] * v).sum(axis=0)
    assert np.allclose(
        momentum, 0.0, atol=n * np.finfo(float).eps * np.abs(mass[:, None] * v).max()
    )
    kinetic = 0.5 * (mass[:, None] * v * v).sum()
    # 2 K / (k T) is chi-squared with d = 3n - 3 degrees of freedom: deviation sqrt(2 / d) of T.
    degrees = 3 * n - 3
    assert 2 * kinetic / (degrees * boltzmann) == pytest.approx(
        temperature, rel=5 * np.sqrt(2 / degrees)
    )
    # Kurtosis of a component, 3, has deviation sqrt(24 / n) over 3 n samples.
    u = (v * np.sqrt(mass)[:, None]).ravel()
    assert np.mean(u**4) / np.mean(u**2) ** 2 == pytest.approx(3.0, abs=5 * np.sqrt(24 / (3 * n)))


def test_maxwell_boltzmann_edges():
    assert np.all(sample.maxwell_boltzmann(5, 0.0, 1.0) == 0)
    assert sample.maxwell_boltzmann(0, 1.0, 1.0).shape == (0, 3)
    assert np.any(sample.maxwell_boltzmann(1, 1.0, 1.0, remove_drift=False) != 0)


@pytest.mark.parametrize(
    "call, message",
    [
        (lambda: sample.box(ORIGIN, ONE, 0.0), "sample.box: spacing must be above 0"),
        (lambda: sample.box(ORIGIN, ONE, np.nan), "sample.box: spacing must be finite"),
        (lambda: sample.box(ORIGIN, (1, 1), 0.1), "sample.box: upper must have shape"),
        (lambda: sample.box(ONE, ORIGIN, 0.1), "sample.box: upper must be at least lower"),
        (lambda: sample.box(ORIGIN, (1, np.inf, 1), 0.1), "sample.box: upper.* must be finite"),
        (lambda: sample.box(ORIGIN, ONE, 0.1, jitter=0.6), "sample.box: jitter must be at most"),
        (lambda: sample.box(ORIGIN, ONE, 0.1, seed=-1), "sample.box: seed must be a whole"),
        (lambda: sample.sphere(ORIGIN, -1.0, 0.1), "sample.sphere: radius must be above 0"),
        (lambda: sample.sphere(ORIGIN, "a", 0.1), "sample.sphere: radius must be a number"),
        (lambda: sample.cylinder(ONE, ONE, 1.0, 0.1), "sample.cylinder: end must differ"),
        (lambda: sample.lattice("diamond", 3, 1.0), "sample.lattice: kind must be one of sc, bcc"),
        (lambda: sample.lattice("fcc", 0, 1.0), "sample.lattice: cells must be a whole"),
        (lambda: sample.lattice("fcc", (1, 2), 1.0), "sample.lattice: cells must be one number"),
        (lambda: sample.lattice("fcc", 2.5, 1.0), "sample.lattice: cells must be a whole"),
        (lambda: sample.random(ORIGIN, ONE, -1), "sample.random: count must be a whole"),
        (
            lambda: sample.random(ORIGIN, ONE, 2, minimum_distance=0),
            "sample.random: minimum_distance must be above 0",
        ),
        (
            lambda: sample.stretch([(2, 0, 0)], ORIGIN, 1.0, np.ones_like),
            "sample.stretch: points must lie within 1",
        ),
        (
            lambda: sample.stretch([ORIGIN], ORIGIN, 1.0, np.zeros_like),
            "sample.stretch: density must be finite, not negative",
        ),
        (
            lambda: sample.stretch([ORIGIN], ORIGIN, 1.0, lambda r: r[:5]),
            "sample.stretch: density must return shape",
        ),
        (
            lambda: sample.stretch([ORIGIN], ORIGIN, 1.0, np.ones_like, 4),
            "sample.stretch: dimension must be 1, 2 or 3",
        ),
        (
            lambda: sample.maxwell_boltzmann(3, -1.0, 1.0),
            "sample.maxwell_boltzmann: temperature must be at least 0",
        ),
        (
            lambda: sample.maxwell_boltzmann(3, 1.0, (1.0, 0.0, 1.0)),
            "sample.maxwell_boltzmann: mass must be above 0",
        ),
        (
            lambda: sample.maxwell_boltzmann(3, 1.0, (1.0, 1.0)),
            "sample.maxwell_boltzmann: mass must have shape",
        ),
    ],
)  # fmt: skip
def test_bad_arguments(call, message):
    with pytest.raises(ValueError, match=message) as raised:
        call()
    assert ", got " in str(raised.value) and str(raised.value).endswith(".")


def test_links_are_the_pairs_within_reach():
    # Brute force on a jittered lattice; a cube of n^3 has 13 directions of neighbours.
    points = sample.box((0, 0, 0), (5, 5, 5), 1.0)
    pairs = sample.links(points, 1.8)
    n = 5
    edges, faces, corners = 3 * n * n * (n - 1), 6 * n * (n - 1) ** 2, 4 * (n - 1) ** 3
    assert len(pairs) == edges + faces + corners
    jittered = sample.random((-3, 0, 2), (4, 1, 9), 200, seed=3)
    d = np.linalg.norm(jittered[:, None] - jittered[None], axis=2)
    expected = np.argwhere(np.triu(d <= 1.1, k=1))
    np.testing.assert_array_equal(sample.links(jittered, 1.1), expected)
    assert sample.links(np.zeros((0, 3)), 1.0).shape == (0, 2)


def test_rotate_keeps_the_axis_and_turns_right_handed():
    x = np.array([(1.0, 0, 0), (0, 0, 2.0), (3.0, 4.0, 5.0)])
    turned = sample.rotate(x, (0, 0, 2), np.pi / 2)
    np.testing.assert_allclose(turned, [(0, 1, 0), (0, 0, 2), (-4, 3, 5)], atol=1e-15)
    back = sample.rotate(turned, (0, 0, 1), -np.pi / 2)
    np.testing.assert_allclose(back, x, atol=1e-15)
    with pytest.raises(ValueError, match=r"^sample\.rotate: axis must have a length, got"):
        sample.rotate(x, (0, 0, 0), 1.0)
