"""What is known of ropes and cloth: how they stretch, that nothing makes them explode."""

import numpy as np
import pytest

import particlesim as ps

GRAVITY = 9.81


def hexagonal(columns, rows, side=1.0):
    """A sheet of equilateral triangles, rows along x, and the vertices of its two other ends."""
    k = np.arange((columns + 1) * (rows + 1)).reshape(rows + 1, columns + 1)
    j, i = np.divmod(k, columns + 1)
    vertices = side * np.stack([i + 0.5 * (j % 2), np.sqrt(0.75) * j, 0.0 * j], axis=-1)
    a, b, c, d = k[:-1, :-1], k[:-1, 1:], k[1:, :-1], k[1:, 1:]
    even = (j % 2 == 0)[:-1, :-1, None]
    first = np.where(even, np.stack([a, b, c], -1), np.stack([a, b, d], -1))
    second = np.where(even, np.stack([b, d, c], -1), np.stack([a, d, c], -1))
    triangles = np.concatenate([first.reshape(-1, 3), second.reshape(-1, 3)])
    return vertices.reshape(-1, 3), triangles, k[:, 0], k[:, -1]


@pytest.mark.slow
def test_a_sheet_of_equilateral_triangles_has_the_modulus_that_is_asked_for(device):
    strain, modulus = 1e-4, 300.0
    vertices, triangles, left, right = hexagonal(8, 6)
    scene = ps.Scene()
    scene.add_cloth(vertices, triangles, areal_density=1.0, stiffness=modulus)
    # A stress sigma along x pulls at the edges of the ends, each as high as a row; half a vertex.
    pull = np.zeros(len(vertices))
    for end, sign in ((left, -1.0), (right, 1.0)):
        for row in (end[:-1], end[1:]):
            pull[row] += sign * 0.5 * np.sqrt(0.75) * strain * modulus
    for value in np.unique(pull[pull != 0]):
        scene.add_interaction(ps.ConstantForce((value, 0, 0), np.flatnonzero(pull == value)))
    scene.add_interaction(ps.Drag(linear=10.0))
    settings = ps.Settings(dt=0.05, substeps=20, iterations=5, precision="float64")
    sim = ps.Simulation(scene, settings, device=device)
    sim.run(400)
    u = sim.position - vertices
    # Three springs a triangle are the constant-strain triangle of Poisson's ratio 1/3, to the first
    # order of the strain: what is left is some strains of it.
    along, across = (np.polyfit(vertices[:, k], u[:, k], 1)[0] for k in (0, 1))
    assert along == pytest.approx(strain, rel=10 * strain)
    assert -across / along == pytest.approx(1 / 3, rel=10 * strain)


@pytest.mark.slow
@pytest.mark.parametrize("substeps", [1, 5, 20])
def test_a_flag_of_any_stiffness_stays_bounded(substeps, device):
    mesh = ps.sample.rectangle((0, 0, 0), [(0, 0, 1), (1, 0, 0)], cells=20)
    scenes = []
    for stiffness in (1.0, 1e3, 1e6, 1e9, None):
        scenes.append(ps.Scene())
        scenes[-1].add_cloth(*mesh, areal_density=0.15, stiffness=stiffness, pinned=[0, 20])
        scenes[-1].add_interaction(ps.UniformGravity((0, -GRAVITY, 0)))
    settings = ps.Settings(dt=1 / 60, substeps=substeps)
    sim = ps.Simulation(scenes, settings, device=device)
    mass = scenes[0].mass
    with pytest.warns(ps.SimulationWarning, match="must hold within"):
        for _ in range(300):
            sim.step()
            # It is let go at rest at height 0, and XPBD only takes energy away: what it has of
            # motion it has fallen for, to round-off of float32 positions.
            height = sim.position.reshape(len(scenes), -1, 3)[:, :, 1]
            energy = sim.diagnostics().kinetic + GRAVITY * height @ mass
            assert (energy < 1e-6 * mass.sum() * GRAVITY).all()
    stiff = sim.position.reshape(len(scenes), -1, 3)[1:]
    assert substeps < 20 or stiff[:, :, 1].min() > -1.5  # its diagonal from a corner that is held
