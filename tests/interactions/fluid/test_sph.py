"""SPH: sums against brute force, conservation, worlds, and what it refuses."""

import os
import subprocess
import sys

import numpy as np
import pytest
import warp as wp

import particlesim as ps
from particlesim.interactions.fluid.smoothing import SMOOTHING
from particlesim.kernels.interactions import pair as pair_kernels

EPSILON = {"float32": 2.0**-24, "float64": 2.0**-53}
SIDE = np.array([4.0, 5.0, 6.0])
H = 0.7


# References by brute force, in NumPy ----------------------------------------------------------


def weight(name, q):
    """w(q) in three dimensions."""
    if name == "cubic_spline":
        return np.maximum(2 - q, 0) ** 3 / 4 - np.maximum(1 - q, 0) ** 3
    return np.maximum(1 - q / 2, 0) ** 4 * (1 + 2 * q)


def slope(name, q):
    """w'(q) in three dimensions."""
    if name == "cubic_spline":
        return -3 / 4 * np.maximum(2 - q, 0) ** 2 + 3 * np.maximum(1 - q, 0) ** 2
    return -5 * q * np.maximum(1 - q / 2, 0) ** 3


def tait(density, c, exponent=7.0):
    """Pressure and sound speed without tension, for a rest density of 1."""
    s = np.maximum(density, 1.0)
    return c**2 / exponent * (s**exponent - 1), c * s ** ((exponent - 1) / 2)


def reference(x, v, m, name="wendland_c2", c=10.0, viscosity=None, box=None, h=H):
    """Density, pressure, and force on each particle, from all pairs."""
    sigma = SMOOTHING[name][3].sigma / h**3
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


def cloud(count=300, seed=0):
    """Random positions in a box, velocities, masses; some three times the rest density."""
    random = np.random.default_rng(seed)
    x = random.uniform(0, 1, (count, 3)) * SIDE
    return x, random.normal(size=(count, 3)), random.uniform(0.2, 0.8, count)


def fluid(x, v=0.0, m=1.0, periodic=None, group=None, **options):
    """A scene of one fluid and nothing else."""
    scene = ps.Scene(periodic=periodic)
    scene.add_particles(x, velocity=v, mass=m)
    scene.add_interaction(
        ps.SPH(group, **{
            "smoothing_length": H, "rest_density": 1.0, "equation_of_state": ps.Tait(10.0),
            **options,
        })
    )  # fmt: skip
    return scene


def prepared(scene, precision="float64", device="cpu"):
    """A simulation in which the forces have been taken once."""
    sim = ps.Simulation(scene, ps.Settings(precision=precision), device=device)
    sim.forces(sim.settings.substep)
    return sim


# Sums -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("count", [300, 1200])  # looked through directly, and by a grid
@pytest.mark.parametrize("name", list(SMOOTHING))
@pytest.mark.parametrize("box", [None, SIDE])
def test_sums_equal_brute_force(name, box, count, precision, device):
    x, v, m = cloud(count)
    periodic = None if box is None else ((0, 0, 0), box)
    scene = fluid(
        x, v, m, periodic, smoothing=name, viscosity=ps.ArtificialViscosity(0.5, 1.0)
    )  # fmt: skip
    sim = prepared(scene, precision, device)
    density, pressure, force = reference(x, v, m, name, viscosity=(0.5, 1.0), box=box)
    # Rounded positions change q by 6 eps / h, some ten sums of 60 terms and a few operations each;
    # the seventh power and the subtraction of 1 multiply the density's error by 7 s^7/(s^7 - 1).
    eps = EPSILON[precision]
    assert np.allclose(sim.get("density"), density, rtol=50 * eps, atol=0)
    scale = 100 / 7 * np.maximum(density, 1.0) ** 7
    assert np.all(np.abs(sim.get("pressure") - pressure) < 7 * 50 * eps * scale)
    assert np.abs(sim.get("force") - force).max() < 2000 * eps * np.abs(force).max()


