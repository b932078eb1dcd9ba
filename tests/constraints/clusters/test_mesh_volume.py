"""Enclosed volumes: Laplace's law, momentum, several meshes, and meshes that are not closed."""

import numpy as np
import pytest
import warp as wp

import particlesim as ps
from cases.worlds import equal_alone, goes_on_after_reset_and_save

EPS = float(np.finfo(np.float64).eps)
CORNERS = np.concatenate([np.eye(3), -np.eye(3)])  # of an octahedron
FACES = np.array([
    (0, 1, 2), (1, 3, 2), (3, 4, 2), (4, 0, 2), (1, 0, 5), (3, 1, 5), (4, 3, 5), (0, 4, 5)
])  # fmt: skip


@ps.law
def area(a: wp.vec3, b: wp.vec3, c: wp.vec3):
    """Of a triangle."""
    return 0.5 * wp.length(wp.cross(b - a, c - a))


def volume(x, faces):
    a, b, c = np.moveaxis(x[faces], 1, 0)
    return np.einsum("ti,ti->", a, np.cross(b, c)) / 6


def sphere(times):
    """An octahedron whose triangles were divided in four so often, on the unit sphere."""
    x, faces = list(CORNERS), FACES.tolist()
    for _ in range(times):
        middles, finer = {}, []
        for corners in faces:
            between = []
            for a, b in zip(corners, np.roll(corners, -1).tolist(), strict=True):
                edge = min(a, b), max(a, b)
                if edge not in middles:
                    middles[edge] = len(x)
                    x.append((x[a] + x[b]) / np.linalg.norm(x[a] + x[b]))
                between.append(middles[edge])
            p, q, r = between
            a, b, c = corners
            finer += [(a, p, r), (p, b, q), (r, q, c), (p, q, r)]
        faces = finer
    return np.array(x), np.array(faces)


def test_a_free_mesh_takes_its_volume_and_keeps_its_momentum(simulate, scene_of):
    """Two octahedra in one constraint, one blown up and one, whose triangles face inwards,
    let down; both spin.
    """
    rng = np.random.default_rng(0)
    x = np.concatenate([CORNERS * (1.0, 1.2, 0.8), CORNERS * 0.5 + (3.0, 0, 0)])
    v = np.cross((1, 2, 3), x) + rng.normal(0, 0.3, x.shape)
    body = ps.MeshVolume([FACES, FACES[:, ::-1] + 6], pressure=[1.3, 0.6])
    sim = simulate(scene_of(x, body, velocity=v, mass=rng.uniform(0.5, 2, 12)), iterations=3)
    before = sim.diagnostics()
    sim.run(50)
    after, y = sim.diagnostics(), sim.position
    for k, factor in ((0, 1.3), (6, 0.6)):
        V_0 = volume(x[k : k + 6], FACES)
        # Newton's method: of changes of some per cent in a substep nothing is left in three sweeps.
        assert volume(y[k : k + 6], FACES) == pytest.approx(factor * V_0, rel=1e-9)
    # 50 substeps of 12 particles of some kg round velocities of 5 m/s, all one way, at 4 m.
    worst = 50 * 12 * 2 * 5 * EPS
    assert np.abs(after.momentum - before.momentum).max() < worst
    assert np.abs(after.angular_momentum - before.angular_momentum).max() < 4 * worst


