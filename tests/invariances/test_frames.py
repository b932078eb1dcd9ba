"""Every part moves particles alike in other units, elsewhere, turned, mirrored and in motion."""

import numpy as np
import pytest

import particlesim as ps
from cases.frames import ASKEW, MIRROR, QUARTER, Frame, rotation
from cases.parts import along_axes, kinds, particles, scene

STEPS, DT = 12, 0.02
EPS = float(np.finfo(np.float64).eps)
# Velocity-dependent forces of an absolute velocity, and walls that stand still in one frame only,
# are given their velocity by the frame; a field that is fixed in space is not there in another.
AT_REST = {"ParticleForce"}


def moved(names, frame, precision="float64"):
    """Positions and velocities after some steps, as the frame's observer has them."""
    settings = ps.Settings(
        dt=DT * frame.time, substeps=1, precision=precision, watchdog=False, iterations=2
    )
    sim = ps.Simulation(scene(names, frame), settings, device="cpu")
    for _ in range(STEPS):
        sim.step()
    result = sim.get("position").astype(float), sim.get("velocity").astype(float)
    sim.close()
    return result


def assert_same(names, frame, rounding):
    """The motion is the plain one, mapped, to ``rounding`` of sizes of about one."""
    x, v = moved(names, Frame())
    start = particles()[0]
    there, speed = moved(names, frame)
    size = frame.length
    expected = frame.point(x, STEPS * DT)
    assert np.isfinite(there).all()
    assert np.abs(x - start).max() > 1e-3  # or nothing would be tested
    assert np.abs(there - expected).max() <= rounding * size
    assert np.abs(speed - frame.velocity(v)).max() <= rounding * size / frame.time / DT


# A step rounds x, v and forces by some eps of their sizes, about one; pairs at a distance of 1.2
# multiply that by stiffnesses up to 1e2 and STEPS steps let it grow by less than ten.
ROUNDING = 1e4 * EPS


@pytest.mark.parametrize("name", kinds())
@pytest.mark.parametrize(
    "turn", [ASKEW, QUARTER, MIRROR, MIRROR @ ASKEW], ids=["askew", "quarter", "mirror", "both"]
)
def test_turned_and_mirrored(name, turn):
    if along_axes(name) and np.count_nonzero(turn) > 3:
        turn = np.roll(QUARTER @ MIRROR, 1, axis=0)  # another exchange of the axes
    assert_same([name], Frame(turn=turn), ROUNDING)


@pytest.mark.parametrize("name", kinds())
@pytest.mark.parametrize("far", [1.0, 1e6])
def test_elsewhere(name, far):
    """Places are rounded by what they are away from the origin."""
    assert_same([name], Frame(shift=far * np.array([3.0, -7.0, 11.0])), 11 * far * ROUNDING)


@pytest.mark.parametrize("name", kinds())
def test_in_motion(name):
    if name in AT_REST:
        pytest.skip("a field that is fixed in space")
    assert_same([name], Frame(boost=np.array([0.5, -2.0, 1.0])), 10 * ROUNDING)


@pytest.mark.parametrize("name", kinds())
@pytest.mark.parametrize("unit", ["length", "mass", "time"])
@pytest.mark.parametrize(
    "power", [-30, 30, *(pytest.param(k, marks=pytest.mark.slow) for k in (-3, 3))]
)
def test_other_units(name, unit, power):
    assert_same([name], Frame(**{unit: 10.0**power}), ROUNDING)


@pytest.mark.slow
@pytest.mark.parametrize("name", kinds())
@pytest.mark.parametrize("unit", ["length", "mass", "time"])
@pytest.mark.parametrize("power", [-27, -24, -18, -12, -9, -6, 6, 9, 12, 18, 24, 27])
def test_units_far_from_ones_own(name, unit, power):
    assert_same([name], Frame(**{unit: 10.0**power}), ROUNDING)


@pytest.mark.parametrize("name", kinds())
def test_several_units_at_once(name):
    """Nuclei, in metres, kilograms and seconds; and stars in a galaxy."""
    assert_same([name], Frame(length=1e-15, mass=1e-27, time=1e-23), ROUNDING)
    assert_same([name], Frame(length=1e20, mass=1e30, time=1e15), ROUNDING)


@pytest.mark.slow
@pytest.mark.parametrize("name", kinds())
@pytest.mark.parametrize("angle", np.linspace(0.1, 3.1, 7).round(2))
@pytest.mark.parametrize("far", [0.0, 1e3, 1e9])
def test_turned_elsewhere_and_in_motion(name, angle, far):
    turn = np.eye(3) if along_axes(name) else rotation((2, -1, 1), angle)
    boost = np.zeros(3) if name in AT_REST else np.array([-3.0, 2.0, 5.0])
    frame = Frame(turn=turn, shift=far * np.array([1.0, -1.0, 1.0]), boost=boost)
    assert_same([name], frame, max(far, 10.0) * ROUNDING)
