"""What constraints leave alone: angular momentum, rest, and the order in which they were added."""

import itertools

import numpy as np
import pytest

import particlesim as ps

BOX = np.array(list(itertools.product((0.0, 1.0), repeat=3)))
EDGES = list(itertools.combinations(range(8), 2))


def thrown(links):
    scene = ps.Scene()
    scene.add_particles(BOX, velocity=np.cross([1.0, 2.0, 3.0], BOX - 0.5) + np.array([5, 0, 0]))
    scene.add_constraint(links)
    return scene


@pytest.mark.parametrize("substeps", [1, pytest.param(30, marks=pytest.mark.slow)])
@pytest.mark.parametrize("solver", ["gauss_seidel", "jacobi"])
@pytest.mark.parametrize("options", [{}, {"compliance": 1e-3, "damping": 10.0}])
def test_a_thrown_box_keeps_its_momenta(options, solver, substeps, precision, device, simulate):
    """To round-off, two turns of it in 2 s, at 1/60 and at 1/1800 of a second.

    Impulses act where the particles were as the substep began, so that x_old x (D lam) vanishes in
    every tuple. Each of 120 substeps and 28 links rounds an L of 4 to 12 by some last bits, which
    add up like a random walk: sqrt(120 substeps 28) eps, 400 for the finer one, and some.
    """
    scene = thrown(ps.Distance(EDGES, **options))
    knobs = {"substeps": substeps, "solver": solver, "precision": precision}
    sim = simulate(scene, device, dt=1 / 60, **knobs)
    before = sim.diagnostics()
    sim.run(120)
    after, eps = sim.diagnostics(), np.finfo(precision).eps
    size = np.abs(before.angular_momentum).max()
    left = np.abs(after.angular_momentum - before.angular_momentum).max() / size
    assert left < 40 * np.sqrt(substeps * 120) * eps
    assert np.abs(after.momentum - before.momentum).max() < 40 * np.sqrt(120 * substeps) * 40 * eps


def slope(parts):
    n = np.array([np.sin(0.35), np.cos(0.35), 0])
    x = np.array([(0, 0, 0), (0.376, -0.137, 0), (0.303, 0.4, 0)]) + 0.1 * n
    scene = ps.Scene()
    scene.add_particles(x, radius=0.1)
    scene.add_interaction(ps.UniformGravity((0, -9.81, 0)))
    made = {
        "plane": ps.PlaneBoundary((0, 0, 0), n, friction=2.0),
        "rods": ps.Distance([(0, 1), (1, 2), (0, 2)]),
        "contact": ps.Contact(friction=0.5),
    }
    for name in parts:
        scene.add_constraint(made[name])
    return scene


@pytest.mark.parametrize("parts", list(itertools.permutations(["plane", "rods", "contact"])))
def test_friction_holds_at_every_order(parts, device):
    """A rigid triangle on a slope of 20 degrees at mu = 2, 10 s after it has come to rest."""
    sim = ps.Simulation(slope(parts), device=device)
    sim.run(60)
    start = sim.position.copy()
    sim.run(600)
    assert np.abs(sim.position - start).max() < 1e-5 * 0.1


@pytest.mark.parametrize("damping", [10.0, 100.0])
def test_rest_does_not_know_of_damping(damping, device):
    """A hanging chain of 10 springs is as long as one without dampers."""
    lengths = []
    for beta in (0.0, damping):
        scene = ps.Scene()
        x = [(0, -0.1 * i, 0) for i in range(11)]
        scene.add_particles(x, mass=0.1, pinned=np.arange(11) == 0)
        scene.add_interaction(ps.UniformGravity((0, -9.81, 0)))
        scene.add_interaction(ps.Drag(0.3))
        links = [(i, i + 1) for i in range(10)]
        scene.add_constraint(ps.Distance(links, compliance=1e-3, damping=beta))
        sim = ps.Simulation(scene, device=device)
        sim.run(1500)
        lengths.append(-sim.position[-1, 1])
    assert lengths[1] == pytest.approx(lengths[0], rel=1e-3)


@pytest.mark.slow
def test_damping_is_that_of_a_damper(device, simulate):
    """A pair with a spring k and a damper beta: x'' = -(k x + beta x') / mu, mu = m / 2.

    At k = 1000 and beta = 5 the amplitude falls by exp(-beta t / (2 mu)) = exp(-5 t), and the
    period is 2 pi / sqrt(2000 - 25). Implicit Euler adds omega^2 dt / 2 = 0.1 /s at 1e-4 s.
    """
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0), (1.01, 0, 0)])
    scene.add_constraint(ps.Distance([(0, 1)], 1.0, compliance=1e-3, damping=5.0))
    period = 2 * np.pi / np.sqrt(2000 - 25)
    sim = simulate(scene, device, dt=period, substeps=round(period / 1e-4), precision="float64")
    sim.run(4)
    stretch = np.diff(sim.position[:, 0])[0] - 1
    assert np.log(0.01 / stretch) / (4 * period) == pytest.approx(5.1, rel=0.01)
