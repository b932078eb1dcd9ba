"""SPH: sums against brute force, on every kind of loop."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import particlesim as ps
from particlesim.engine.model import Model
from particlesim.interactions.fluid.smoothing import SMOOTHING

EPSILON = {"float32": 2.0**-24, "float64": 2.0**-53}
SIDE = np.array([4.0, 5.0, 6.0])
H = 0.7
OFTEN = ("cubic_spline", "wendland_c2")
NAMES = [
    *OFTEN,
    *(pytest.param(each, marks=pytest.mark.slow) for each in sorted({*SMOOTHING} - {*OFTEN})),
]


def weight(name, q):
    """w(q) in three dimensions."""
    if name == "cubic_spline":
        return np.maximum(2 - q, 0) ** 3 / 4 - np.maximum(1 - q, 0) ** 3
    if name == "wendland_c2":
        return np.maximum(1 - q / 2, 0) ** 4 * (1 + 2 * q)
    return SMOOTHING[name].in_dimension(3).at(q)  # see test_smoothing.py


def slope(name, q):
    """w'(q) in three dimensions."""
    if name == "cubic_spline":
        return -3 / 4 * np.maximum(2 - q, 0) ** 2 + 3 * np.maximum(1 - q, 0) ** 2
    if name == "wendland_c2":
        return -5 * q * np.maximum(1 - q / 2, 0) ** 3
    return SMOOTHING[name].derivative(q) / SMOOTHING[name].in_dimension(3).sigma


def tait(density, c, exponent=7.0):
    """Pressure and sound speed without tension, for a rest density of 1."""
    s = np.maximum(density, 1.0)
    return c**2 / exponent * (s**exponent - 1), c * s ** ((exponent - 1) / 2)


def reference(x, v, m, name="wendland_c2", c=10.0, viscosity=None, box=None, h=H):
    """Density, pressure, and force on each particle, from all pairs."""
    sigma = SMOOTHING[name].in_dimension(3).sigma / h**3
    d = x[:, None] - x[None]
    d = d if box is None else d - box * np.round(d / box)
    r = np.linalg.norm(d, axis=2)
    density = (m * sigma * weight(name, r / h)).sum(axis=1)
    p, sound = tait(density, c)
    stress = (p / density**2)[:, None] + (p / density**2)[None]
    if viscosity is not None:
        alpha, beta = viscosity
        mu = h * np.minimum(((v[:, None] - v[None]) * d).sum(axis=2), 0) / (r**2 + 0.01 * h**2)
        mean_sound = (sound[:, None] + sound[None]) / 2
        mean_density = (density[:, None] + density[None]) / 2
        stress += (-alpha * mean_sound * mu + beta * mu**2) / mean_density
    gradient = sigma / h * slope(name, r / h) / np.where(r > 0, r, 1.0)
    return density, p, -((m[:, None] * m * stress * gradient)[..., None] * d).sum(axis=1)


# Sums -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("count", [300, 1200])  # looked through directly, and by a grid
@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("box", [None, SIDE])
def test_sums_equal_brute_force(name, box, count, precision, device, cloud, fluid, prepared):
    x, v, m = cloud(count)
    periodic = None if box is None else ((0, 0, 0), box)
    h = 0.6 if SMOOTHING[name].support == 3 else H  # the box is two cutoffs wide
    scene = fluid(
        x, v, m, periodic, smoothing=name, smoothing_length=h,
        viscosity=ps.ArtificialViscosity(0.5, 1.0),
    )  # fmt: skip
    sim = prepared(scene, precision, device)
    density, pressure, force = reference(x, v, m, name, viscosity=(0.5, 1.0), box=box, h=h)
    # Rounded positions change q by 6 eps / h, some ten sums of 60 terms and a few operations each;
    # the seventh power and the subtraction of 1 multiply the density's error by 7 s^7/(s^7 - 1).
    eps = EPSILON[precision]
    assert np.allclose(sim.get("density"), density, rtol=50 * eps, atol=0)
    scale = 100 / 7 * np.maximum(density, 1.0) ** 7
    assert np.all(np.abs(sim.get("pressure") - pressure) < 7 * 50 * eps * scale)
    assert np.abs(sim.get("force") - force).max() < 2000 * eps * np.abs(force).max()


def test_only_the_group_feels_it_and_pinned_particles_push(cloud, prepared):
    x, v, m = cloud(100)
    scene = ps.Scene()
    air = scene.add_particles(x[:30], mass=m[:30])
    wall = scene.add_particles(x[30:50], mass=m[30:50], pinned=True)
    water = scene.add_particles(x[50:], mass=m[50:])
    options = {"smoothing_length": H, "rest_density": 1.0, "equation_of_state": ps.Tait(10.0)}
    scene.add_interaction(ps.SPH([wall, water], **options))
    sim = prepared(scene)
    density, _, force = reference(x[30:], v[30:], m[30:])
    assert np.all(sim.get("force")[air.slice] == 0) and np.all(sim.get("density")[air.slice] == 0)
    assert np.allclose(sim.get("density")[30:], density)
    assert np.allclose(sim.get("force")[30:], force, atol=1e-10 * np.abs(force).max())
    sim.step()
    assert np.all(sim.position[wall.slice] == x[wall.slice])


