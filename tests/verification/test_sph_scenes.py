"""Scenes of SPH against known answers: errors at sizes that grow, and how fast they fall."""

import numpy as np
import pytest

import particlesim as ps
from cases.waves import fitted
from particlesim.scenes import (
    elliptical_drop,
    poiseuille,
    polytrope,
    standing_wave,
    taylor_green,
    toy_star,
)

slow = pytest.mark.slow


def simulate(module, substeps, dt=None, **options):
    settings = module.settings.replace(substeps=substeps, dt=dt or module.settings.dt)
    return ps.Simulation(module.build(**options), settings, device="cpu")


def slope(sizes, errors):
    """Order at which errors fall with the number of particles along a length."""
    return -np.polyfit(np.log(sizes), np.log(errors), 1)[0]


# Between plates -----------------------------------------------------------------------------------

# Morris et al. (1997), by frames of 0.0225: the speed in the middle, driven and dragged, in units
# of the fastest, 1.25e-5 m/s.
MIDDLE = {
    False: {1: 0.178616, 2: 0.338768, 5: 0.659992, 10: 0.887984},
    True: {1: 0.0184224, 2: 0.0955800, 5: 0.2902752, 10: 0.4309032},
}


@pytest.mark.parametrize("dragged", [False, True])
def test_the_series_is_that_which_is_published(dragged):
    for frame, answer in MIDDLE[dragged].items():
        found = poiseuille.speed(np.array([0.5]), 0.0225 * frame, dragged)[0]
        assert found == pytest.approx(answer, rel=2e-5)


def channel_error(across, dragged):
    """The largest at four times, of the particle whose speed is most off."""
    substeps = int(np.ceil(0.0225 / (0.25 * (1.2 / across) / poiseuille.SOUND)))
    substeps = max(substeps, int(np.ceil(0.0225 / (0.1 * (1.2 / across) ** 2))))
    sim = simulate(poiseuille, substeps, 0.0225, across=across, dragged=dragged)
    errors = []
    for _ in range(10):
        sim.step()
        errors.append(poiseuille.error(sim))
    v = sim.velocity[np.argsort(sim.position[:, 1]), 0]
    assert v[0] < 1.0 / across * 4  # what the plates hold moves along with them there
    if dragged:
        assert v[-1] > 1 - 1.0 / across
    return max(errors[k - 1] for k in MIDDLE[dragged])


@slow
@pytest.mark.parametrize("dragged", [False, True])
def test_flow_between_plates(dragged):
    """Of a parabola the laplacian of what is smoothed is exact but within 3 h of the plates,

    where its image kinks: there (h / gap)^2 of some parts are lost, 0.5 % at 20 across.
    """
    assert channel_error(20, dragged) < 0.01


@slow
@pytest.mark.parametrize("dragged", [False, True])
def test_plates_feel_the_shear(dragged):
    """eta du/dy times their length: of the driven flow 4 on either, of the dragged 1 against it."""
    sim = simulate(poiseuille, 70, across=20, dragged=dragged)
    sim.run(poiseuille.frames)  # what has not come to rest yet is exp(-pi^2) = 5e-5
    length = 8 / 20
    for plate, answer in zip(
        sim.scenes[0].constraints, (1, -1) if dragged else (4, 4), strict=True
    ):
        # As the speed: 0.5 % at 20 across.
        assert sim.force(plate)[0] == pytest.approx(answer * length, rel=0.01)


@slow
def test_flow_between_plates_converges():
    sizes = [10, 20, 40]
    errors = [channel_error(across, False) for across in sizes]
    assert slope(sizes, errors) > 1.8 and errors[-1] < 0.002


# Vortices, drops ----------------------------------------------------------------------------------


def vortices(count):
    """The largest error from t = 0.1 to 1, every 0.1."""
    sim = simulate(taylor_green, int(np.ceil(0.1 / (0.25 * 2 / count / 10.0))), 0.1, count=count)
    errors = []
    for _ in range(10):
        sim.step()
        errors.append(taylor_green.error(sim))
    return max(errors)


@slow
@pytest.mark.parametrize("count, error", [(64, 0.03), (100, 0.02)])
def test_taylor_green(count, error):
    """Kinetic energy falls as exp(-16 pi^2 t / Re); shifted particles make it so.

    Found: 2.5 % too little at t = 1 for 64 across, 1.7 % for 100; unshifted, 41 and 40 %.
    """
    assert vortices(count) < error


def test_the_axes_of_an_ellipse():
    """Those of Monaghan (1994) at 3.8 and 7.6 ms, with A = 100 / s."""
    assert elliptical_drop.axes(0.38) == pytest.approx((0.694821, 1.439219), rel=1e-6)
    assert elliptical_drop.axes(0.76) == pytest.approx((0.514266, 1.944517), rel=1e-6)


@pytest.mark.parametrize(
    "across", [40, pytest.param(80, marks=slow), pytest.param(160, marks=slow)]
)
def test_elliptical_drop(across):
    sim = simulate(elliptical_drop, across, 0.38, across=across)
    for _ in range(2):
        sim.step()
        assert elliptical_drop.error(sim) < 0.02


@slow
def test_elliptical_drop_converges():
    """At 3.8 ms; later it is the surface's particles that leave the lattice, at random."""
    sizes, errors = [20, 40, 80], []
    for across in sizes:
        sim = simulate(elliptical_drop, across, 0.38, across=across)
        sim.step()
        errors.append(elliptical_drop.error(sim))
    assert slope(sizes, errors) > 0.9


# Waves --------------------------------------------------------------------------------------------


@slow
@pytest.mark.parametrize("length", [1.0, 2.0])
def test_standing_wave(length):
    """Periods of 0.800308 and 1.133917 s (g = 9.81, 1 deep), at 96 particles along the wave.

    What is lost is in the surface: its particles see half of their neighbours over 2 h, which is
    4 % of a wave at 96 to it.
    """
    assert standing_wave.period(length) == pytest.approx(
        {1: 0.800308, 2: 1.133917}[length], abs=1e-6
    )
    errors = [abs(fitted(length, length / n)[0] - 1) for n in (48, 96)]
    assert errors[1] < 0.02 and errors[1] < errors[0]


# Stars --------------------------------------------------------------------------------------------


def breath(count, substeps):
    """The largest error of the size over half a period, and the error at its end."""
    sim = simulate(toy_star, substeps, np.pi / 30, count=count)
    errors = []
    for _ in range(30):
        sim.step()
        errors.append(toy_star.error(sim))
    return max(errors), errors[-1]


def test_toy_star_breathes():
    """W averages over h, some (h / R)^2: the star rests at a size that is as much larger."""
    most, last = breath(1000, 8)
    assert most < 0.0125 and last < 0.001  # h / R = 2 / 18; and its period is that of any size


@slow
def test_toy_star_converges():
    sizes = [250, 1000, 4000]
    errors = [breath(count, int(8 * (count / 1000) ** 0.5))[0] for count in sizes]
    assert slope(np.sqrt(sizes), errors) > 1.5


@slow
def test_polytrope_converges():
    """Density within 3 % at 5000 particles."""
    sizes, errors = [625, 5000], []
    for count in sizes:
        sim = simulate(polytrope, int(1.25 * count ** (1 / 3)), count=count)
        sim.run(60)
        errors.append(polytrope.error(sim))
    assert errors[-1] < 0.03 and slope(np.cbrt(sizes), errors) > 1.2
