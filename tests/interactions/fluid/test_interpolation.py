"""``Simulation.interpolate``: sums at points against brute force, and what it accepts."""

import functools

import numpy as np
import pytest

import particlesim as ps
from particlesim.interactions.fluid.smoothing import SMOOTHING

EPSILON = {"float32": 2.0**-24, "float64": 2.0**-53}
SIDE = np.array([4.0, 5.0, 6.0])
H = 0.7


def cloud(count, seed=0):
    """Random positions in a box, velocities and masses."""
    random = np.random.default_rng(seed)
    x = random.uniform(0, 1, (count, 3)) * SIDE
    return x, random.normal(size=(count, 3)), random.uniform(0.2, 0.8, count)


def weights(points, x, density, m, box=None):
    """m_j / rho_j W(r - r_j) of each point and particle."""
    d = points[:, None] - x[None]
    d = d if box is None else d - box * np.round(d / box)
    q = np.linalg.norm(d, axis=2) / H
    w = np.maximum(1 - q / 2, 0) ** 4 * (1 + 2 * q)
    return m / density * SMOOTHING["wendland_c2"].in_dimension(3).sigma / H**3 * w


def build(count=400, periodic=None, **options):
    """A scene of a fluid with a charge and a colour, and its SPH."""
    x, v, m = cloud(count)
    scene = ps.Scene(periodic=periodic)
    water = scene.add_particles(x, velocity=v, mass=m, charge=x[:, 0], tint=x[:, :3] * 2)
    sph = scene.add_interaction(
        ps.SPH(water, **{
            "smoothing_length": H, "rest_density": 1.0, "equation_of_state": ps.Tait(0.5),
            **options,
        })
    )  # fmt: skip
    return scene, sph


def simulated(scene, **settings):
    """``interpolate`` of the last interaction of a simulation of the scene."""
    settings = ps.Settings(**{"precision": "float64", **settings})
    sim = ps.Simulation(scene, settings, device="cpu")
    return functools.partial(sim.interpolate, sim.interactions[-1])


@pytest.mark.parametrize("count", [400, 1200])
@pytest.mark.parametrize("box", [None, SIDE])
def test_equals_brute_force(count, box, precision, device):
    scene, sph = build(count, None if box is None else ((0, 0, 0), box))
    sim = ps.Simulation(scene, ps.Settings(dt=0.01, precision=precision), device=device)
    sim.run(2)
    points = np.random.default_rng(5).uniform(-0.3, 1.3, (200, 3)) * SIDE
    found = {
        name: sim.interpolate(sph, points, name) for name in ("density", "velocity", "pressure")
    }
    x, m = sim.position.astype(float), scene.mass
    density = sim.get("density").astype(float)  # interpolate has brought it up to date
    w = weights(points, x, density, m, box)
    # Rounded positions and points move q by some eps * 6 / h; 60 terms of one sign or of both.
    for name, values in found.items():
        field = sim.get(name).astype(float)
        scale = (w @ np.abs(field)).max()
        assert np.abs(values - w @ field).max() < 200 * EPSILON[precision] * scale
    shepard = sim.interpolate(sph, points, "velocity", normalized=True)
    total = w.sum(axis=1, keepdims=True)
    inside = total[:, 0] > 0.1
    assert np.allclose(
        shepard[inside], (w @ sim.velocity)[inside] / total[inside], atol=1e4 * EPSILON[precision]
    )


def test_density_follows_the_present_positions():
    """Before any step, and after the last one."""
    scene, sph = build()
    sim = ps.Simulation(scene, ps.Settings(dt=0.05, precision="float64"), device="cpu")
    for _ in range(2):
        x, m = sim.position, scene.mass
        ones = np.ones(len(x))
        density = weights(x, x, ones, m).sum(axis=1)
        assert np.allclose(
            sim.interpolate(sph, x[:5], density), weights(x[:5], x, density, m) @ density
        )
        assert np.allclose(sim.get("density"), density)
        sim.step()


