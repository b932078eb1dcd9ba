"""Boundaries along given paths: exact places, smooth velocities, what they carry along."""

import numpy as np
import pytest
import warp as wp

import particlesim as ps
from particlesim.constraints.boundaries.motion import _rotation

G = 9.81
RNG = np.random.default_rng(5)
KEYS = ps.Keyframes(0.3 * np.arange(6), RNG.normal(0, 1, (6, 3)), RNG.normal(0, 1, (6, 3)))


@ps.law
def steady(t: float, rate: wp.vec3):
    return rate * t


@ps.law
def shaken(t: float, amplitude: wp.vec3, omega: float):
    return amplitude * wp.sin(omega * t)


def test_keyframes_are_met_and_smooth():
    """To round-off at each; velocities on both sides differ by what accelerations make of 2e-5."""
    ball = ps.SphereBoundary((1, 2, 3), 1.0, motion=KEYS)
    center = np.array([1, 2, 3])
    for k, time in enumerate(KEYS.times):
        way, turn = ball.pose(time)
        assert np.allclose(way + turn @ center - center, KEYS.places[k], atol=1e-14)
        assert np.allclose(turn, _rotation(KEYS.turns[k]), atol=1e-14)
    for time in KEYS.times[1:-1]:
        rates = []
        for at in (time - 1e-5, time + 1e-5):
            (_, before), (_, after) = ball.pose(at - 1e-6), ball.pose(at + 1e-6)
            rates.append((after - before) / 2e-6)
        assert np.abs(rates[0] - rates[1]).max() < 2e-5 * 300
        assert np.allclose(ball.drift(time), (KEYS.places[np.searchsorted(KEYS.times, time) + 1]
                           - KEYS.places[np.searchsorted(KEYS.times, time) - 1]) / 0.6,
                           atol=1e-3)  # fmt: skip
    assert np.allclose(ball.drift(5.0), 0)


@pytest.mark.slow
def test_a_steady_path_is_a_velocity(precision, device, simulate, scene_of):
    """The same motion by laws and by velocities; rough, and bouncing."""
    rng = np.random.default_rng(1)
    x, v = rng.uniform(-0.5, 0.5, (100, 3)), rng.normal(0, 3, (100, 3))
    rates = {"velocity": (0.5, 0.3, 0), "angular_velocity": (0.3, 0, 0.5)}
    path = ps.Trajectory(steady, turned, rate=rates["velocity"], spin=rates["angular_velocity"])
    found = []
    for motion in (rates, {"motion": path}):
        box = ps.BoxBoundary((-1, -1, -1), (1, 1, 1), friction=0.4, restitution=0.6, **motion)
        scene = scene_of(x, box, velocity=v, radius=0.05, gravity=True)
        sim = simulate(scene, device, precision=precision)
        sim.run(30)
        found.append(sim.position)
    # Velocities by differences are right to 1e-11, and rounded; what just misses bounces later.
    same = np.abs(found[0] - found[1]).max(axis=1) < 1e5 * np.finfo(precision).eps
    assert same.mean() > 0.95


@ps.law
def turned(t: float, spin: wp.vec3):
    return spin * t


@pytest.mark.slow
@pytest.mark.parametrize("factor", [0.9, 1.3])
def test_a_shaken_table_carries_what_its_friction_holds(factor, device, simulate, scene_of):
    """Up to an acceleration of mu g a grain goes along; beyond it slips."""
    mu, omega, h = 0.5, 20.0, 1e-4
    amplitude = factor * mu * G / omega**2
    path = ps.Trajectory(shaken, amplitude=(amplitude, 0, 0), omega=omega)
    table = ps.PlaneBoundary((0, 0, 0), (0, 1, 0), friction=mu, motion=path)
    start = {"velocity": (amplitude * omega, 0, 0), "radius": 0.1, "gravity": True}
    sim = simulate(scene_of([(0, 0.1, 0)], table, **start), device, dt=0.01, substeps=100)
    off = []
    for _ in range(100):
        sim.step()
        off.append(sim.position[0, 0] - table.pose(sim.time)[0][0])
    if factor < 1:
        # A velocity at the end of each substep: off by half of what it changes by, times h.
        assert np.abs(off).max() < 1.1 * amplitude * omega * h
    else:
        assert np.abs(off).max() > 0.05 * amplitude


@pytest.mark.slow
def test_a_lift_by_keyframes(precision, device, simulate, scene_of):
    """What lies on it is a radius above it at every frame."""
    places = [(0, 0, 0), (0, 0.2, 0), (0, 0.25, 0), (0, 0, 0)]
    keys = ps.Keyframes([0.1, 0.4, 0.6, 1.0], places)
    lift = ps.PlaneBoundary((0, 0, 0), (0, 1, 0), motion=keys)
    scene = scene_of([(0, 0.1, 0)], lift, radius=0.1, gravity=True)
    sim = simulate(scene, device, dt=0.01, substeps=4, precision=precision)
    for _ in range(110):
        sim.step()
        height = lift.pose(sim.time)[0][1] + 0.1
        assert sim.position[0, 1] >= height - 4 * np.finfo(precision).eps
        # It is thrown off only where the lift falls faster than g.
        assert sim.position[0, 1] < height + 0.02


@pytest.mark.slow
def test_worlds_have_paths_of_their_own(simulate, scene_of, device, tmp_path):
    """In a batch as alone, and from a checkpoint, bit for bit."""

    def scene(k):
        places = [(0, 0, 0), (0, 0.1, 0), (0.1 * k, 0, 0)]
        keys = ps.Keyframes([0.0, 0.1, 0.2 + 0.1 * k], places)
        box = ps.BoxBoundary((-1, -1, -1), (1, 1, 1), friction=0.5, restitution=0.5, motion=keys)
        return scene_of([(0, -0.9, 0), (0.9, 0, 0)], box, radius=0.1, gravity=True)

    knobs = {"dt": 0.02, "substeps": 4}
    alone = []
    for k in range(2):
        sim = simulate(scene(k), device, **knobs)
        sim.run(20)
        alone.append(sim.position)
    both = simulate([scene(0), scene(1)], device, **knobs)
    both.run(10)
    both.save(tmp_path / "half.npz")
    both.run(10)
    for k in range(2):
        assert np.array_equal(both.world(k).position, alone[k])
    again = ps.Simulation.load(tmp_path / "half.npz", [scene(0), scene(1)], device=device)
    again.run(10)
    assert np.array_equal(again.position, both.position)


@pytest.mark.parametrize(
    ("make", "told"),
    [
        (lambda: ps.Keyframes([0, 0], [(0, 0, 0)] * 2), "times must rise"),
        (lambda: ps.Keyframes([0, 1]), "places must be given"),
        (lambda: ps.Keyframes([0, 1], [(0, 0, 0)]), "row for each of 2 times"),
        (lambda: ps.Trajectory(), "place must be given"),
        (lambda: ps.SphereBoundary((0, 0, 0), 1.0, motion=3), "Trajectory or Keyframes"),
        (lambda: ps.SphereBoundary((0, 0, 0), 1.0, motion=KEYS, velocity=(1, 0, 0)), "be 0 with"),
    ],
)
def test_refusals(make, told):
    with pytest.raises(ValueError, match=told):
        make()