def test_plain_loop_equals_the_vectorised_one(precision, monkeypatch):
    """The loop in Warp's own language is the reference of the native one."""
    x, v, m = cloud()
    scene = fluid(x, v, m, ((0, None, 0), (4, None, 6)), viscosity=ps.ArtificialViscosity(0.5, 1.0))
    fast = prepared(scene, precision)
    plain = pair_kernels.pair_kernel
    monkeypatch.setattr(
        "particlesim.interactions.pair_loop.pair_kernel",
        lambda *args: plain(*args[:-1], False),
    )
    slow = prepared(scene, precision)
    # Sums of 60 terms in another order.
    for name in ("density", "pressure", "force"):
        a, b = slow.get(name), fast.get(name)
        assert np.abs(a - b).max() < 500 * EPSILON[precision] * np.abs(a).max()
    a, b = slow.diagnostics(), fast.diagnostics()
    assert np.allclose(a.potential, b.potential, rtol=500 * EPSILON[precision])
    assert np.allclose(a.virial, b.virial, rtol=5000 * EPSILON[precision])


_COMPILE = """
import particlesim as ps
for precision, periodic in (("float32", None), ("float64", ((0, 0, 0), (2, 2, 2)))):
    scene = ps.Scene(periodic=periodic)
    scene.add_particles(ps.sample.box((0, 0, 0), (2, 2, 2), 0.5))
    for name in ("wendland_c2", "cubic_spline"):
        scene.add_interaction(
            ps.SPH(smoothing_length=0.5, rest_density=1.0, equation_of_state=ps.Tait(1.0),
                   smoothing=name, viscosity=ps.ArtificialViscosity(0.1)))
    ps.Simulation(scene, ps.Settings(precision=precision), device="cpu").diagnostics()
"""


def test_loops_vectorise(tmp_path):
    """Clang warns about a loop that it was told to vectorise and could not."""
    run = subprocess.run(
        [sys.executable, "-c", _COMPILE], capture_output=True, text=True,
        env={**os.environ, "WARP_CACHE_PATH": str(tmp_path)},
    )  # fmt: skip
    assert run.returncode == 0, run.stderr
    assert "compiled" in run.stdout
    assert "not vectorized" not in run.stdout + run.stderr


@pytest.mark.parametrize("dimension", [1, 2, 3])
@pytest.mark.parametrize("name, ratio", [("cubic_spline", 1.2), ("wendland_c2", 1.6)])
def test_density_of_a_lattice(name, ratio, dimension):
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


# Conservation ---------------------------------------------------------------------------------


@pytest.mark.parametrize("name", list(SMOOTHING))
@pytest.mark.parametrize("tension", [False, True])
def test_force_is_the_gradient_of_the_energy(name, tension):
    x, _, m = cloud(60)
    x *= 0.4
    equation = ps.Tait(10.0, negative_pressure=tension)
    sim = prepared(fluid(x, m=m, smoothing=name, equation_of_state=equation))
    force, step = sim.get("force"), 1e-6
    for particle, axis in [(0, 0), (7, 1), (33, 2)]:
        energies = []
        for side in (step, -step):
            moved = x.copy()
            moved[particle, axis] += side
            sim.position = moved
            energies.append(sim.diagnostics().potential[0])
        derived = -(energies[0] - energies[1]) / (2 * step)
        # Central difference: step^2 / 6 (7 / h)^2, and the energies' round-off over the step.
        tolerance = step**2 * 20 * np.abs(force).max() + 1e-15 * energies[0] / step
        assert abs(force[particle, axis] - derived) < 10 * tolerance


def test_momentum_and_angular_momentum_are_conserved(precision, device):
    x, v, m = cloud()
    scene = fluid(x, v, m, viscosity=ps.ArtificialViscosity(0.5, 1.0))
    sim = ps.Simulation(scene, ps.Settings(dt=0.05, substeps=50, precision=precision), device)
    before = sim.diagnostics()
    sim.step()
    after = sim.diagnostics()
    # 50 steps of 300 kicks, each rounded relative to the force: the sum of |f| dt is what rounds.
    sim.forces(0.0)
    force, eps = np.linalg.norm(sim.get("force"), axis=1), EPSILON[precision]
    impulse = 10 * force.sum() * 0.05 + 10 * (m * np.linalg.norm(v, axis=1)).sum()
    assert np.abs(after.momentum - before.momentum).max() < 10 * eps * impulse
    change = np.abs(after.angular_momentum - before.angular_momentum).max()
    assert change < 10 * eps * impulse * np.linalg.norm(SIDE)
    assert np.abs(after.momentum - before.momentum).max() > 0  # something has happened


