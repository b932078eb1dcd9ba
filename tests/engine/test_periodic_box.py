"""Positions in a periodic box: lower <= x < lower + L, and the images that say where from."""

import numpy as np
import pytest

import particlesim as ps

# 49 (1 / 49) and 0.1 (1 / 0.1) round differently; and a lower corner that hides small distances.
BOXES = [(0.0, 10.0), (0.0, 49.0), (-0.05, 0.05), (1000.0, 1003.0)]


def _corners(lower, upper):
    """Positions at the corners, in the box and an image or two away, and just beside them."""
    length = upper - lower
    at = lower + length * np.arange(-2, 4)
    beside = [np.nextafter(at, side) for side in (-np.inf, np.inf)]
    beside += [at.astype(np.float32) * (1 + sign * 2.0**-24) for sign in (-1, 1)]
    return np.concatenate([at, *beside, [lower - 1e-18, lower - 1e-9, upper - 1e-9]])


def _simulation(x, box, velocity=0.0, **settings):
    scene = ps.Scene(periodic=[(side,) * 3 for side in box])
    scene.add_particles(np.repeat(x[:, None], 3, axis=1), velocity=(velocity,) * 3)
    return ps.Simulation(scene, ps.Settings(dt=1.0, substeps=1, **settings), device="cpu")


def _check(sim, box, expected, rounding):
    real = sim.position.dtype.type
    lower, length = real(box[0]), real(box[1] - box[0])
    assert (sim.position >= lower).all()
    assert (sim.position < lower + length).all()
    unwrapped = sim.position + sim.get("image") * (box[1] - box[0])
    np.testing.assert_allclose(unwrapped, np.repeat(expected[:, None], 3, axis=1), 0, rounding)


@pytest.mark.parametrize("box", BOXES)
def test_starts_are_in_the_box(box, precision):
    x = _corners(*box)
    sim = _simulation(x, box, precision=precision)
    rounding = 4 * np.finfo(precision).eps * np.abs(x).max()
    _check(sim, box, x, rounding)
    if box[0] == 0:
        assert sim.position[-3, 0] == 0  # not the upper corner
    sim.reset()
    _check(sim, box, x, rounding)


@pytest.mark.parametrize("compensated", [True, False])
@pytest.mark.parametrize("box", BOXES)
def test_every_wrap_ends_in_the_box(box, compensated, precision):
    """From the corners with velocities of whole, half and odd parts of the box."""
    length = box[1] - box[0]
    for velocity in (0.0, -1e-18, length, -length, 0.5 * length, -0.37 * length):
        x = _corners(*box)
        sim = _simulation(x, box, velocity, precision=precision, compensated=compensated)
        for count in range(1, 5):
            sim.step()
            reach = np.abs(x).max() + count * abs(velocity)
            rounding = 4 * (count + 1) * np.finfo(precision).eps * reach
            _check(sim, box, x + count * velocity, rounding)


@pytest.mark.parametrize("compensated", [True, False])
@pytest.mark.parametrize("box", BOXES)
def test_what_is_written_at_the_corners_is_wrapped(box, compensated, precision):
    x = _corners(*box)
    sim = _simulation(x, box, precision=precision, compensated=compensated)
    image = sim.get("image")
    sim.position = np.repeat(x[:, None], 3, axis=1)
    sim.step()
    expected = x + image[:, 0] * (box[1] - box[0])
    reach = np.abs(x).max() + np.abs(expected).max()
    _check(sim, box, expected, 8 * np.finfo(precision).eps * reach)


def test_what_small_steps_add_up_to_is_not_lost_at_the_corner(device):
    """Compensated sums keep what is too little to leave the lower corner by, below 2^-25 of L."""
    scene = ps.Scene(periodic=((0, None, None), (1, None, None)))
    step = 2.0**-30
    scene.add_particles([(0.0, 0, 0)], velocity=(-step, 0, 0))
    settings = ps.Settings(dt=1.0, substeps=1, precision="float32", compensated=True)
    sim = ps.Simulation(scene, settings, device=device)
    for _ in range(24):
        sim.step()
    x = sim.position.astype(np.float64) + sim.get("position_error") + sim.get("image")
    assert x[0, 0] == -24 * step
