"""Integrators: measured order of convergence, and sums that lose nothing."""

import numpy as np
import pytest
import warp as wp

import particlesim as ps
from particlesim.engine.integrators import METHODS


@ps.law
def pendulum(position: wp.vec3, time: float):
    # Position and time both matter, so that a clock that runs ahead or behind shows.
    return wp.vec3(-wp.sin(position[0]), 0.3 * wp.cos(2.0 * time), 0.0)


def run(method, steps, device, span=2.0):
    scene = ps.Scene()
    scene.add_particles([(1.0, 0, 0)], velocity=(0.5, 0, 0))
    scene.add_interaction(ps.ParticleForce(pendulum))
    settings = ps.Settings(dt=span, substeps=steps, integrator=method, precision="float64")
    sim = ps.Simulation(scene, settings, device=device)
    sim.step()
    return np.concatenate([sim.position[0], sim.velocity[0]])


@pytest.mark.parametrize("method", METHODS)
def test_measured_order_of_convergence(method, device):
    # Richardson: halving dt divides the change by 2^order, to leading order in dt = 0.04; for the
    # higher orders 0.2, where their errors are still far above rounding.
    first = 50 if METHODS[method].order < 4 else 10
    a, b, c = (run(method, steps, device) for steps in (first, 2 * first, 4 * first))
    order = np.log2(np.linalg.norm(a - b) / np.linalg.norm(b - c))
    assert order == pytest.approx(METHODS[method].order, abs=0.05)


@pytest.mark.parametrize("method", ["symplectic_euler", "velocity_verlet"])
def test_a_step_by_hand(method, precision, device):
    scene = ps.Scene()
    scene.add_particles([(1, 0, 0)], velocity=(0, 1, 0), mass=2.0)

    @ps.law
    def pull(position: wp.vec3):
        return -8.0 * position

    scene.add_interaction(ps.ParticleForce(pull))
    settings = ps.Settings(dt=0.5, substeps=1, precision=precision, integrator=method)
    sim = ps.Simulation(scene, settings, device=device)
    sim.step()
    # a = -4 x. All numbers have few bits.
    if method == "symplectic_euler":
        v, x = (-2, 1, 0), (0, 0.5, 0)
    else:
        half, x = (-1, 1, 0), (0.5, 0.5, 0)
        v = np.subtract(half, np.multiply(x, 4 * 0.25))
    np.testing.assert_array_equal(sim.velocity[0], v)
    np.testing.assert_array_equal(sim.position[0], x)


class PositionVerlet(ps.Integrator):
    """Drift dt/2, forces, kick dt, drift dt/2: one of one's own, by public names alone."""

    order = 2

    def begin(self, dt):
        self.drift(0.5 * dt)

    def advance(self, dt):
        self.move(dt, 0.5 * dt)


def test_one_of_ones_own(device):
    a, b, c = (run(PositionVerlet, steps, device) for steps in (50, 100, 200))
    order = np.log2(np.linalg.norm(a - b) / np.linalg.norm(b - c))
    assert order == pytest.approx(2, abs=0.05)  # as above
    # To the same end as the ready one of that order, to a few times the last change.
    reference = run("velocity_verlet", 200, device)
    assert np.linalg.norm(c - reference) < 10 * np.linalg.norm(b - c)


def test_one_of_ones_own_in_checkpoints_and_reports(tmp_path, device):
    scene = ps.Scene()
    scene.add_particles([(1.0, 0, 0)], velocity=(0.5, 0, 0))
    scene.add_interaction(ps.ParticleForce(pendulum))
    settings = ps.Settings(dt=0.1, integrator=PositionVerlet)
    sim = ps.Simulation(scene, settings, device=device)
    assert "PositionVerlet" in str(sim.explain())
    sim.run(2)
    sim.save(tmp_path / "a.npz")
    sim.run(2)
    again = ps.Simulation.load(tmp_path / "a.npz", scene, settings, device=device)
    again.run(2)
    np.testing.assert_array_equal(again.position, sim.position)
    with pytest.raises(ValueError, match="integrator must be the PositionVerlet of"):
        ps.Simulation.load(tmp_path / "a.npz", scene, device=device)
    with pytest.raises(TypeError, match="subclass of Integrator"):
        ps.Simulation(scene, ps.Settings(integrator=int), device=device)


