"""Tables: splines of known cubics, their order, and forces that are their slope."""

import numpy as np
import pytest

import particlesim as ps


def test_a_cubic_is_its_own_spline():
    """To the rounding of numbers of about 10; beyond the ends it goes on straight."""

    def cubic(x):
        return 1 + x * (2 - x * (3 - 0.5 * x))

    x = np.linspace(-1, 2, 13)
    table = ps.Table(x, cubic(x))
    at = np.random.default_rng(0).uniform(-1, 2, 100)
    np.testing.assert_allclose(table(at), cubic(at), rtol=0, atol=1e-14)
    slope = 2 - 6 * 2 + 1.5 * 4
    assert table(2.5) == pytest.approx(cubic(2.0) + 0.5 * slope, abs=1e-13)


def test_it_is_of_fourth_order():
    """A sixteenth of the error at half the spacing; at least 12 times less, as ends count too."""
    off = []
    for count in (41, 81, 161):
        x = np.linspace(0, 3, count)
        at = np.linspace(0, 3, 1001)
        off.append(np.abs(ps.Table(x, np.sin(3 * x))(at) - np.sin(3 * at)).max())
    assert off[0] > 12 * off[1] > 144 * off[2]


def test_forces_are_minus_the_slope_of_energies(precision, device):
    """Of laws that call it, and of those that name another one of the same points, too."""
    r = np.linspace(0.7, 2.6, 200)
    shape = ps.Table(r, 4 * (r**-12 - r**-6))

    @ps.law
    def tabulated(r: float, strength: float):
        return strength * shape(r)

    at = np.array([0.6, 0.9, 1.1, 1.7, 2.4])
    x = np.zeros((5, 2, 3))
    x[:, :, 1] = 20.0 * np.arange(5)[:, None]
    x[:, 1, 0] = at
    scene = ps.Scene()
    scene.add_particles(x.reshape(-1, 3))
    scene.add_interaction(ps.PairPotential(tabulated, cutoff=2.5, strength=2.0))
    sim = ps.Simulation(scene, ps.Settings(precision=precision), device=device)
    # Of differences of a cubic u''' h^2 / 6 is left, and eps u / h of rounding.
    h = 1e-6
    F = -2.0 * (shape(at + h) - shape(at - h)) / (2 * h)
    # Numbers of the cubics are rounded, and so is where in them r is: r / spacing times that.
    allowed = 10 * 200 * float(np.finfo(precision).eps) + 3e-8
    found = sim.get("force").reshape(5, 2, 3)[:, 1, 0]
    np.testing.assert_allclose(found, F, rtol=allowed, atol=allowed)
    assert sim.diagnostics().potential[0] == pytest.approx(2 * shape(at).sum(), rel=allowed)


@pytest.mark.parametrize(
    ("x", "message"),
    [
        ([0, 1, 2], "hold 4 to 4096 points, got 3"),
        ([0, 1, 2, 4], "x must rise by equal distances"),
        ([3, 2, 1, 0], "x must rise by equal distances"),
        ([0, 1, 2, np.nan], "finite"),
    ],
)
def test_what_does_not_fit_is_refused(x, message):
    with pytest.raises(ValueError, match=message):
        ps.Table(x, np.zeros(len(x)))
