"""Derivatives by ``Simulation.interpolate``: against brute force, exact fields and convergence."""

import numpy as np
import pytest
import warp as wp

import particlesim as ps
from particlesim.interactions.fluid.smoothing import SMOOTHING

H, SIDE, COUNT = 0.7, 3.0, 300
SIGMA = SMOOTHING["wendland_c2"].in_dimension(3).sigma
WHAT = ("gradient", "divergence", "curl", "laplacian")


def build(**options):
    """A cloud, of which another group is no part, and its fluid."""
    random = np.random.default_rng(0)
    x = random.uniform(0, SIDE, (COUNT, 3))
    scene = ps.Scene()
    scene.add_particles(np.full((5, 3), 9.0))
    water = scene.add_particles(x, mass=random.uniform(0.05, 0.15, COUNT), charge=x[:, 0])
    sph = scene.add_interaction(
        ps.SPH(water, smoothing_length=H, rest_density=1.0, equation_of_state=ps.Tait(1.0))
    )
    return ps.Simulation(scene, ps.Settings(precision="float64", **options), device="cpu"), sph, x


@pytest.fixture(scope="module")
def cloud():
    return build()


def brute(x, volume, a, normalized):
    """Gradient and laplacian of a vector field (n, 3) at its particles."""
    d = x[:, None] - x[None]
    r = np.linalg.norm(d, axis=2)
    slope = SIGMA / H**5 * -5 * np.maximum(1 - r / H / 2, 0) ** 3  # W' / r
    weight = volume * slope
    gradient = np.einsum("ij,ija,ijb->iab", weight, a[None] - a[:, None], d)
    linear = np.zeros_like(d)
    scale = np.ones(len(x))
    if normalized:
        k = -np.einsum("ij,ija,ijb->iab", weight, d, d)
        gradient = gradient @ np.linalg.inv(k)
        linear = np.einsum("iab,ijb->ija", gradient, d)
        scale = 3 / -(weight * r**2).sum(axis=1)
    change = a[:, None] - a[None] - linear
    return gradient, scale[:, None] * 2 * np.einsum("ij,ija->ia", weight, change)


def chosen(what, gradient, laplacian):
    if what == "gradient":
        return gradient
    if what == "divergence":
        return np.trace(gradient, axis1=1, axis2=2)
    if what == "curl":
        g = gradient
        return np.stack(
            [g[:, 2, 1] - g[:, 1, 2], g[:, 0, 2] - g[:, 2, 0], g[:, 1, 0] - g[:, 0, 1]], axis=1
        )
    return laplacian


@pytest.mark.parametrize("normalized", [pytest.param(False, marks=pytest.mark.slow), True])
def test_derivatives_equal_brute_force(cloud, normalized):
    sim, sph, x = cloud
    a = np.random.default_rng(1).normal(size=(COUNT, 3))
    density = sim.interpolate(sph, None, "density")  # has brought the state's up to date
    own = sim.get("density")[5:]
    volume = sim.scenes[0].mass[5:] / own
    gradient, laplacian = brute(x, volume, a, normalized)
    scalar_gradient, scalar_laplacian = gradient[:, 0], laplacian[:, 0]
    points = np.random.default_rng(2).uniform(0, SIDE, (50, 3))
    r = np.linalg.norm(points[:, None] - x[None], axis=2) / H
    w = volume * SIGMA / H**3 * np.maximum(1 - r / 2, 0) ** 4 * (1 + 2 * r)
    w = w / w.sum(axis=1, keepdims=True) if normalized else w
    given = {"normalized": normalized}
    for what in WHAT:
        expected = chosen(what, gradient, laplacian)
        # Sums of some fifty terms in another order; the inverse of K multiplies rounding by its
        # condition, some tens at the cloud's surface.
        limit = {"rtol": 0, "atol": 1e-12 * np.abs(expected).max()}
        found = sim.interpolate(sph, None, a, derivative=what, **given)
        np.testing.assert_allclose(found, expected, **limit)
        found = sim.interpolate(sph, points, a, derivative=what, **given)
        np.testing.assert_allclose(found, np.tensordot(w, expected, 1), **limit)
    for what, expected in [("gradient", scalar_gradient), ("laplacian", scalar_laplacian)]:
        found = sim.interpolate(sph, None, a[:, 0], derivative=what, **given)
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12 * np.abs(expected).max())
    assert density.shape == (COUNT,)
    r = np.linalg.norm(x[:, None] - x[None], axis=2) / H
    w = volume * SIGMA / H**3 * np.maximum(1 - r / 2, 0) ** 4 * (1 + 2 * r)
    np.testing.assert_allclose(density, w @ own, rtol=1e-12)


