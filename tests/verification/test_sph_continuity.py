"""SPH with density by continuity against known answers: tanks, waves, drops."""

import numpy as np
import pytest

import particlesim as ps
from cases.waves import fitted
from particlesim.scenes import dam_break, elliptical_drop

G = 9.81


def tank(density, across=16, width=1.0):
    """Water in a box for ten seconds, and what its pressure is off a line, in rho g H.

    Returns how much higher it stands than it was poured, the slope of the pressure over rho g, and
    the deviation from the line that fits.
    """
    spacing, c = 1 / across, 10 * np.sqrt(2 * G)
    x = ps.sample.box((0, 0, 0), (1, 1, 0), spacing) - [(1 - width) / 2, 0, 0]
    mass = 1000 * spacing**2
    scene = ps.Scene()
    scene.add_particles(x, mass=mass, radius=spacing / 2)
    scene.add_interaction(ps.UniformGravity((0, -G, 0)))
    scene.add_interaction(
        ps.SPH(smoothing_length=2 * spacing, rest_density=1000.0, dimension=2, density=density,
               equation_of_state=ps.Tait(c), viscosity=ps.ArtificialViscosity(0.1))
    )  # fmt: skip
    scene.add_interaction(ps.Drag(linear=10 * mass))  # stills the sound of the start
    scene.add_constraint(ps.BoxBoundary((0, 0, -np.inf), (width, np.inf, np.inf)))
    substeps = int(np.ceil(0.1 * c / (0.3 * 2 * spacing)))
    sim = ps.Simulation(scene, ps.Settings(dt=0.1, substeps=substeps), device="cpu")
    sim.run(100)
    assert np.linalg.norm(sim.velocity, axis=1).max() < 0.02
    y, p = sim.position[:, 1], sim.get("pressure") / (1000 * G)
    deep = y < 0.9
    slope, offset = np.polyfit(1 - y[deep], p[deep], 1)
    return 2 * y.mean() - 1, slope, np.std(p[deep] - slope * (1 - y[deep]) - offset)


@pytest.mark.slow
def test_tank_at_rest():
    """It stands as high as it was, and its pressure is a line; that of sums is far from smooth.

    At 16 across: by sums 6 to 11 % of rho g H off the line, 0.9 % by continuity, and 0.3 % with
    diffusion.
    """
    noise = {}
    for name, density in (
        ("sums", None),
        ("rates", ps.ContinuityDensity(0.0)),
        ("smooth", ps.ContinuityDensity(0.1)),
    ):
        height, slope, noise[name] = tank(density)
        assert abs(height) < 0.01
        if density is not None:
            assert slope == pytest.approx(1.0, abs=0.02)
    assert noise["smooth"] < 0.5 * noise["rates"] < 0.25 * noise["sums"]
    assert noise["smooth"] < 0.005


@pytest.mark.slow
@pytest.mark.parametrize("width", [0.97, 0.95])
def test_tank_that_fits_no_lattice(width):
    """Walls that come back squeeze the water, which rises by as much; 0.4 % is its weight's."""
    height, slope, noise = tank(ps.ContinuityDensity(0.1), width=width)
    assert height == pytest.approx(1 / width - 1, abs=0.01)
    assert slope == pytest.approx(1.0, abs=0.02) and noise < 0.005


@pytest.mark.slow
@pytest.mark.parametrize("delta", [0.0, 0.1])
@pytest.mark.parametrize("length", [1.0, 2.0])
@pytest.mark.parametrize("across", [48, 96])
def test_standing_wave(length, delta, across):
    """Surfaces are as dense as the rest, so that waves keep their time and height.

    Found, 48 to a wave: 0.5 and 0.1 % off, where sums are 6 and 3 % off; 96: 0.0 and 0.3 %, and
    1 %. Falls of 0.1 /s at most are those of the viscosity, where sums have 0.45 and 0.15.
    """
    period, damping = fitted(length, length / across, ps.ContinuityDensity(delta))
    assert period == pytest.approx(1.0, abs=0.01)
    # Viscosity: nu = alpha h c / 8, and 2 nu k^2 of a wave of 1 at 48 across is 0.37 / s.
    assert damping < 0.2


@pytest.mark.slow
@pytest.mark.parametrize("delta", [0.0, 0.1])
@pytest.mark.parametrize("across", [40, 80])
def test_elliptical_drop(across, delta):
    """Semi-axes within 2 % at 3.8 and 7.6 ms, and no more energy lost than by sums."""
    lost = {}
    for density in (None, ps.ContinuityDensity(delta)):
        scene = elliptical_drop.build(across=across, density=density)
        settings = elliptical_drop.settings.replace(dt=0.38, substeps=across)
        sim = ps.Simulation(scene, settings, device="cpu")
        start = sim.diagnostics().energy[0]
        for _ in range(2):
            sim.step()
            assert elliptical_drop.error(sim) < 0.02
        lost[density is None] = 1 - sim.diagnostics().energy[0] / start
    assert 0 < lost[False] < lost[True]


@pytest.mark.slow
@pytest.mark.parametrize("delta", [0.0, 0.1])
def test_front_of_a_dam_break(delta):
    """Within 5 % of Martin and Moyce's (1952) from t sqrt(2 g / a) = 2 to 3.3, 20 to a column.

    Sooner the front of sums is as much as 6 % off, and this one 10: the gate of the experiment
    takes its time.
    """
    scene = dam_break.build(density=ps.ContinuityDensity(delta))
    sim = ps.Simulation(scene, dam_break.settings, device="cpu")
    sim.run(19)
    for _ in range(13):
        sim.step()
        assert dam_break.error(sim) < 0.05
