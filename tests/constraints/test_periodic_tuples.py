"""Tuples and rest lengths that are long against a periodic box."""

import numpy as np
import pytest
import warp as wp

import particlesim as ps

SIDE = 10.0


@ps.law
def twist(a: wp.vec3, b: wp.vec3, c: wp.vec3, d: wp.vec3):
    """Cosine of a dihedral angle, less 1."""
    n, m = wp.normalize(wp.cross(b - a, c - b)), wp.normalize(wp.cross(c - b, d - c))
    return wp.dot(n, m) - 1.0


@ps.law
def span(a: wp.vec3, b: wp.vec3, c: wp.vec3, d: wp.vec3, length: float):
    """Of a chain, from end to end."""
    return wp.length(d - a) - length


@ps.law
def height(a: wp.vec3, level: float):
    """Of one particle, which has no neighbour in its tuple."""
    return a[2] - level


# Steps of up to 4.5 along an axis: below half a box, and the ends more than a whole box apart.
CHAINS = [
    [(0.5, 5, 5), (2, 6, 5), (3.8, 5, 5), (5.9, 5, 6)],
    [(0.5, 5, 5), (5.0, 6, 5), (9.4, 5, 7), (13.8, 5, 6)],
    [(9.5, 5, 5), (5.0, 1, 5), (1.0, -3, 7), (-3.0, -3, 2.5)],
]


@pytest.mark.parametrize("chain", CHAINS)
@pytest.mark.parametrize("brought_in", [True, False])
def test_a_long_tuple_is_in_one_piece(chain, brought_in, precision, device):
    """Energy and forces in the box are those without one, wherever the particles come back in."""
    found = []
    for periodic in (None, ((0, 0, 0), (SIDE,) * 3)):
        scene = ps.Scene(periodic=periodic)
        x = np.array(chain, dtype=float)
        scene.add_particles(x % SIDE if periodic and brought_in else x)
        bond = ps.Constraint(twist, [(0, 1, 2, 3)], compliance=1.0)
        scene.add_interaction(bond.as_force())
        sim = ps.Simulation(scene, ps.Settings(precision=precision), device=device)
        sim.forces(1.0)
        found.append((sim.diagnostics().potential[0], sim.get("force")))
    assert found[0][0] > 1e-3
    # Positions of up to 14 are rounded, and a turn by that over a lever of at least 1 is felt in
    # the angle; forces are gradients over the same levers times C, of at most 2.
    tolerance = 16 * 14 * float(np.finfo(precision).eps)
    assert found[1][0] == pytest.approx(found[0][0], abs=2 * tolerance)
    np.testing.assert_allclose(found[1][1], found[0][1], rtol=0, atol=2 * tolerance)


@pytest.mark.parametrize(
    "chain", [CHAINS[0], *(pytest.param(each, marks=pytest.mark.slow) for each in CHAINS[1:])]
)
def test_a_long_tuple_is_projected_in_one_piece(chain, precision, simulate):
    """Its ends, more than half a box apart, come 1 nearer to each other along their line."""
    x = np.array(chain, dtype=float)
    line = x[3] - x[0]
    length = np.linalg.norm(line)
    assert np.abs(line).max() > SIDE / 2
    scene = ps.Scene(periodic=((0, 0, 0), (SIDE,) * 3))
    scene.add_particles(x)
    scene.add_constraint(ps.Constraint(span, [(0, 1, 2, 3)], length=length - 1.0))
    sim = simulate(scene, precision=precision)
    start = sim.position.copy()
    sim.project(1)
    expected = np.zeros((4, 3))
    expected[0], expected[3] = 0.5 * line / length, -0.5 * line / length
    rounding = 16 * 14 * np.finfo(precision).eps
    np.testing.assert_allclose(sim.position - start, expected, rtol=0, atol=rounding)


def test_one_particle_has_no_image_to_choose(simulate):
    scene = ps.Scene(periodic=((0, 0, 0), (SIDE,) * 3))
    scene.add_particles([(9.5, 5, 5)])
    scene.add_constraint(ps.Constraint(height, [0], level=1.0))
    sim = simulate(scene)
    sim.project(1)
    np.testing.assert_allclose(sim.position, [(9.5, 5, 1)])


@pytest.mark.parametrize("kind", [lambda *a: ps.Springs(a[0], 1.0, a[1]), ps.Distance])
def test_rest_lengths_of_more_than_half_a_box_are_refused(kind, refused):
    def build(lengths, x=((1, 5, 5), (4, 5, 5), (5, 5, 5)), sides=(SIDE, None, 2 * SIDE)):
        scene = ps.Scene(periodic=([0 if side else None for side in sides], sides))
        scene.add_particles(x)
        part = kind([(0, 1), (1, 2)], lengths)
        (scene.add_constraint if kind is ps.Distance else scene.add_interaction)(part)
        return ps.Simulation(scene, device="cpu")

    with refused(r"rest_length\[1\] must be at most half .* along x, 5 \[length\], got 6"):
        build([3.0, 6.0])
    with refused("along z, 10 .*, got 12"):
        build([3.0, 12.0], sides=(None, None, 2 * SIDE))
    build([3.0, 5.0])
    build(6.0, sides=(None, SIDE * 2, None))
    # From the start, to the nearest image: 4 along x, and 4 along both axes, 5.66.
    build(None, x=[(1, 5, 5), (7, 5, 5), (7, 5, 6)])
    with refused(r"rest_length\[0\] .* along x, 5 .*, got 5\.6"):
        build(None, x=[(1, 5, 5), (7, 5, 9), (7, 5, 8)])


def test_each_world_is_held_to_its_own_box(refused):
    def world(side):
        scene = ps.Scene(periodic=((0, 0, 0), (side,) * 3))
        scene.add_particles([(0, 0, 0), (1, 0, 0)])
        scene.add_interaction(ps.Springs([(0, 1)], 1.0, 3.0))
        return scene

    ps.Simulation([world(6.0), world(9.0)], device="cpu")
    with refused("half the periodic length along x, 2 "):
        ps.Simulation([world(6.0), world(4.0)], device="cpu")