@pytest.mark.slow
@pytest.mark.parametrize("precision", ["float64", "float32"])
def test_plain_loop_equals_the_vectorised_one(precision, monkeypatch, cloud, fluid, prepared):
    """The loop in Warp's own language is the reference of the native one."""
    x, v, m = cloud()
    scene = fluid(x, v, m, ((0, None, 0), (4, None, 6)), viscosity=ps.ArtificialViscosity(0.5, 1.0))
    results = []
    for vectorised in (True, False):
        monkeypatch.setattr(Model, "vectorised", vectorised)
        sim = prepared(scene, precision)
        arrays = [sim.get(name) for name in ("density", "pressure", "force")]
        results.append((arrays, sim.diagnostics()))
    (fast, a), (slow, b) = results
    # Sums of 60 terms in another order.
    for ours, theirs in zip(fast, slow, strict=True):
        assert np.abs(ours - theirs).max() < 500 * EPSILON[precision] * np.abs(theirs).max()
    assert np.allclose(a.potential, b.potential, rtol=500 * EPSILON[precision])
    assert np.allclose(a.virial, b.virial, rtol=5000 * EPSILON[precision])


_COMPILE = """
import sys
sys.path.insert(0, sys.argv[1])
import particlesim as ps
from particlesim.interactions.fluid.smoothing import SMOOTHING
from test_smoothing import Own
for precision, periodic in (("float32", None), ("float64", ((0, 0, 0), (4, 4, 4)))):
    scene = ps.Scene(periodic=periodic)
    scene.add_particles(ps.sample.box((0, 0, 0), (2, 2, 2), 0.5))
    for name in [*SMOOTHING, Own()]:
        scene.add_interaction(
            ps.SPH(smoothing_length=0.5, rest_density=1.0, equation_of_state=ps.Tait(1.0),
                   smoothing=name, viscosity=ps.ArtificialViscosity(0.1)))
    for drift in (ps.XSPH(), ps.ParticleShifting(1.0)):
        if periodic or isinstance(drift, ps.XSPH):
            scene.add_interaction(
                ps.SPH(smoothing_length=0.5, rest_density=1.0, equation_of_state=ps.Tait(1.0),
                       viscosity=[ps.ArtificialViscosity(0.1, balsara=True),
                                  ps.LaminarViscosity(0.1), drift]))
    sim = ps.Simulation(scene, ps.Settings(precision=precision), device="cpu")
    sim.forces(0.0)
    sim.diagnostics()
"""


@pytest.mark.slow
def test_loops_vectorise(tmp_path):
    """Clang warns about a loop that it was told to vectorise and could not."""
    run = subprocess.run(
        [sys.executable, "-c", _COMPILE, Path(__file__).parent], capture_output=True, text=True,
        env={**os.environ, "WARP_CACHE_PATH": str(tmp_path), "PARTICLESIM_VERBOSE": "1"},
    )  # fmt: skip
    assert run.returncode == 0, run.stderr
    assert "compiled" in run.stdout
    assert "not vectorized" not in run.stdout + run.stderr


@pytest.mark.parametrize("dimension", [1, 2, 3])
@pytest.mark.parametrize("name, ratio", [("cubic_spline", 1.2), ("wendland_c2", 1.6)])
def test_density_of_a_lattice(name, ratio, dimension, fluid, prepared):
    """Summation over a periodic lattice gives mass / spacing^d.

    By Poisson's formula the relative error is the sum of the Fourier transform of W over the
    reciprocal lattice, 2 d of its values at k = 2 pi / spacing to leading order. The transforms
    fall like (k h)^-4 (spline) and (k h)^-(d + 3) (Wendland); at these ratios they leave under 1 %
    and, in one dimension, where W is summed over 5 or 7 particles, 2 %.
    """
    spacing, count = 0.1, 12
    axes = [np.arange(count) * spacing] * dimension + [np.zeros(1)] * (3 - dimension)
    x = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    corner = [count * spacing if a < dimension else None for a in range(3)]
    scene = fluid(
        x, m=1000 * spacing**dimension, smoothing=name, dimension=dimension,
        periodic=([None if c is None else 0.0 for c in corner], corner),
        smoothing_length=ratio * spacing, rest_density=1000.0,
    )  # fmt: skip
    density = prepared(scene).get("density")
    assert np.ptp(density) < 1e-9 * density[0]
    assert density[0] == pytest.approx(1000.0, rel=0.02 if dimension == 1 else 0.01)
