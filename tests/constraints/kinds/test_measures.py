"""Angles, areas and volumes: gradients, known answers, and starts that are nearly nothing."""

import numpy as np
import pytest

import particlesim as ps

RNG = np.random.default_rng(3)
CORNER = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], dtype=float)


def area(x):
    return 0.5 * np.linalg.norm(np.cross(x[1] - x[0], x[2] - x[0]))


def volume(x):
    return np.linalg.det(x[1:4] - x[0]) / 6


def angle(x):
    u, w = x[0] - x[1], x[2] - x[1]
    return np.arccos(u @ w / np.linalg.norm(u) / np.linalg.norm(w))


KINDS = {
    "angle": (ps.Angle, angle, 3, 1.2),
    "area": (ps.Area, area, 3, 0.7),
    "volume": (ps.Volume, volume, 4, 0.3),
}


@pytest.mark.parametrize("name", [pytest.param(n, marks=[pytest.mark.slow]) for n in KINDS])
def test_gradient_and_rest(name, device, simulate, precision):
    """Projected, each tuple has its rest value; that of the start leaves all where it was."""
    kind, measured, k, rest = KINDS[name]
    x = RNG.normal(size=(8 * k, 3))
    tuples = np.arange(8 * k).reshape(8, k)
    # A thin one is steep on the scale of its height only, see check_gradient.
    assert ps.check_gradient(kind(tuples, rest), x[: 8 * k]) < 1e-7
    for given in (rest, None):
        scene = ps.Scene()
        scene.add_particles(x, mass=RNG.uniform(0.5, 2, len(x)))
        scene.add_constraint(kind(tuples, given))
        sim = simulate(scene, device, precision=precision)
        sim.project(40)
        tolerance = 300 * float(np.finfo(precision).eps)  # products of lengths of up to ten
        for row in tuples:
            aim = measured(x[row]) if given is None else rest
            assert measured(sim.position[row]) == pytest.approx(aim, abs=tolerance)
        if given is None:
            assert np.abs(sim.position - x).max() < 10 * tolerance  # over a slope


@pytest.mark.slow
@pytest.mark.parametrize("turned", [0.3, 0.0, -1.0])
def test_flat_and_inside_out_come_right(turned, device, simulate, precision):
    """By their own volume's gradient, which a flat one has across it."""
    x = CORNER * (1, 1, turned)
    scene = ps.Scene()
    scene.add_particles(x)
    scene.add_constraint(ps.Volume([(0, 1, 2, 3)], 1 / 6))
    sim = simulate(scene, device, precision=precision)
    sim.project(30)
    assert volume(sim.position) == pytest.approx(1 / 6, rel=20 * float(np.finfo(precision).eps))


@pytest.mark.slow
def test_nearly_nothing_is_stopped_or_right(device, simulate):
    """A rigid one of a thousandth of its size leaps out of bounds: no silent nonsense."""
    scene = ps.Scene()
    scene.add_particles(1e-3 * CORNER)
    scene.add_constraint(ps.Volume([(0, 1, 2, 3)], 1 / 6))
    sim = simulate(scene, device)
    with pytest.raises(ps.SimulationError, match="Volume"):
        sim.run(10)


@pytest.mark.slow
def test_inside_out_comes_back_in_motion(device, simulate, precision):
    """As a soft spring of its volume does, without more than the energy that it held."""
    x = CORNER * (1, 1, -1.0)
    scene = ps.Scene()
    scene.add_particles(x)
    part = scene.add_constraint(ps.Volume([(0, 1, 2, 3)], 1 / 6, compliance=1e-2))
    scene.add_interaction(ps.Drag(5.0))
    sim = simulate(scene, device, substeps=10, precision=precision)
    most = 0.0
    for _ in range(600):
        sim.step()
        most = max(most, sim.diagnostics().kinetic[0])
    assert volume(sim.position) == pytest.approx(1 / 6, rel=1e-3)
    assert most < (2 / 6) ** 2 / 2e-2
    assert sim.force(part)[0] < 1e-2


