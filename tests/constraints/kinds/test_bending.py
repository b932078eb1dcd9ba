"""Bending about the edges of triangles: angles, stiffness, and what is bent past all measure."""

import numpy as np
import pytest

import particlesim as ps

RNG = np.random.default_rng(11)


def hinge(fold):
    """Four particles, whose far wing is turned by this angle [rad] about the edge, the z axis."""
    return np.array([(0, 0, 0), (0, 0, 1), (0, -1, 0.5), (-np.sin(fold), np.cos(fold), 0.5)])


def sheet(cells, across=4):
    """Right-angled triangles in the plane y = 0, around a periodic box along z."""
    k = np.arange((cells + 1) * across).reshape(-1, across)
    x = np.stack([k // across, 0 * k, k % across], axis=-1).reshape(-1, 3)
    a, c = k[:-1], k[1:]
    b, d = np.roll(a, -1, axis=1), np.roll(c, -1, axis=1)
    pairs = [(a, c, b), (b, c, d)]
    return x, np.concatenate([np.stack([e.ravel() for e in each], axis=1) for each in pairs])


def edges(triangles):
    """Each edge of a mesh once."""
    return np.unique(
        np.sort(np.concatenate([np.roll(triangles, -k, axis=1)[:, :2] for k in range(3)])), axis=0
    )


def test_fold():
    """From 0 in a plane to pi, positive where the far normal turns about x_1 - x_0."""
    assert np.allclose(np.cross((0, 0, 1), (0, -1, 0.5)), (1, 0, 0))  # the near one
    for fold in (-3.1, -0.4, 0.0, 0.7, 3.0):
        assert ps.Bending.quantity(hinge(fold)[None])[0] == pytest.approx(fold, abs=1e-15)


def test_gradients():
    """Also next to a flat and a closed hinge, and on hinges without symmetry."""
    special = [hinge(fold) for fold in (0.0, 1e-9, 0.7, -2.5, np.pi - 1e-3)]
    x = np.concatenate([*special, RNG.normal(size=(32, 3))])
    tuples = np.arange(len(x)).reshape(-1, 4)
    # A thin triangle is steep on the scale of its height only: h^2 C''' / 6 of check_gradient.
    assert ps.check_gradient(ps.Bending(tuples, rest_angle=0.2), x) < 1e-8
    assert ps.check_gradient(ps.IsometricBending(tuples[5:]), x) < 1e-8


def test_hinges_of_a_mesh():
    """Inner edges only, each once, with a wing of either side."""
    _, triangles = sheet(3)
    found, sides = ps.hinges(triangles), [set(each) for each in triangles.tolist()]
    assert len(found) == len(edges(triangles)) - 2 * 4  # without both ends
    for a, b, c, d in found.tolist():
        assert {a, b, c} in sides and {a, b, d} in sides and c != d
    assert len(ps.hinges([(0, 1, 2)])) == 0
    assert len(ps.hinges([(0, 1, 2), (0, 1, 3), (0, 1, 4)])) == 2  # three sheets at one seam


@pytest.mark.slow
@pytest.mark.parametrize("kind", [ps.Bending, ps.IsometricBending])
def test_cantilever_bends_as_plate_theory_says(kind, device, simulate, precision):
    """Into a cylinder: delta = F L^3 / (3 D b), b all around a periodic box.

    Hinges a cell apart stand for bending everywhere. With the length L from the middle of the last
    cell that is held their sum is (1 + 1/n) / (1 + 1/(2n))^2 = 1 - 1 / (4 n^2) + ... of the theory.
    What is left of the motion, and float32, are far below 0.5 %.
    """
    cells, D, load, around = 12, 200.0, 0.012, 8
    scene = ps.Scene(periodic=((-50, -50, 0), (50, 50, around)))
    x, triangles = sheet(cells + 1, around)
    particles = scene.add_particles(x, mass=0.01, pinned=x[:, 0] < 1.5)
    rows = ps.hinges(triangles)
    d = x[rows[:, 1]] - x[rows[:, 0]]
    length = np.linalg.norm(d - around * np.round(d / around), axis=1)
    soft = 1 / (D * length**2) if kind is ps.Bending else 1 / D  # the areas of a pair make 1
    scene.add_constraint(ps.Distance(edges(triangles)))
    scene.add_constraint(kind(rows, compliance=soft))
    scene.add_interaction(ps.ConstantForce((0, -load / around, 0), particles[-around:]))
    scene.add_interaction(ps.Drag(0.02))
    sim = simulate(scene, device, dt=0.05, substeps=40, iterations=4, precision=precision)
    sim.run(160)
    length = cells + 0.5
    expected = load * length**3 / (3 * D * around)
    assert -sim.position[-around:, 1].mean() == pytest.approx(expected, rel=0.005)
    assert np.ptp(sim.position[-around:, 1]) < 1e-3 * expected


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")  # that such a start fits nothing is told
@pytest.mark.parametrize("kind", [ps.Bending, ps.IsometricBending])
def test_any_stiffness_and_any_fold_stay_bounded(kind, device, simulate, precision):
    """A crumpled sheet, some of it folded flat, of 1e-12 to 1e12 of its weight's stiffness."""
    x, triangles = sheet(6, 6)
    triangles = triangles[(np.ptp(x[triangles][:, :, 2], axis=1) < 2)]  # not round the box
    for compliance in (0.0, 1e-12, 1.0, 1e12):
        scene = ps.Scene()
        crumpled = RNG.normal(size=x.shape)
        crumpled[10:14] = crumpled[10]
        scene.add_particles(x, pinned=x[:, 0] < 0.5)
        scene.add_constraint(kind(ps.hinges(triangles), compliance=compliance))
        scene.add_constraint(ps.Distance(edges(triangles)))
        scene.add_interaction(ps.UniformGravity())
        sim = simulate(scene, device, dt=1 / 60, iterations=2, precision=precision)
        sim.set("position", np.where(x[:, :1] < 0.5, x, crumpled))
        sim.run(120)
        assert np.isfinite(sim.velocity).all()
        assert np.abs(sim.position).max() < 30.0  # nine times its width


@pytest.mark.slow
def test_bad_input(refused):
    flat = ps.Scene()
    flat.add_particles([(0, 0, 0), (1, 0, 0), (2, 0, 0), (0, 1, 0)])
    for kind in (ps.Bending, ps.IsometricBending):
        scene = ps.Scene()
        scene.add_particles(flat.position)
        scene.add_constraint(kind([(0, 1, 2, 3)]))
        with refused(r"hinges\[0\] must have two triangles with an area"):
            ps.Simulation(scene)
        with refused("name different particles"):
            kind([(0, 1, 2, 2)])
        with refused("have shape"):
            kind([(0, 1, 2)])
    with refused(r"rest_angle\[0\]"):
        ps.Bending([(0, 1, 2, 3)], rest_angle=4.0)
