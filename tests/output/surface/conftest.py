"""What the tests of surfaces share."""

import numpy as np
import pytest

import particlesim as ps


@pytest.fixture
def simulated():
    """A function that makes a simulation of particles that touch."""

    def build(x, spacing=1.0, device="cpu", **settings):
        scene = ps.Scene()
        scene.add_particles(x, radius=spacing / 2, group="drops")
        return ps.Simulation(scene, ps.Settings(**settings), device=device)

    return build


@pytest.fixture
def mesh_of(simulated):
    """A function that makes the surface of particles; skips without splashsurf."""
    pytest.importorskip("pysplashsurf")

    def draw(x, spacing=1.0, device="cpu", **options):
        return ps.Surface(simulated(x, spacing, device), **options).mesh()

    return draw


@pytest.fixture
def lattice():
    """A function that makes unit cells with a particle each in the middle, or off it."""

    def build(*cells, jitter=0.0, seed=0):
        x = np.stack(np.meshgrid(*map(np.arange, cells), indexing="ij"), -1).reshape(-1, 3) + 0.5
        return x + np.random.default_rng(seed).uniform(-jitter, jitter, x.shape)

    return build


@pytest.fixture
def assert_whole():
    """A check that a mesh is closed, has no empty triangles, and normals of length 1.

    Every edge belongs to two triangles, which go along it in opposite directions.
    """

    def check(points, triangles, normals):
        edges = triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
        assert len(np.unique(edges, axis=0)) == len(edges)
        assert np.array_equal(np.unique(edges, axis=0), np.unique(edges[:, ::-1], axis=0))
        a, b, c = points[triangles].astype(float).swapaxes(0, 1)
        assert (np.linalg.norm(np.cross(b - a, c - a), axis=1) > 0).all()
        assert np.allclose(np.linalg.norm(normals, axis=1), 1.0, atol=1e-6)

    return check