@pytest.mark.parametrize("name, ratio", [("cubic_spline", 1.2), ("wendland_c2", 1.6)])
def test_reproduces_a_linear_field_inside(name, ratio):
    """Over a lattice the weights sum to 1 and their first moments to the point.

    Both up to the Fourier transform of W at the reciprocal lattice, under 1 % at these ratios (see
    test_density_of_a_lattice): relative to the field's change over 2 h for the moment.
    """
    spacing = 0.1
    scene = ps.Scene()
    water = scene.add_particles(ps.sample.box((0, 0, 0), (1, 1, 1), spacing), mass=spacing**3)
    scene.add_interaction(
        ps.SPH(water, smoothing_length=ratio * spacing, rest_density=1.0,
               equation_of_state=ps.Tait(1.0), smoothing=name)
    )  # fmt: skip
    interpolate = simulated(scene)
    gradient, offset = np.array([1.0, -2.0, 0.5]), 3.0
    points = np.random.default_rng(0).uniform(0.4, 0.6, (100, 3))
    expected = points @ gradient + offset
    found = interpolate(points, scene.position @ gradient + offset)
    step = np.linalg.norm(gradient) * 2 * ratio * spacing
    assert np.abs(found - expected).max() < 0.01 * (offset + step)
    shepard = interpolate(points, scene.position @ gradient + offset, normalized=True)
    assert np.abs(shepard - expected).max() < 0.01 * step


def test_away_from_the_fluid_and_at_no_point():
    interpolate = simulated(build()[0], precision="float32")
    far = np.array([[1e3, 0, 0], [0, -1e12, 0], [-5.0, 2.0, 2.0]])
    assert np.all(interpolate(far, "density") == 0)
    assert np.all(interpolate(far, "velocity", normalized=True) == 0)
    assert interpolate(np.zeros((0, 3)), "velocity").shape == (0, 3)


def test_periodic_images_are_the_same_point():
    interpolate = simulated(build(600, ((0, 0, None), (4, 5, None)))[0])
    points = np.random.default_rng(1).uniform(0, 1, (50, 3)) * SIDE
    moved = points + np.array([4.0, 5.0, 0.0]) * np.array([3, -2, 0])
    assert np.allclose(interpolate(points, "density"), interpolate(moved, "density"), rtol=1e-12)


def test_fields_by_name_and_by_value():
    """Attributes, values of the group and of all particles, scalars and vectors."""
    x, _, m = cloud(50)
    scene = ps.Scene()
    scene.add_particles(np.full((7, 3), 9.0), tint=np.ones((7, 3)))
    water = scene.add_particles(x, mass=m, charge=x[:, 0], tint=2 * x)
    options = {"smoothing_length": H, "rest_density": 1.0, "equation_of_state": ps.Tait(5.0)}
    scene.add_interaction(ps.SPH(water, **options))
    interpolate = simulated(scene)
    points = x[:9] + 0.1
    by_name = interpolate(points, "charge")
    everything = np.concatenate([np.full(7, np.pi), x[:, 0]])
    assert by_name.shape == (9,)
    assert np.all(by_name == interpolate(points, x[:, 0]))
    assert np.all(by_name == interpolate(points, everything))
    vectors = interpolate(points, "tint")
    assert vectors.shape == (9, 3) and np.all(vectors == interpolate(points, 2 * x))
    assert np.allclose(vectors, 2 * interpolate(points, "position"))
    ones = interpolate(points, np.ones(50), normalized=True)
    assert np.allclose(ones, 1.0, rtol=1e-14)


def test_each_world_has_its_own_fluid():
    scenes = [build(100, smoothing_length=H + 0.1 * k)[0] for k in range(3)]
    points = np.random.default_rng(1).uniform(0, 1, (20, 3)) * SIDE
    alone = [simulated(scene)(points, "density") for scene in scenes]
    together = simulated(scenes)
    for k in range(3):
        assert np.allclose(together(points, "density", world=k), alone[k])
    assert np.ptp([density.sum() for density in alone]) > 0


@pytest.mark.parametrize(
    "arguments, message",
    [
        (([[0, 0]], "density"), r"Simulation.interpolate: points must have shape \(n, 3\)"),
        (([[0, 0, np.nan]], "density"), r"points\[0, 2\] must be finite"),
        (([[0, 0, 0]], "temperature"), "field must be one of charge, density, .*got 'temperature'"),
        (([[0, 0, 0]], np.zeros(7)), "field must have a row for each of the fluid's 400 particles"),
        (([[0, 0, 0]], np.full(400, np.inf)), r"field\[0\] must be finite"),
        (([[0, 0, 0]], np.zeros((400, 2))), "field must have shape"),
    ],
)
def test_bad_arguments(arguments, message):
    interpolate = simulated(build()[0])
    with pytest.raises(ValueError, match=message):
        interpolate(*arguments)
    with pytest.raises(ValueError, match="world must be from 0 to 0, got 1"):
        interpolate([[0, 0, 0]], "density", world=1)


def test_needs_a_simulation():
    _, sph = build()
    with pytest.raises(ValueError, match=r"write sim.interpolate\(part, points, field\)"):
        sph.interpolate([[0, 0, 0]], "density")