def test_constants_have_no_derivative_and_linear_fields_theirs(cloud):
    sim, sph, x = cloud
    for what in ("gradient", "laplacian"):
        given = {"derivative": what, "normalized": True}
        assert np.all(sim.interpolate(sph, None, np.full(COUNT, 3.7), **given) == 0)
    slope = np.array([1.0, -2.0, 0.5])
    given = {"derivative": "gradient", "normalized": True}
    # Rounding by the condition of K at the cloud's surface.
    for points in (None, x[:40] + 0.1):
        found = sim.interpolate(sph, points, 5 + x @ slope, **given)
        assert np.abs(found - slope).max() < 1e-12
    found = sim.interpolate(sph, None, "position", **given)
    assert np.abs(found - np.eye(3)).max() < 1e-12
    found = sim.interpolate(sph, None, x @ slope, derivative="laplacian", normalized=True)
    assert np.abs(found).max() < 1e-11 / H


def test_warp_arrays_stay_on_the_device(cloud):
    """The same numbers as NumPy's, and in the simulation's types; points outside an open box."""
    sim, sph, x = cloud
    a = np.random.default_rng(1).normal(size=(COUNT, 3))
    points = np.concatenate([x[:30] + 0.05, [[1e9, 0, 0]]])
    vectors = wp.array(a, dtype=wp.vec3d, device="cpu")
    numbers = wp.array(a[:, 0].copy(), dtype=wp.float64, device="cpu")
    at = wp.array(points, dtype=wp.vec3d, device="cpu")
    for field, plain, what, kind in [
        (vectors, a, None, wp.vec3d),
        (numbers, a[:, 0], None, wp.float64),
        (vectors, a, "gradient", wp.mat33d),
        (vectors, a, "divergence", wp.float64),
        (numbers, a[:, 0], "gradient", wp.vec3d),
        (numbers, a[:, 0], "laplacian", wp.float64),
    ]:
        given = {"derivative": what, "normalized": True}
        for where, there in ((at, points), (None, None)):
            found = sim.interpolate(sph, where, field, **given)
            assert isinstance(found, wp.array) and wp.types.types_equal(found.dtype, kind)
            np.testing.assert_array_equal(
                found.numpy(), sim.interpolate(sph, there, plain, **given)
            )
        assert isinstance(sim.interpolate(sph, points, field, **given), np.ndarray)
    assert isinstance(sim.interpolate(sph, at, "charge"), wp.array)
    np.testing.assert_array_equal(at.numpy(), points)


def test_particles_without_neighbours():
    """Alone, in pairs and in a row: finite, and along the row as it should be."""
    x = np.array([[0, 0, 0], [9, 0, 0], [9.5, 0, 0], *[[20 + 0.5 * k, 0, 0] for k in range(9)]])
    scene = ps.Scene()
    scene.add_particles(x)
    sph = scene.add_interaction(
        ps.SPH(smoothing_length=H, rest_density=1.0, equation_of_state=ps.Tait(1.0))
    )
    sim = ps.Simulation(scene, ps.Settings(precision="float64"), device="cpu")
    for what in ("gradient", "laplacian"):
        found = sim.interpolate(sph, None, x[:, 0], derivative=what, normalized=True)
        assert np.isfinite(found).all() and np.all(found[0] == 0)
        if what == "gradient":
            assert np.abs(found[1:] - [1, 0, 0]).max() < 1e-12


