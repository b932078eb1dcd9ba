"""Cloth that lies on itself, and cloth that a ball tears."""

import numpy as np
import pytest

import particlesim as ps
from particlesim.constraints.bodies.cloth import _widest

SIDE = 1 / 16  # of the squares
RADIUS = 0.44 * SIDE


def test_how_wide_a_triangle_is():
    """The largest distance of a point in it from its nearest corner, against a search."""
    rng = np.random.default_rng(2)
    corners = rng.normal(size=(12, 3, 3))
    k = np.stack(np.meshgrid(*[np.arange(301)] * 2), axis=-1).reshape(-1, 2)
    k = k[k.sum(axis=1) <= 300] / 300
    points = np.column_stack([k, 1 - k.sum(axis=1)]) @ corners
    gaps = np.linalg.norm(points[:, :, None] - corners[:, None], axis=-1).min(axis=2).max(axis=1)
    # The search has points within a grid of 1 / 300 of the sides.
    longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    assert (gaps <= _widest(corners) + 1e-12).all()
    assert (_widest(corners) - gaps < longest / 300).all()


def folded(self_collision):
    """A square metre, bent over in a half-circle so that one half hangs above the other."""
    flat, triangles = ps.sample.rectangle((0, 0, 0), [(0, 0, 1), (1, 0, 0)], cells=16)
    bend = 0.08  # radius of the half-circle
    arc = np.pi * bend
    low = 0.5 * (1 - arc)
    x = flat[:, 0]
    turn = np.clip((x - low) / bend, 0, np.pi)
    along = np.minimum(x, low) + bend * np.sin(turn) - np.maximum(x - low - arc, 0)
    place = np.column_stack([along, RADIUS + bend * (1 - np.cos(turn)), flat[:, 2]])
    scene = ps.Scene()
    scene.add_interaction(ps.UniformGravity((0, -9.81, 0)))
    scene.add_cloth(
        place, triangles, areal_density=0.2, radius=RADIUS, stiffness=500.0,
        bending_stiffness=1e-5, self_collision=self_collision, self_friction=0.3,
    )  # fmt: skip
    scene.add_constraint(ps.PlaneBoundary((0, 0, 0), (0, 1, 0), friction=0.5))
    return scene, x > low + arc + 2 * SIDE


@pytest.mark.slow
@pytest.mark.parametrize("self_collision", [True, False])
def test_a_folded_cloth_lies_on_itself(self_collision, device):
    """Its upper half rests on the lower one, between vertices or on them; else it falls through."""
    scene, upper = folded(self_collision)
    sim = ps.Simulation(scene, ps.Settings(dt=1 / 60, substeps=10), device=device)
    sim.run(180)
    assert np.abs(sim.velocity).max() < 1e-3
    height = sim.position[upper, 1] - RADIUS
    # At most on top of a vertex; at least over the middle of three, SIDE / sqrt(2) from each.
    most, least = 2 * RADIUS, np.sqrt(4 * RADIUS**2 - SIDE**2 / 2)
    if self_collision:
        assert least < height.min() and height.max() < most
    else:
        assert height.max() < 1e-3 * RADIUS


def shot():
    """A heavy ball is thrown at a sheet that is held at its rim."""
    flat, triangles = ps.sample.rectangle((-0.5, 0, -0.5), [(0, 0, 1), (1, 0, 0)], cells=16)
    scene = ps.Scene()
    cloth = scene.add_cloth(
        flat, triangles, areal_density=0.2, radius=RADIUS, stiffness=500.0,
        bending_stiffness=1e-2, break_force=4.0, pinned=np.abs(flat[:, [0, 2]]).max(axis=1) > 0.49,
    )  # fmt: skip
    ball = scene.add_particles([(0.01, 0.2, 0.02)], mass=0.5, radius=0.1, velocity=(0, -8, 0))
    scene.add_constraint(ps.Contact())
    return scene, cloth, ball


@pytest.mark.slow
def test_a_ball_tears_a_sheet(device):
    """It goes through; hinges are gone just where a side of a triangle is torn."""
    scene, cloth, ball = shot()
    sim = ps.Simulation(scene, ps.Settings(dt=1 / 60, substeps=20), device=device)
    sim.run(30)
    assert sim.position[ball.indices[0], 1] < -1.0 and sim.velocity[ball.indices[0], 1] < -1.0
    stretch, bend = cloth.constraints["stretch"], cloth.constraints["bend"]
    torn = {tuple(pair) for pair in np.sort(stretch.particles[sim.broken(stretch)]).tolist()}
    gone = sim.broken(bend)
    assert 10 < len(torn) < len(stretch.particles) / 2
    sides = [(0, 1), (0, 2), (1, 2), (0, 3), (1, 3)]
    rows = np.sort(bend.particles[:, sides], axis=2).tolist()
    expected = [any(tuple(side) in torn for side in five) for five in rows]
    assert gone.tolist() == expected
    assert not sim.force(bend)[gone].any()  # and no longer pull
    sim.reset()
    assert not sim.broken(bend).any()


def test_edges_of_hinges(refused):
    pairs = [(0, 1), (0, 2), (1, 2), (0, 3), (1, 3)]
    with refused("edges must be a Distance with a break_force"):
        ps.Bending([(0, 1, 2, 3)], edges=ps.Distance(pairs))
    edges = ps.Distance(pairs, break_force=1.0)
    hinge = ps.Bending([(0, 1, 2, 3)], compliance=1.0, edges=edges)
    with refused("break_force must be None"):
        hinge.as_force()
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0), (0, 0, 1), (0, -1, 0.5), (0, 1, 0.5)])
    scene.add_constraint(hinge)
    scene.add_constraint(edges)
    with refused("edges must be in the scene before the hinges"):
        ps.Simulation(scene, ps.Settings(dt=0.01), device="cpu")