@pytest.mark.slow
def test_a_bubble_obeys_laplaces_law(simulate):
    """A membrane of tension T holds the pressure p = 2 T / R, and any mesh at rest
    p = sum 2 T_t A_t / (3 V), by virtual work of swelling; here T_t = A_t / alpha.
    """
    x, faces = sphere(3)
    alpha, scene = 0.01, ps.Scene()
    scene.add_particles(x, mass=0.1)
    scene.add_interaction(ps.Drag(3.0))
    scene.add_constraint(ps.Constraint(area, faces, compliance=alpha))
    balloon = scene.add_constraint(ps.MeshVolume(faces, pressure=1.2))
    sim = simulate(scene, iterations=2)
    sim.run(500)
    y = sim.position
    a, b, c = np.moveaxis(y[faces], 1, 0)
    A, V = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1), volume(y, faces)
    R = np.linalg.norm(y - y.mean(axis=0), axis=1).mean()
    assert pytest.approx(1.2 * volume(x, faces), rel=1e-6) == V
    # At rest but for what drag leaves after 5 s, and for what two sweeps leave.
    (p,) = sim.force(balloon)
    assert p == pytest.approx(2 * np.square(A).sum() / alpha / (3 * V), rel=1e-3)
    # Tensions differ between triangles by some tenths, and count by their squares.
    T = np.square(A).sum() / A.sum() / alpha
    assert p == pytest.approx(2 * T / R, rel=0.02)


@pytest.mark.slow
def test_a_soft_one_and_one_that_bursts(simulate, scene_of):
    """p = (V_0 - V) / alpha in the first substep; beyond what it bears it bursts."""
    x = 0.9 * CORNERS  # 0.729 of the volume
    V_0, alpha = volume(CORNERS, FACES), 10.0
    for limit in (None, 1e-3):
        body = ps.MeshVolume(FACES, rest_volume=V_0, compliance=alpha, burst_pressure=limit)
        sim = simulate(scene_of(x, body), iterations=3)
        sim.run(1)
        p = sim.force(body)[0]
        # Nothing has moved yet to speak of.
        assert p == pytest.approx((V_0 - volume(x, FACES)) / alpha, rel=1e-3)
        assert sim.broken(body).tolist() == [limit is not None]


@pytest.mark.slow
def test_worlds_resets_and_checkpoints(simulate, tmp_path):
    def scene(times):
        x, faces = sphere(times)
        made = ps.Scene(periodic=((0, 0, 0), (5, 5, 5)))
        made.add_particles(x + 0.3, velocity=0.2 * np.sin(9 * x))
        made.add_constraint(ps.MeshVolume(faces, pressure=1.1 + 0.1 * times))
        return made

    scenes = [scene(1), scene(3)]  # of one chunk, and of two
    equal_alone(simulate, scenes, "cpu", 20)
    goes_on_after_reset_and_save(
        lambda given, device: simulate(given, device), scenes, "cpu", tmp_path / "run.npz"
    )


@pytest.mark.parametrize(("faces", "match"), [
    (FACES[:-1], "close the mesh"), ([*FACES[:-1], FACES[-1][::-1]], "go round the same way"),
    ([(0, 1, 1)], "three different corners"), ([(0, 1, -2)], "triangles must hold indices"),
    ([(0.5, 1, 2)], "whole numbers"),
])  # fmt: skip
def test_meshes_that_are_not_closed(faces, match, refused):
    with refused(match):
        ps.MeshVolume(faces)


def test_more_bad_input(refused, simulate, scene_of):
    with refused("enclose a volume above 0"):
        simulate(scene_of(CORNERS * (1, 1, 0), ps.MeshVolume(FACES)))
    with refused("pressure"):
        ps.MeshVolume(FACES, pressure=0.0)
    with refused("indices from 0 to 4"):
        simulate(scene_of(CORNERS[:5], ps.MeshVolume(FACES)))


def test_pinned_and_collapsed(simulate, scene_of):
    """All pinned, or all in one place with a volume to take: it stays, and stays finite."""
    held = simulate(scene_of(CORNERS, ps.MeshVolume(FACES, pressure=2.0), pinned=True))
    held.run(3)
    assert np.array_equal(held.position, CORNERS)
    gone = simulate(scene_of(0 * CORNERS, ps.MeshVolume(FACES, rest_volume=1.0)))
    gone.run(3)
    assert np.array_equal(gone.position, 0 * CORNERS)