@pytest.mark.slow
def test_a_pressed_tetrahedron_has_its_bulk_modulus(device, simulate):
    """compliance V_0 / K: a pressure p on its faces takes p / K of its volume, forces A p / 3."""
    K, p = 1e4, 10.0
    x = np.array([(1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)], dtype=float)
    V = volume(x)
    scene = ps.Scene()
    scene.add_particles(x, mass=1.0)
    part = scene.add_constraint(ps.Volume([(0, 1, 2, 3)], compliance=abs(V) / K))
    face = 0.25 * np.sqrt(3) * 8  # of side sqrt(8)
    normal = x / np.linalg.norm(x, axis=1)[:, None]
    for a in range(4):
        scene.add_interaction(ps.ConstantForce(-p * face / 3 * normal[a], [a]))
    scene.add_interaction(ps.Drag(50.0))
    sim = simulate(scene, device, dt=0.01, substeps=4)
    sim.run(400)
    # The force turns with p / K of the lengths, which are 1e-3 / 3 shorter: 1e-3 of the answer.
    assert 1 - volume(sim.position) / V == pytest.approx(p / K, rel=2e-3)
    assert sim.force(part)[0] == pytest.approx(p * face / 3, rel=2e-3)


@pytest.mark.slow
def test_a_rod_of_angles_bends_as_a_beam(device, simulate, precision):
    """delta = F L^3 / (3 E I) with compliance l / (E I), the length from the last held middle.

    The sum over hinges is (1 + 1/n) / (1 + 1/(2n))^2 = 1 - 1 / (4 n^2) + ... of it.
    """
    pieces, stiffness, load = 12, 800.0, 0.02
    scene = ps.Scene()
    x = np.stack([np.arange(pieces + 2.0), *np.zeros((2, pieces + 2))], axis=1)
    rod = scene.add_particles(x, mass=0.05, pinned=x[:, 0] < 1.5)
    k = np.arange(len(x))
    scene.add_constraint(ps.Distance(np.stack([k[:-1], k[1:]], axis=1)))
    triples = np.stack([k[:-2], k[1:-1], k[2:]], axis=1)
    scene.add_constraint(ps.Angle(triples, np.pi, compliance=1 / stiffness))
    scene.add_interaction(ps.ConstantForce((0, -load, 0), rod[-1:]))
    scene.add_interaction(ps.Drag(0.1))
    sim = simulate(scene, device, dt=0.05, substeps=40, iterations=4, precision=precision)
    sim.run(200)
    expected = load * (pieces + 0.5) ** 3 / (3 * stiffness)
    assert -sim.position[-1, 1] == pytest.approx(expected, rel=0.005)


@pytest.mark.slow
def test_bad_input(refused):
    for kind, row, what in (
        (ps.Angle, (0, 1, 2), "a middle away"),
        (ps.Area, (0, 2, 3), "an area"),
        (ps.Volume, (0, 1, 2, 3), "a volume"),
    ):
        scene = ps.Scene()
        scene.add_particles([(0, 0, 0), (0, 0, 0), (2, 0, 0), (3, 0, 0)])
        scene.add_constraint(kind([row]))
        with refused(what):
            ps.Simulation(scene)
        with refused("hold indices from 0 up"):
            kind([[-1, *row[1:]]])
        with refused("name different particles"):
            kind([[row[1], *row[1:]]])
    with refused(r"rest_angle\[0\]"):
        ps.Angle([(0, 1, 2)], 3.2)


@pytest.mark.slow
@pytest.mark.parametrize("height", [1e-12, 1e-6, 1e-3])
def test_a_nearly_collapsed_area_comes_back(height, device, simulate, precision):
    """Without more than the energy that it held; one on a line has no way to go."""
    for high, expected in ((height, 0.5), (0.0, 0.0)):
        scene = ps.Scene()
        scene.add_particles([(0, 0, 0), (1, 0, 0), (0.3, high, 0)])
        scene.add_constraint(ps.Area([(0, 1, 2)], 0.5, compliance=1e-2))
        scene.add_interaction(ps.Drag(5.0))
        sim = simulate(scene, device, substeps=10, precision=precision)
        most = 0.0
        for _ in range(600):
            sim.step()
            most = max(most, sim.diagnostics().kinetic[0])
        # It swings about rest by a drag of 5 on a mass of 1, e^(-2.5 t) of 0.5 at most: 2e-7 after
        # 6 s; places of size 1 are rounded by 1e-7 in float32, in each of 6000 substeps.
        assert area(sim.position) == pytest.approx(expected, abs=1e-5)
        assert most <= 0.5**2 / 2e-2
