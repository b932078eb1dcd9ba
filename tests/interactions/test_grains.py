"""Hertzian grains: collisions against closed forms."""

import numpy as np
import pytest

import particlesim as ps

MODULUS, RATIO, R, MASS, SPEED = 1e6, 0.3, 0.05, 1.0, 1.0
K = 2 / 3 * MODULUS / (1 - RATIO**2) * np.sqrt(R / 2)
DEEPEST = (5 / 4 * (MASS / 2) * SPEED**2 / K) ** 0.4
LASTS = 2.94328 * DEEPEST / SPEED


def collision(substeps, device, along=0.0, radius=R, frames=1, **options):
    """Two equal spheres that touch, and meet along x; in a frame and a half of their collision."""
    scene = ps.Scene()
    v = np.array([[SPEED, along, 0], [-SPEED, -along, 0]]) / 2
    scene.add_particles([(0, 0, 0), (2 * radius, 0, 0)], velocity=v, radius=radius, mass=MASS)
    scene.add_interaction(ps.HertzianGrains(modulus=MODULUS, ratio=RATIO, **options))
    settings = ps.Settings(
        dt=1.2 * LASTS / frames, substeps=substeps // frames, precision="float64",
        integrator="velocity_verlet",
    )  # fmt: skip
    return ps.Simulation(scene, settings, device=device)


def test_an_elastic_collision(device):
    """As deep and as long as Hertz's, and elastic, to the second order of 300 steps in it."""
    sim = collision(360, device, frames=360)
    depth, apart, before = [], [], sim.diagnostics().energy[0]
    for _ in range(360):
        sim.step()
        x = sim.position
        depth.append(2 * R - (x[1, 0] - x[0, 0]))
        apart.append(sim.velocity[1, 0] - sim.velocity[0, 0])
        assert sim.diagnostics().energy[0] == pytest.approx(before, rel=1e-4)
    assert max(depth) == pytest.approx(DEEPEST, rel=1e-4)
    assert np.count_nonzero(np.array(depth) > 0) == pytest.approx(300, abs=1)
    assert apart[-1] == pytest.approx(SPEED, rel=1e-5)


@pytest.mark.parametrize("dissipation", [1e-5, 1e-4])
def test_how_much_a_collision_takes(dissipation, device):
    """e = 1 - 1.153449 x + 0.798267 x^2 + 0.266666 x^(5/2) - ..., x = 3/2 A (K/m)^(2/5) v^(1/5).

    Schwager and Poeschel (2008), for a force that never attracts; the next term is about
    0.48 x^3.
    """
    sim = collision(1200, device, dissipation=dissipation)
    sim.step()
    x = 1.5 * dissipation * (K / (MASS / 2)) ** 0.4 * SPEED**0.2
    e = (sim.velocity[1, 0] - sim.velocity[0, 0]) / SPEED
    series = 1 - 1.153449 * x + 0.798267 * x**2 + 0.266666 * x**2.5
    assert e == pytest.approx(series, abs=0.6 * x**3 + 2e-6)
    assert np.abs(sim.velocity.sum(axis=0)).max() < 1e-15


def test_what_slides_is_rubbed(device):
    """As long as it slides it loses mu times the change of the normal velocity (Coulomb 1785).

    Of large spheres, whose normal turns by 1.2 LASTS / (2 R) = 2e-4, for a part of their collision.
    """
    mu = 0.1
    sim = collision(600, device, along=1.0, radius=100.0, friction=mu, sliding=1.0)
    sim.step()
    v = sim.velocity
    lost, turned = 0.5 - v[0, 1], 0.5 - v[0, 0]
    assert lost == pytest.approx(mu * turned, rel=1e-2)
    assert turned > 0.01


def test_points_do_not_touch(device):
    sim = collision(10, device, radius=0.0)
    assert not sim.get("force").any()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"modulus": 0.0}, "modulus must be above 0"),
        ({"modulus": 1.0, "ratio": 0.6}, "ratio must be at most 0.5"),
        ({"modulus": 1.0, "dissipation": -1.0}, "dissipation must be at least 0"),
        ({"modulus": 1.0, "friction": -1.0}, "friction must be at least 0"),
    ],
)
def test_what_does_not_fit_is_refused(options, message):
    with pytest.raises(ValueError, match=message):
        ps.HertzianGrains(**options)


def test_the_step_is_a_part_of_a_collision():
    report = collision(100, "cpu").stability()
    (limit,) = (each for each in report.limits if each.kind == "collision")
    # The hardest that may be: of twice the speed of the fastest.
    assert limit.dt == pytest.approx(LASTS / 20, rel=1e-4)