def wave(count, jitter):
    """A fluid in a periodic square, and relative rms errors of a wave's derivatives there."""
    spacing, k = 1 / count, 2 * np.pi
    x = ps.sample.box((0, 0, 0), (1, 1, 0), spacing, jitter=jitter)
    scene = ps.Scene(periodic=((0, 0, None), (1, 1, None)))
    gas = scene.add_particles(x, mass=spacing**2)
    sph = scene.add_interaction(
        ps.SPH(gas, smoothing_length=1.6 * spacing, rest_density=1.0, dimension=2,
               equation_of_state=ps.Tait(10.0))
    )  # fmt: skip
    sim = ps.Simulation(scene, ps.Settings(precision="float64"), device="cpu")
    points = np.random.default_rng(0).uniform(0, 1, (500, 3)) * [1, 1, 0]
    fields = {
        None: lambda x: np.sin(k * x[:, 0]) * np.cos(k * x[:, 1]),
        "gradient": lambda x: k * np.stack([
            np.cos(k * x[:, 0]) * np.cos(k * x[:, 1]), -np.sin(k * x[:, 0]) * np.sin(k * x[:, 1]),
            0 * x[:, 0]], axis=1),
        "laplacian": lambda x: -2 * k**2 * fields[None](x),
    }  # fmt: skip
    errors = {}
    for what, exact in fields.items():
        for normalized in (False, True):
            for name, at in (("particles", sim.position), ("points", points)):
                found = sim.interpolate(
                    sph, None if name == "particles" else at, fields[None](sim.position),
                    derivative=what, normalized=normalized,
                )  # fmt: skip
                error = np.sqrt(np.mean((found - exact(at)) ** 2) / np.mean(exact(at) ** 2))
                errors[what, normalized, name] = error
    return errors


@pytest.mark.slow
@pytest.mark.parametrize("jitter", [0.0, 0.2])
def test_errors_fall_with_the_spacing(jitter):
    """At second order where sums are normalized, at h = 1.6 spacings of 64 across.

    W spreads a wave by (k h)^2 times its second moment, 0.0068 of the field itself here; a sum at
    particles and another at points by twice that.
    """
    errors = [wave(count, jitter) for count in (16, 32, 64)]
    order = {key: np.log2(errors[1][key] / errors[2][key]) for key in errors[0]}
    for key, slope in order.items():
        what, normalized, name = key
        if not jitter and normalized:
            assert slope == pytest.approx(2.0, abs=0.05), key
        elif normalized and (what != "laplacian" or name == "points"):
            assert slope > 1.65, key  # found: 1.72 to 1.92
    final = {key: error for key, error in errors[-1].items() if key[1]}
    assert max(e for key, e in final.items() if key[0] != "laplacian") < 0.015
    # What disorder leaves of the second derivatives' mixture does not fall: found, 3.1 %.
    assert final["laplacian", True, "particles"] < 0.035


def test_bad_derivatives(cloud, refused):
    sim, sph, _ = cloud
    point, ones = [[0, 0, 0]], np.ones(COUNT)
    with refused(
        "Simulation.interpolate: derivative must be one of gradient, divergence, curl, la"
    ):
        sim.interpolate(sph, point, ones, derivative="hessian")
    with refused("Simulation.interpolate: field must be a vector, to have a divergence"):
        sim.interpolate(sph, point, ones, derivative="divergence")
    with refused("Simulation.interpolate: field must be .n,. of float64 or vec3d on cpu"):
        sim.interpolate(sph, point, wp.zeros(COUNT, dtype=wp.float32, device="cpu"))
    with refused("Simulation.interpolate: points must be .n,. of vec3d on cpu"):
        sim.interpolate(sph, wp.zeros(2, dtype=wp.vec3f, device="cpu"), ones)
    with refused("Simulation.interpolate: field must have a row for each of the fluid's 300"):
        sim.interpolate(sph, point, wp.zeros(7, dtype=wp.float64, device="cpu"))