def test_viscosity_takes_energy_out():
    x, v, m = cloud()
    box = ((0, 0, 0), SIDE)

    def drift(viscosity):
        scene = fluid(
            x, v, m, box, viscosity=viscosity,
            equation_of_state=ps.Tait(10.0, negative_pressure=True),
        )  # fmt: skip
        settings = ps.Settings(
            dt=0.02, substeps=80, precision="float64", integrator="velocity_verlet"
        )
        sim = ps.Simulation(scene, settings, device="cpu")
        start = sim.diagnostics().energy[0]
        sim.step()
        return (sim.diagnostics().energy[0] - start) / start

    assert abs(drift(None)) < 1e-3
    assert drift(ps.ArtificialViscosity(1.0, 2.0)) < -0.02


def test_coincident_particles_part(precision, device):
    """Two, and three, at one place: finite, opposite pushes, and apart soon."""
    far = np.full((1, 3), 3.0)
    x = np.concatenate([np.zeros((2, 3)), far, far, far])
    scene = fluid(x, m=0.5, viscosity=ps.ArtificialViscosity(0.1))
    sim = prepared(scene, precision, device)
    force = sim.get("force")
    assert np.all(np.isfinite(force)) and np.linalg.norm(force[0]) > 0
    assert np.all(force[0] == -force[1])
    assert np.abs(force[2:].sum(axis=0)).max() <= 4 * EPSILON[precision] * np.abs(force).max()
    sim.run(60)
    position = sim.position
    gaps = np.linalg.norm(position[:, None] - position[None], axis=2)[np.triu_indices(5, 1)]
    assert gaps.min() > 0.1 * H


@pytest.mark.parametrize("dimension", [1, 2])
def test_coincident_particles_part_within_their_plane(dimension):
    scene = fluid(np.zeros((3, 3)), dimension=dimension)
    sim = prepared(scene)
    sim.run(10)
    assert np.ptp(sim.position[:, 0]) > 0
    assert np.all(sim.position[:, dimension:] == 0)


# Groups, worlds, engine -----------------------------------------------------------------------


def test_only_the_group_feels_it_and_pinned_particles_push():
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


def test_worlds_have_their_own_parameters_and_equal_each_alone():
    x, v, m = cloud()

    def build(k):
        return fluid(
            x, v, m, smoothing_length=0.5 + 0.1 * k, rest_density=1.0 + 0.2 * k,
            equation_of_state=ps.Tait(10.0 + k, exponent=7.0 - k),
            viscosity=ps.ArtificialViscosity(0.1 * k, 0.2 * k),
        )  # fmt: skip

    settings = ps.Settings(dt=0.01, substeps=5)
    batch = ps.Simulation([build(k) for k in range(3)], settings, device="cpu")
    batch.run(2)
    for k in range(3):
        alone = ps.Simulation(build(k), settings, device="cpu")
        alone.run(2)
        assert np.all(batch.world(k).position == alone.position)
        assert np.all(batch.world(k).velocity == alone.velocity)
    assert np.ptp(batch.diagnostics().potential) > 0


def test_threads_and_graph_agree_bit_for_bit():
    x, v, m = cloud(3000)
    results = []
    for execution, threads in [("graph", 1), ("threads", 1), ("threads", 2)]:
        # A random cloud bursts at speeds that depend on the step, whichever way it is run.
        settings = ps.Settings(
            dt=0.002, substeps=4, execution=execution, threads=threads, watchdog=False
        )
        scene = fluid(x, v, m, viscosity=ps.ArtificialViscosity(0.5))
        sim = ps.Simulation(scene, settings, device="cpu")
        sim.run(2)
        results.append(np.concatenate([sim.position, sim.velocity]))
    assert np.all(results[0] == results[1]) and np.all(results[0] == results[2])


def test_explain_shows_what_it_takes():
    x, v, m = cloud(1200)  # enough for slots to have an order of their own
    told = ps.Simulation(fluid(x, v, m), device="cpu").explain()
    assert {"density", "pressure", "mass"} <= set(told.arrays)
    assert "correction" not in told.arrays
    gathers = [name for _, name, _ in told.launches if "gather" in name]
    viscous = fluid(x, v, m, viscosity=ps.ArtificialViscosity(0.5))
    told_viscous = ps.Simulation(viscous, device="cpu").explain()
    more = [name for _, name, _ in told_viscous.launches if "gather" in name]
    assert len(more) == len(gathers) + 1  # the velocities, which only a viscosity asks for
    assert sum(who == "SPH" for who, _, _ in told.launches) == 2


