"""Starts that do not fit what the scene is made of are told, once, when a run begins."""

import contextlib
import warnings

import numpy as np
import pytest

import particlesim as ps

SPACING = 0.05


def told(scene, device, frames=1):
    """What a run warns of."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        sim = ps.Simulation(scene, ps.Settings(substeps=24), device=device)
        with contextlib.suppress(ps.SimulationError):  # what is too dense bursts
            sim.run(frames)
            sim.run(frames)
    return [str(each.message) for each in caught if each.category is ps.StabilityWarning]


def block(factor, group=None):
    scene = ps.Scene()
    x = ps.sample.box((0, 0, 0), (0.5, 0.5, 0.5), SPACING)
    scene.add_particles(x, mass=factor * 1000 * SPACING**3, group="water")
    scene.add_interaction(
        ps.SPH(group, smoothing_length=1.3 * SPACING, rest_density=1000.0,
               equation_of_state=ps.Tait(sound_speed=45.0))
    )  # fmt: skip
    return scene


@pytest.mark.parametrize("factor", [1e-3, 10.0])
def test_masses_that_do_not_make_the_rest_density(factor, device):
    (said, *_) = told(block(factor, "water"), device)
    assert "SPH: mass must make the rest density" in said
    # The density of a lattice is its own to a few per cent at this smoothing length.
    assert float(said.split("about ")[1].rstrip(".")) == pytest.approx(1000 * SPACING**3, rel=0.05)


def test_masses_that_fit_are_not_told(device):
    assert told(block(1.0), device) == []


@pytest.mark.parametrize("radius", [0.0, 0.1])
def test_contacts_of_points_are_told(radius, device):
    scene = ps.Scene()
    scene.add_particles(np.eye(3), radius=radius)
    scene.add_constraint(ps.Contact())
    said = told(scene, device)
    assert len(said) == (radius == 0)
    assert not said or "Contact: radius must be above 0" in said[0]


def test_smoothing_lengths_below_the_spacing_are_told(device):
    for h in (0.5, 0.8):
        scene = block(1.0)
        scene.interactions[0] = ps.SPH(
            smoothing_length=h * SPACING, rest_density=1000.0,
            equation_of_state=ps.Tait(sound_speed=45.0),
        )  # fmt: skip
        (said, *_) = told(scene, device)
        assert "smoothing_length must be above the spacing of the particles" in said
        assert f"got {h * SPACING:g}, at which each makes" in said


@pytest.mark.parametrize(("speed", "words"), [(4.5, 0), (4.6, 1)])
def test_liquids_that_their_sound_is_not_ten_times_as_fast_as_are_told(speed, words, device):
    # Half of it to either side: what it drifts with as a whole is not counted.
    scene = block(1.0)
    x = scene.position
    scene.column("velocity")[:, 0] = 1000.0 + np.where(x[:, 0] > x[:, 0].mean(), speed, -speed)
    said = [each for each in told(scene, device) if "sound_speed" in each]
    assert len(said) == words
    assert not words or "got 45 with a speed of 4.6 at the start; give about 46" in said[0]
