"""What tests of constraints share: simulations of one substep a frame, and small scenes."""

from types import SimpleNamespace

import numpy as np
import pytest
import warp as wp

import particlesim as ps

G = 9.81


@ps.law
def distance(a: wp.vec3, b: wp.vec3, rest_length: float):
    """As a user would write Distance."""
    return wp.length(b - a) - rest_length


@ps.law
def angle(a: wp.vec3, b: wp.vec3, c: wp.vec3, rest_angle: float):
    """Angle at b."""
    u, v = wp.normalize(a - b), wp.normalize(c - b)
    return wp.acos(wp.dot(u, v)) - rest_angle


@ps.law
def volume(a: wp.vec3, b: wp.vec3, c: wp.vec3, d: wp.vec3, rest_volume: float = 0.0):
    """Of a tetrahedron."""
    return wp.dot(wp.cross(b - a, c - a), d - a) / 6.0 - rest_volume


@ps.law
def reach(a: wp.vec3, anchor: wp.vec3, length: float):
    """Distance from a point in space."""
    return wp.length(a - anchor) - length


@pytest.fixture
def laws():
    """Constraints on one to four particles."""
    return SimpleNamespace(distance=distance, angle=angle, volume=volume, reach=reach)


@pytest.fixture
def simulate():
    """A function: one substep of 10 ms a frame in float64, unless told otherwise."""

    def make(scene, device="cpu", **knobs):
        settings = {"dt": 0.01, "substeps": 1, "precision": "float64", **knobs}
        return ps.Simulation(scene, ps.Settings(**settings), device=device)

    return make


@pytest.fixture
def scene_of():
    """A function: particles at x with constraints, and with gravity where it is asked for."""

    def make(x, *constraints, gravity=False, **particles):
        scene = ps.Scene()
        scene.add_particles(x, **particles)
        if gravity:
            scene.add_interaction(ps.UniformGravity((0, -G, 0)))
        for each in constraints:
            scene.add_constraint(each)
        return scene

    return make


@pytest.fixture
def grains(scene_of):
    """A function: a scene of grains in contact."""

    def make(x, radius=0.5, *, contact=None, **options):
        return scene_of(x, ps.Contact(**(contact or {})), radius=radius, **options)

    return make


@pytest.fixture
def cloud():
    """A function: grains of many sizes and masses that do not touch yet, and fly at each other."""

    def make(count, seed=0, speed=8.0, spread=1.0):
        rng = np.random.default_rng(seed)
        side = 1.05 * count ** (1 / 3) * spread
        x = ps.sample.random((0, 0, 0), (side,) * 3, count, seed=seed, minimum_distance=0.8)
        return {
            "x": x,
            "radius": rng.uniform(0.2, 0.4, count),
            "mass": rng.uniform(0.5, 2.0, count),
            "velocity": speed * (side / 2 - x) / side + rng.normal(0, 2.0, (count, 3)),
        }

    return make


@pytest.fixture
def least_gap():
    """A function: the smallest r - R_i - R_j of all pairs."""

    def make(x, radius):
        radius = np.broadcast_to(radius, len(x))
        r = np.linalg.norm(x[:, None] - x[None], axis=-1) - radius[:, None] - radius
        return r[~np.eye(len(x), dtype=bool)].min()

    return make


@pytest.fixture
def pair(scene_of):
    """A function: a scene of two particles."""

    def make(*, x=((0, 0, 0), (1, 0, 0)), **options):
        return scene_of(x, **options)

    return make


@pytest.fixture
def cloth():
    """A function: positions and pairs of a small square cloth with diagonals, pulled about."""

    def make(n=6, seed=0):
        k = np.arange(n * n).reshape(n, n)
        ends = [(k[:-1], k[1:]), (k[:, :-1], k[:, 1:]), (k[:-1, :-1], k[1:, 1:])]
        pairs = np.concatenate([np.stack([a.ravel(), b.ravel()], axis=1) for a, b in ends])
        x = np.stack([k // n, 0 * k, k % n], axis=-1).reshape(-1, 3) * 0.1
        return x + np.random.default_rng(seed).normal(0, 0.02, x.shape), pairs

    return make
