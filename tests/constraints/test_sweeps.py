"""Sweeps over tuples: solvers, iterations, acceleration, and sweeps until all is met."""

import numpy as np
import pytest

import particlesim as ps


def sheet(n=12):
    """A square of cloth with diagonals, hung at two corners."""
    k = np.arange(n * n).reshape(n, n)
    ends = [
        (k[:-1], k[1:]),
        (k[:, :-1], k[:, 1:]),
        (k[:-1, :-1], k[1:, 1:]),
        (k[1:, :-1], k[:-1, 1:]),
    ]
    pairs = np.concatenate([np.stack([a.ravel(), b.ravel()], axis=1) for a, b in ends])
    scene = ps.Scene()
    x = [(i / n, 0, j / n) for i in range(n) for j in range(n)]
    scene.add_particles(x, mass=0.15 / n**2, pinned=np.isin(np.arange(n * n), [0, n - 1]))
    scene.add_interaction(ps.UniformGravity((0, -9.81, 0)))
    scene.add_interaction(ps.Drag(1e-3))
    scene.add_constraint(ps.Distance(pairs))
    return scene


def hung(device, frames=60, **knobs):
    sim = ps.Simulation(sheet(), ps.Settings(watchdog=False, **knobs), device=device)
    sim.run(frames)
    return sim


def error_of(sim):
    return float(sim.diagnostics().constraint_error[0])


def test_gauss_seidel_is_never_worse_than_jacobi(device):
    """By the error that is left, at equal iterations; both fall as these grow."""
    error = {}
    for solver in ("gauss_seidel", "jacobi"):
        for iterations in (1, 4, 16):
            sim = hung(device, solver=solver, iterations=iterations)
            error[solver, iterations] = error_of(sim)
    for iterations in (1, 4, 16):
        assert error["gauss_seidel", iterations] <= error["jacobi", iterations]
    for solver in ("gauss_seidel", "jacobi"):
        assert error[solver, 16] < error[solver, 4] < error[solver, 1]


@pytest.mark.parametrize("solver", ["gauss_seidel", "jacobi"])
def test_stiffness_does_not_know_of_iterations(solver, device):
    """m 1, k 1000, g 9.81: each of three springs in a row stretches by what hangs below it, within
    0.1 %, from the iterations on that solve it.
    """
    for iterations in {"gauss_seidel": (20, 80), "jacobi": (60, 120)}[solver]:
        scene = ps.Scene()
        scene.add_particles([(0, -0.1 * i, 0) for i in range(4)], pinned=np.arange(4) == 0)
        scene.add_interaction(ps.UniformGravity((0, -9.81, 0)))
        scene.add_constraint(
            ps.Distance([(i, i + 1) for i in range(3)], compliance=1e-3, damping=30)
        )
        settings = ps.Settings(iterations=iterations, solver=solver, precision="float64")
        sim = ps.Simulation(scene, settings, device=device)
        sim.run(200)
        stretch = -np.diff(sim.position[:, 1]) - 0.1
        assert stretch == pytest.approx(9.81e-3 * np.arange(3, 0, -1), rel=1e-3)


@pytest.mark.parametrize("solver", ["gauss_seidel", "jacobi"])
def test_acceleration_pays(solver, device):
    """At 32 iterations half of the error is left, and momentum as it is without."""
    plain, fast = (
        hung(device, substeps=4, iterations=32, solver=solver, acceleration=rho)
        for rho in (0, 0.97)
    )
    assert error_of(fast) < 0.6 * error_of(plain)


def test_acceleration_keeps_momenta(precision, device, simulate):
    """Corrections and multipliers are combined linearly: what adds up to 0 still does."""
    x = np.random.default_rng(0).normal(size=(8, 3))
    scene = ps.Scene()
    scene.add_particles(x, velocity=np.cross([1, 2, 3], x))
    scene.add_constraint(ps.Distance([(i, j) for i in range(8) for j in range(i)]))
    sim = simulate(scene, device, iterations=8, acceleration=0.8, precision=precision)
    before = sim.diagnostics()
    sim.run(50)
    after, tolerance = sim.diagnostics(), 2000 * np.finfo(precision).eps
    assert np.abs(after.momentum - before.momentum).max() < tolerance
    assert np.abs(after.angular_momentum - before.angular_momentum).max() < 10 * tolerance


def test_sweeps_end_when_all_is_met(device):
    """Just below the tolerance that was asked for, with no more sweeps than that takes."""
    for tolerance in (5e-2, 1e-2):
        settings = ps.Settings(iterations=500, constraint_tolerance=tolerance, watchdog=False)
        sim = ps.Simulation(sheet(6), settings, device=device)
        sim.run(6)
        assert 0.1 * tolerance < error_of(sim) <= tolerance * (1 + 1e-5)


def test_what_cannot_be_met_ends_too(device):
    """As many sweeps as there may be, and diagnostics tell what is left."""
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0), (1, 0, 0), (0.5, 0, 0)], pinned=[True, True, False])
    scene.add_constraint(ps.Distance([(0, 2), (1, 2)], 0.4))
    settings = ps.Settings(constraint_tolerance=1e-3, iterations=7, watchdog=False)
    sim = ps.Simulation(scene, settings, device=device)
    sim.run(3)
    # One of both is met; C over its gradient's length, sqrt(2), and the distance.
    assert error_of(sim) == pytest.approx(0.2 / 0.6 / np.sqrt(2), rel=1e-3)
