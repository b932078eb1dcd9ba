"""Starts that no fluid has: each is told, and what comes of it stays within bounds."""

import warnings

import numpy as np
import pytest

import particlesim as ps

S, G = 0.1, 9.81
ROOM = ((0, 0, 0), (1, 2, 1))


def scene(x, h=1.3, c=60.0, walls=True, gravity=G, dimension=3):
    result = ps.Scene()
    result.add_interaction(ps.UniformGravity((0, -gravity, 0)))
    result.add_particles(x, mass=1000 * S**dimension, radius=S / 2)
    result.add_interaction(
        ps.SPH(smoothing_length=h * S, rest_density=1000.0, equation_of_state=ps.Tait(c),
               viscosity=ps.ArtificialViscosity(0.1), dimension=dimension)
    )  # fmt: skip
    if walls:
        result.add_constraint(ps.BoxBoundary(*ROOM))
    return result


def run(made, frames=1):
    """The simulation after some frames, and what of the fluid was told."""
    sim = ps.Simulation(made, ps.Settings(dt=1 / 60, substeps=48), device="cpu")
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        sim.run(frames)
    said = [str(each.message) for each in caught if each.category is ps.StabilityWarning]
    return sim, [each for each in said if each.startswith("SPH:")]


def moved(amount):
    return ps.sample.box((0, 0, 0), (0.6, 0.4, 0.4), S) + amount


def test_what_lies_in_its_walls_is_told_nothing():
    _, said = run(scene(moved((0.2, 0.0, 0.0))))
    assert said == []


@pytest.mark.parametrize(("side", "behind"), [((-0.3, 0, 0), 2), ((0.2, -0.4, 0.2), 3)])
def test_a_fluid_seeded_inside_walls_is_told_and_brought_in(side, behind):
    """Of rows at -0.25, -0.15, -0.05 ... the wall gives way to the last by its spacing."""
    made = scene(moved(side))
    rows = 6 * 4 if side[1] else 4 * 4
    deep = -made.position.min()
    sim, (said, *_) = run(made, frames=15)
    assert f"in front of BoxBoundary [length], got {behind * rows} of 96 particles" in said
    # Nothing is thrown: a fall within the room, and what boundaries call in by, a radius a frame.
    assert np.linalg.norm(sim.velocity, axis=1).max() < np.sqrt(2 * G * 2) + S / 2 * 60
    # What they overlap the wall by falls to 1/e in 30 frames.
    assert sim.position.min() > 0.5 * S - 1.02 * (deep + 0.5 * S) * np.exp(-15 / 30)


@pytest.mark.parametrize("shift", [0.0, 0.3 * S])
def test_places_seeded_twice_are_told(shift):
    x = moved((0.2, 0, 0.3))
    again = x[np.linalg.norm(x - x.mean(axis=0), axis=1) < 0.15] + shift
    sim, (said, *_) = run(scene(np.concatenate([x, again])), frames=10)
    assert "position must leave particles a spacing apart" in said
    # What two in one place store, c^2 / 7 (2^6 / 6 ...), is theirs alone and is not multiplied: a
    # pair at twice the density has u = c^2 / 7 ((2^6 - 1) / 6 + 1 / 2 - 1) = 1.4 c^2.
    assert np.linalg.norm(sim.velocity, axis=1).max() < np.sqrt(2 * 1.4) * 60


@pytest.mark.parametrize(
    "dimension", [*(pytest.param(d, marks=pytest.mark.slow) for d in (1, 2)), 3]
)
def test_too_few_neighbours_are_told_and_many_are_right(dimension):
    """Under 10 of three dimensions, or as many to a diameter; and over 200, which cost only."""
    upper = (0.8, 0.8 * (dimension > 1), 0.4 * (dimension > 2))
    x = ps.sample.box((0, 0, 0), upper, S)
    for h in (0.45, 0.65):  # reaches of a spacing or less, and of 1.3: 0 and 6 of the cube's 26
        made = scene(x, h, walls=False, gravity=0.0, dimension=dimension)
        _, (said, *_) = run(made)
        assert "smoothing_length must be above the spacing of the particles" in said
    sim, said = run(scene(x, 2.5, walls=False, gravity=0.0, dimension=dimension), frames=5)
    assert said == []  # 523 in a ball of five spacings
    # It keeps its size: what the sum is off by at rest is taken off the rest density.
    assert np.abs(np.ptp(sim.position, axis=0) - np.ptp(x, axis=0)).max() < 0.01 * S


def test_a_sound_that_is_too_slow_for_the_depth_is_told():
    x = moved((0.2, 0, 0.3))
    fall = np.sqrt(2 * G * np.ptp(x[:, 1]))
    assert run(scene(x, c=10.02 * fall))[1] == []
    c = 9.5 * fall
    _, said = run(scene(x, c=c))
    assert f"got {c:.4g} with a speed of {fall:.4g} by a fall from its surface" in said[0]
    assert f"give about {10 * fall:.3g}" in said[0]


@pytest.mark.slow
def test_a_slow_sound_is_told_nothing_where_nothing_falls():
    x = moved((0.2, 0, 0.3))
    assert run(scene(x, c=1.0, gravity=0.0))[1] == []
    assert run(scene(x, c=1.0, walls=False))[1] == []  # it falls as a whole


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: ps.SPH(smoothing_length=0.1, rest_density=-1.0, equation_of_state=ps.Tait(9.0)),
         "rest_density must be above 0"),
        (lambda: ps.SPH(smoothing_length=-0.1, equation_of_state=ps.IdealGas(1.4)),
         "smoothing_length must be above 0"),
        (lambda: ps.Tait(-9.0), "sound_speed must be above 0"),
    ],
)  # fmt: skip
def test_negative_densities_lengths_and_sounds_are_refused(make, words, refused):
    with refused(words):
        make()
