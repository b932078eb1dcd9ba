"""Rigid constraints with velocity Verlet: RATTLE, of second order."""

import itertools

import numpy as np
import pytest

import particlesim as ps

G = 9.81


def double_pendulum(a, b, time, steps=4000):
    """Places of two unit masses on rods of length 1, from rest at these angles, by Runge-Kutta."""

    def rate(y):
        p, q = y[2:]
        d = y[0] - y[1]
        share = 3 - np.cos(2 * d)
        pull = np.sin(d) * (q * q + p * p * np.cos(d))
        first = -3 * G * np.sin(y[0]) - G * np.sin(y[0] - 2 * y[1]) - 2 * pull
        second = 2 * np.sin(d) * (2 * p * p + 2 * G * np.cos(y[0]) + q * q * np.cos(d))
        return np.array([p, q, first / share, second / share])

    y, h = np.array([a, b, 0.0, 0.0]), time / steps
    for _ in range(steps):
        k1 = rate(y)
        k2 = rate(y + h / 2 * k1)
        k3 = rate(y + h / 2 * k2)
        k4 = rate(y + h * k3)
        y = y + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    return places(*y[:2])[1:]


def places(a, b):
    middle = np.array([np.sin(a), -np.cos(a), 0])
    return np.array([np.zeros(3), middle, middle + np.array([np.sin(b), -np.cos(b), 0])])


def swung(substeps, device, integrator="velocity_verlet", precision="float64"):
    scene = ps.Scene()
    scene.add_particles(places(2.0, 2.5), pinned=[True, False, False])
    scene.add_interaction(ps.UniformGravity((0, -G, 0)))
    scene.add_constraint(ps.Distance([(0, 1), (1, 2)], 1.0))
    knobs = {"iterations": 30, "precision": precision, "integrator": integrator}
    sim = ps.Simulation(scene, ps.Settings(dt=0.1, substeps=substeps, **knobs), device=device)
    sim.run(10)
    return sim


@pytest.mark.parametrize(("integrator", "order"), [("velocity_verlet", 2), ("symplectic_euler", 1)])
def test_order_on_the_double_pendulum(integrator, order, device):
    """Error after 1 s against Runge-Kutta's 4 000 steps, whose own is under 1e-9: its slope."""
    exact = double_pendulum(2.0, 2.5, 1.0)
    errors = [
        np.abs(swung(substeps, device, integrator).position[1:] - exact).max()
        for substeps in (10, 20, 40)
    ]
    for coarse, fine in itertools.pairwise(errors):
        assert np.log2(coarse / fine) == pytest.approx(order, abs=0.1)


def test_velocities_are_along_the_rods(device):
    """What a projected velocity is: no part of it stretches a rod, to round-off."""
    sim = swung(10, device)
    for a, b in ((0, 1), (1, 2)):
        rod, v = sim.position[b] - sim.position[a], sim.velocity[b] - sim.velocity[a]
        assert abs(rod @ v) < 1e-12


def test_the_force_is_the_tension(precision, device):
    """Of a pendulum at its lowest: m g + m v^2 / L = 3 m g, let go at a right angle."""
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0), (1, 0, 0)], mass=2.0, pinned=[True, False])
    scene.add_interaction(ps.UniformGravity((0, -G, 0)))
    rod = scene.add_constraint(ps.Distance([(0, 1)]))
    quarter = 1.180340599 * np.pi / 2 * np.sqrt(1 / G)
    settings = ps.Settings(
        dt=quarter, substeps=400, integrator="velocity_verlet", precision=precision, ledger=True
    )
    sim = ps.Simulation(scene, settings, device=device)
    sim.step()
    assert sim.force(rod)[0] == pytest.approx(3 * 2 * G, rel=1e-3)
    assert abs(sim.ledger()["Distance"].work[0]) < 1e-3 * 2 * G
    assert np.abs(sim.ledger().unaccounted).max() < (1e-3 if precision == "float32" else 1e-11)


@pytest.mark.slow
def test_what_else_there_is_goes_with_verlet(device):
    """A block falls onto a floor, rubs and comes to rest; contacts, ropes and dampers take part."""
    scene = ps.Scene()
    x = [(0, 0.3, 0), (0.25, 0.3, 0), (0.1, 0.55, 0)]
    scene.add_particles(x, radius=0.1, velocity=(1, 0, 0))
    scene.add_interaction(ps.UniformGravity((0, -G, 0)))
    scene.add_constraint(ps.PlaneBoundary((0, 0, 0), (0, 1, 0), friction=0.5))
    scene.add_constraint(ps.Contact(friction=0.3))
    scene.add_constraint(ps.Distance([(0, 1), (1, 2), (0, 2)], compliance=1e-5, damping=10.0))
    settings = ps.Settings(integrator="velocity_verlet", substeps=20)
    sim = ps.Simulation(scene, settings, device=device)
    sim.run(120)
    assert np.abs(sim.velocity).max() < 0.02
    assert sim.position[:, 1].min() == pytest.approx(0.1, abs=1e-3)


def test_goes_on_from_a_checkpoint(device, tmp_path):
    """The same bits as without a break."""
    through = swung(5, device, precision="float32")
    again = swung(5, device, precision="float32")
    again.save(tmp_path / "swing.npz")
    resumed = ps.Simulation.load(tmp_path / "swing.npz", again.scenes[0], device=device)
    for sim in (through, resumed):
        sim.run(3)
    assert (through.position == resumed.position).all()
    assert (through.velocity == resumed.velocity).all()