@pytest.mark.parametrize("compensated", [True, False])
def test_free_fall_far_from_the_origin(compensated, device):
    # 10 000 substeps a second, 10 km away, in float32: v dt = 5e-5 is far below half the last bit
    # of x, 2^-11 = 5e-4, and without compensation it is lost.
    n, dt, g = 10_000, 1e-4, 9.81
    scene = ps.Scene()
    scene.add_particles([(1e4, 1e4, -1e4)], velocity=(0.5, 0, 0))
    scene.add_interaction(ps.UniformGravity((0, -g, 0)))
    sim = ps.Simulation(
        scene, ps.Settings(dt=0.1, substeps=n // 10, compensated=compensated), device=device
    )
    for _ in range(10):
        sim.step()
    v, x = sim.velocity[0].astype(float), sim.position[0].astype(float)
    # The closed form of symplectic Euler, as the sum is in float64.
    fall = -g * n * dt
    expected_v = np.array([0.5, fall, 0])
    expected_x = np.array([1e4 + 0.5, 1e4 - g * dt**2 * n * (n + 1) / 2, -1e4])
    if compensated:
        # An increment g dt is right to 3 eps, and so is the sum; v itself is rounded once.
        assert np.abs(v - expected_v).max() <= 4 * np.finfo(np.float32).eps * abs(fall)
        # x is rounded once, to half of its last bit; the increments add 4 eps of the way.
        assert np.abs(x - expected_x).max() <= 2**-11 + 4 * np.finfo(np.float32).eps * 5
    else:
        assert x[0] == 1e4  # 0.5 m/s did nothing at all


@pytest.mark.parametrize("method", METHODS)
def test_pinned_particles_keep_their_velocity(method, precision, device):
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0)], velocity=(1, 0, 0), pinned=True)
    scene.add_particles([(0, 1, 0)])
    scene.add_interaction(ps.UniformGravity())
    scene.add_interaction(ps.Springs([(0, 1)], 10.0))
    settings = ps.Settings(dt=0.5, substeps=4, integrator=method, precision=precision)
    sim = ps.Simulation(scene, settings, device=device)
    sim.step()
    np.testing.assert_array_equal(sim.velocity[0], (1, 0, 0))
    # Whole stages are binary fractions; others are rounded, each to half a last bit of its part.
    rounding = sum(abs(w) for w in METHODS[method].stages) - 1
    rounding *= 0.5 * 0.5 * np.finfo(sim.position.dtype).eps
    np.testing.assert_allclose(sim.position[0], (0.5, 0, 0), rtol=0, atol=rounding)
    assert sim.velocity[1, 1] < -1


@pytest.mark.parametrize("compensated", [True, False])
def test_crossing_a_periodic_box_counts_images(compensated, precision, device):
    scene = ps.Scene(periodic=((-1, None, 0), (3, None, 2)))
    x = np.array([[0.0, 0.0, 0.5], [1.0, 2.0, 1.0]])
    v = np.array([[5.0, 3.0, -1.0], [-7.5, 0.0, 0.25]])
    scene.add_particles(x, velocity=v)
    settings = ps.Settings(dt=0.5, substeps=8, precision=precision, compensated=compensated)
    sim = ps.Simulation(scene, settings, device=device)
    for _ in range(6):
        sim.step()
    # Binary fractions throughout: exact. Unwrapped positions go on in a straight line.
    box = np.array([4.0, 0.0, 2.0])
    np.testing.assert_array_equal(sim.position + sim.get("image") * box, x + 3 * v)
    lower, upper = np.array([-1, -np.inf, 0]), np.array([3, np.inf, 2])
    assert ((sim.position >= lower) & (sim.position < upper)).all()


def test_start_positions_outside_the_box_are_brought_in(device):
    scene = ps.Scene(periodic=((0, None, None), (2, None, None)))
    scene.add_particles([(-0.5, -9, 0), (7.25, 0, 9)])
    sim = ps.Simulation(scene, device=device)
    np.testing.assert_array_equal(sim.position, [(1.5, -9, 0), (1.25, 0, 9)])