@pytest.mark.parametrize("count", [0, 1])
def test_no_particle_and_one(count, precision, device):
    sim = prepared(fluid(np.zeros((count, 3)), m=2.0), precision, device)
    sim.run(2)
    expected = 2.0 * SMOOTHING["wendland_c2"][3].sigma / H**3
    assert np.allclose(sim.get("density"), expected) and np.all(sim.get("force") == 0)
    assert np.isfinite(sim.diagnostics().energy).all()


def test_own_equation_of_state_and_viscosity():
    """Anyone can write one: three laws of the density, one of the pair."""
    from particlesim.interactions.fluid.equations_of_state import EquationOfState
    from particlesim.interactions.fluid.viscosities import Viscosity

    @ps.law
    def isothermal_pressure(density: float, rest_density: float, sound_speed: float):
        return sound_speed * sound_speed * (density - rest_density)

    @ps.law
    def isothermal_energy(density: float, rest_density: float, sound_speed: float):
        ratio = rest_density / density
        return sound_speed * sound_speed * (ratio - 1.0 - wp.log(ratio))

    @ps.law
    def isothermal_sound_speed(sound_speed: float):
        return sound_speed

    class Isothermal(EquationOfState):
        pressure, energy = isothermal_pressure, isothermal_energy
        sound_speed = isothermal_sound_speed

        def __init__(self, speed):
            self.parameters = {"sound_speed": speed}

    @ps.law
    def constant_term(approach: float, smoothing_length: float, nu: float):
        return -nu * approach / smoothing_length

    class Own(Viscosity):
        term = constant_term

        def __init__(self, nu):
            self.parameters = {"nu": nu}

    x, v, m = cloud(60)
    sim = prepared(fluid(x, v, m, equation_of_state=Isothermal(4.0), viscosity=Own(0.3)))
    assert np.allclose(sim.get("pressure"), 16 * (sim.get("density") - 1))
    assert np.abs(sim.get("force").sum(axis=0)).max() < 1e-12 * np.abs(sim.get("force")).max()


# What it refuses ------------------------------------------------------------------------------

GOOD = {"smoothing_length": 0.1, "rest_density": 1.0, "equation_of_state": ps.Tait(1.0)}


@pytest.mark.parametrize(
    "bad, kind, message",
    [
        ({"smoothing_length": 0.0}, ValueError,
         r"SPH: smoothing_length must be above 0 \[length\], got 0"),
        ({"smoothing_length": np.inf}, ValueError, "SPH: smoothing_length must be finite"),
        ({"rest_density": -1.0}, ValueError, "SPH: rest_density must be above 0"),
        ({"rest_density": None}, ValueError,
         r"SPH: rest_density must be given \[mass/length\^d\], got None; Tait asks for it"),
        ({"smoothing": "cubic"}, ValueError,
         "SPH: smoothing must be one of cubic_spline, wendland_c2, got 'cubic'"),
        ({"dimension": 4}, ValueError, "SPH: dimension must be 1, 2 or 3, got 4"),
        ({"equation_of_state": "tait"}, TypeError,
         "SPH: equation_of_state must be an EquationOfState, got 'tait'"),
        ({"viscosity": 0.1}, TypeError, "SPH: viscosity must be a Viscosity, got 0.1"),
        ({"viscosty": None}, TypeError, "viscosty"),
    ],
)  # fmt: skip
def test_bad_arguments(bad, kind, message):
    with pytest.raises(kind, match=message):
        ps.SPH(**{**GOOD, **bad})


def test_smoothing_length_out_of_the_precision():
    scene = fluid(np.zeros((2, 3)), smoothing_length=1e-14)
    with pytest.raises(ValueError, match=r"SPH: smoothing_length must have h.* float32"):
        ps.Simulation(scene, device="cpu")
    assert np.isfinite(prepared(scene, "float64").get("density")).all()


def test_scenes_of_different_fluids_are_no_batch():
    x = np.zeros((2, 3))
    other = fluid(x, smoothing="cubic_spline")
    with pytest.raises(ValueError, match=r"scenes\[1\].interactions must be of the kinds"):
        ps.Simulation([fluid(x), other], device="cpu")
