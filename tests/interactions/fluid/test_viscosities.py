"""Laminar viscosity, XSPH and Balsara's switch: sums, conservation, bits, and what is refused."""

import functools

import numpy as np
import pytest

import particlesim as ps
from cases.worlds import equal_alone
from particlesim.interactions.fluid.smoothing import SMOOTHING

SIDE = np.array([4.0, 5.0, 6.0])
H, C = 0.7, 10.0
SIGMA = SMOOTHING["wendland_c2"].in_dimension(3).sigma / H**3
# One set of kernels is compiled in every run.
PRECISIONS = ["float64", pytest.param("float32", marks=pytest.mark.slow)]
# All that a fluid's viscosities may be of, and so one set of kernels for most of the tests.
ALL = (ps.ArtificialViscosity(0.5, 1.0, balsara=True), ps.LaminarViscosity(0.3), ps.XSPH(0.4))


def pairs(x, side=np.inf):
    """Separations, distances, and W and W' / r of all pairs."""
    d = x[:, None] - x[None]
    d = d - np.where(np.isinf(side), 0.0, side) * np.round(d / side)
    r = np.linalg.norm(d, axis=2)
    s = np.maximum(1 - r / H / 2, 0)
    return d, r, SIGMA * s**4 * (1 + 2 * r / H), SIGMA / H**2 * -5 * s**3


def mean(a):
    return (a[:, None] + a[None]) / 2


def balsara(v, m, density, c, d, slope):
    """Factor of each particle (Balsara 1995)."""
    v_ij, g = v[:, None] - v[None], (m * slope)[..., None] * d
    divergence = np.abs((v_ij * g).sum(axis=(1, 2))) / density
    curl = np.linalg.norm(np.cross(v_ij, g).sum(axis=1), axis=1) / density
    return divergence / (divergence + curl + 1e-4 * c / H)


def reference(x, v, m):
    """Force by ``ALL`` with the pressure of Tait's equation, and the drift of XSPH."""
    d, r, weight, slope = pairs(x)
    density = (m * weight).sum(axis=1)
    s = np.maximum(density, 1.0)
    pressure, c = C**2 / 7 * (s**7 - 1), C * s**3
    stress = (pressure / density**2)[:, None] + (pressure / density**2)[None]
    approach = ((v[:, None] - v[None]) * d).sum(axis=2)
    mu = H * np.minimum(approach, 0) / (r**2 + 0.01 * H**2)
    f = balsara(v, m, density, c, d, slope)
    stress += mean(f) * (-0.5 * mean(c) * mu + 1.0 * mu**2) / mean(density)
    force = -((m[:, None] * m * stress * slope)[..., None] * d).sum(axis=1)
    drag = 0.3 * (density[:, None] + density[None]) / (density[:, None] * density[None])
    v_ij = v[:, None] - v[None]
    force += ((m[:, None] * m * drag * slope)[..., None] * v_ij).sum(axis=1)
    drift = -0.4 * ((m / mean(density) * weight)[..., None] * v_ij).sum(axis=1)
    return force, drift


@pytest.mark.parametrize("precision", PRECISIONS)
def test_sums_equal_brute_force(precision, cloud, fluid, prepared):
    x, v, m = cloud(200)
    sim = prepared(fluid(x, v, m, viscosity=ALL), precision)
    force, drift = reference(x, v, m)
    eps = np.finfo(precision).eps
    # As of test_sums.py; the switch divides two sums, each of which cancels to a tenth or so.
    assert np.abs(sim.get("force") - force).max() < 2000 * eps * np.abs(force).max()
    found = sim.interactions[0].drift.drift.numpy()
    assert np.abs(found - drift).max() < 200 * eps * np.abs(drift).max()
    # Moving so changes no angular momentum: m v x drift is odd in every pair.
    turned = (m[:, None] * np.cross(found, v)).sum(axis=0)
    assert np.abs(turned).max() < 200 * eps * (m[:, None] * np.abs(found * v)).sum()


@pytest.mark.parametrize("precision", PRECISIONS)
def test_momentum_is_conserved(precision, cloud, fluid):
    x, v, m = cloud(200)
    scene = fluid(x, v, m, viscosity=ALL)
    sim = ps.Simulation(scene, ps.Settings(dt=0.02, substeps=20, precision=precision), "cpu")
    before = sim.diagnostics()
    sim.step()
    after = sim.diagnostics()
    sim.forces(0.0)
    # Twenty kicks, each rounded relative to the sum of all |f| dt.
    force, eps = np.linalg.norm(sim.get("force"), axis=1), np.finfo(precision).eps
    impulse = 10 * force.sum() * 0.02 + 10 * (m * np.linalg.norm(v, axis=1)).sum()
    assert np.abs(after.momentum - before.momentum).max() < 5 * eps * impulse


@pytest.mark.slow
def test_xsph_moves_with_the_mixed_velocity(fluid):
    """A step without forces, also through the sides of a periodic box; what is pinned stays."""
    rng = np.random.default_rng(1)
    x = rng.uniform(0, 1, (80, 3)) * SIDE
    v, m = rng.normal(size=(80, 3)), rng.uniform(0.01, 0.02, 80)  # too thin for a pressure
    scene = ps.Scene(periodic=((0, 0, 0), SIDE))
    water = scene.add_particles(x[:70], velocity=v[:70], mass=m[:70])
    scene.add_particles(x[70:], mass=m[70:], pinned=True)
    v[70:] = 0
    scene.add_interaction(
        ps.SPH(smoothing_length=H, rest_density=1.0, equation_of_state=ps.Tait(C),
               viscosity=ps.XSPH(0.4))
    )  # fmt: skip
    d = x[:, None] - x[None]
    d -= SIDE * np.round(d / SIDE)
    r = np.linalg.norm(d, axis=2)
    weight = SIGMA * np.maximum(1 - r / H / 2, 0) ** 4 * (1 + 2 * r / H)
    density = (m * weight).sum(axis=1)
    drift = 0.4 * ((m / mean(density) * weight)[..., None] * (v[None] - v[:, None])).sum(axis=1)
    drift[70:] = 0
    assert np.abs(drift[:70]).max() > 0.1
    for integrator in ("symplectic_euler", "velocity_verlet"):
        settings = ps.Settings(dt=0.5, substeps=1, precision="float64", integrator=integrator)
        sim = ps.Simulation(scene, settings, device="cpu")
        sim.step()
        assert np.all(sim.velocity == v)
        if integrator == "symplectic_euler":  # Verlet takes the forces at the end of the drift
            expected = x + 0.5 * v + 0.5 * drift
            moved = (sim.position - expected + SIDE / 2) % SIDE - SIDE / 2
            assert np.abs(moved).max() < 1e-14 * SIDE.max()
        assert sim.position.min() >= 0 and np.all(sim.position < SIDE)
        assert np.all(sim.position[70:] == x[70:])
    assert len(water) == 70


@pytest.mark.slow
def test_same_bits_by_threads_graphs_and_worlds(cloud, fluid):
    x, v, m = cloud(1500)
    results = []
    for execution, threads in [("graph", 1), ("threads", 1), ("threads", 2)]:
        settings = ps.Settings(
            dt=0.0005, substeps=4, execution=execution, threads=threads, watchdog=False,
            precision="float64",
        )  # fmt: skip
        sim = ps.Simulation(fluid(x, v, m, viscosity=ALL), settings, device="cpu")
        sim.run(2)
        results.append(np.concatenate([sim.position, sim.velocity]))
    assert np.all(results[0] == results[1]) and np.all(results[0] == results[2])
    x, v, m = cloud(200)
    scenes = [
        fluid(x, v, m, viscosity=(ps.ArtificialViscosity(0.1 * k, balsara=True),
                                  ps.LaminarViscosity(0.1 * k), ps.XSPH(0.2 * k)))
        for k in range(3)
    ]  # fmt: skip
    settings = ps.Settings(dt=0.002, precision="float64")
    equal_alone(functools.partial(ps.Simulation, settings=settings), scenes, "cpu", 2)


@pytest.mark.parametrize("integrator", ["symplectic_euler", "velocity_verlet"])
def test_same_bits_from_a_checkpoint(integrator, cloud, fluid, tmp_path):
    x, v, m = cloud(200)
    scene = fluid(x, v, m, viscosity=ALL)
    settings = ps.Settings(dt=0.002, substeps=2, integrator=integrator, precision="float64")
    sim = ps.Simulation(scene, settings, device="cpu")
    sim.run(2)
    sim.save(tmp_path / "at.npz")
    sim.run(2)
    other = ps.Simulation.load(tmp_path / "at.npz", scene)
    other.run(2)
    assert np.all(other.position == sim.position) and np.all(other.velocity == sim.velocity)


@pytest.mark.slow
def test_stability_counts_them(fluid):
    """A laminar viscosity damps at 2 d nu int |W'| / r at most; XSPH alone at nothing."""
    x = ps.sample.box((0, 0, 0), (4, 5, 6), 0.5)

    def step(viscosity):
        scene = fluid(x, m=0.125, viscosity=viscosity, periodic=((0, 0, 0), SIDE))
        sim = ps.Simulation(scene, ps.Settings(precision="float64"), device="cpu")
        return sim.stability().binding.dt

    free, mixed = step(None), step(ps.XSPH(0.4))
    assert mixed == free
    nu = 100.0
    # W' / r = -5 sigma (1 - r / 2h)^3 / h^5: summed over a lattice, for a wave of which
    # neighbours move against each other, twice nu (2 / rho) of that.
    _, r, weight, slope = pairs(ps.sample.box((-2, -2, -2), (2, 2, 2), 0.5))
    middle = len(r) // 2
    density = 0.125 * weight[middle].sum()
    rate = 2 * nu / density * 0.125 * np.abs(slope[middle]).sum()
    found = 2 / step(ps.LaminarViscosity(nu))
    # The row sum is a bound of half of what alternates, and the self term is no pair.
    assert 0.8 * rate < found < 2 * rate


@pytest.mark.parametrize(
    "given, kind, message",
    [
        (0.1, TypeError, "SPH: viscosity must be a Viscosity, got 0.1"),
        ([ps.XSPH(), 3], TypeError, "SPH: viscosity must be a Viscosity, got 3"),
        ([ps.XSPH(), ps.XSPH()], ValueError, "SPH: viscosity must be several of different kinds"),
        ([ps.LaminarViscosity(1.0), ps.LaminarViscosity(1.0)], ValueError, "different kinds"),
    ],
)
def test_bad_viscosities(given, kind, message):
    with pytest.raises(kind, match=message):
        ps.SPH(smoothing_length=1.0, rest_density=1.0, equation_of_state=ps.Tait(1.0),
               viscosity=given)  # fmt: skip


def test_bad_parameters(refused):
    with refused(r"LaminarViscosity: kinematic_viscosity must be at least 0 \[length\^2/time\]"):
        ps.LaminarViscosity(-1.0)
    with refused("XSPH: epsilon must be at most 1"):
        ps.XSPH(1.5)
    with refused("XSPH: epsilon must be at least 0"):
        ps.XSPH(-0.5)


@pytest.mark.slow
def test_shifting_equals_brute_force(precision, fluid, prepared):
    """On a lattice out of order; the centre of mass stays where it is."""
    x = ps.sample.box((0, 0, 0), SIDE, 0.5)
    x = x + np.random.default_rng(0).uniform(-0.1, 0.1, x.shape)
    m = np.random.default_rng(1).uniform(0.1, 0.15, len(x))
    box = ((0, 0, 0), SIDE)
    sim = prepared(fluid(x, m=m, periodic=box, viscosity=ps.ParticleShifting(0.3)), precision)
    d, _, weight, slope = pairs(x, SIDE)
    volume = m / mean((m * weight).sum(axis=1))
    shift = -8 * 0.3 * H * ((volume * slope)[..., None] * d).sum(axis=1)
    drift = sim.interactions[0].drift.drift.numpy()
    # Sums of fifty terms that cancel to a tenth.
    eps = np.finfo(precision).eps
    assert np.abs(drift - shift).max() < 500 * eps * np.abs(shift).max()
    assert np.all(np.abs(m @ drift) < 500 * eps * (m @ np.abs(shift)))  # odd in every pair


def test_shifting_wants_a_full_box(fluid, refused):
    scene = fluid(np.zeros((1, 3)), periodic=((0, 0, None), (4, 4, None)),
                  viscosity=ps.ParticleShifting(1.0))  # fmt: skip
    with refused("ParticleShifting: scene must be periodic along every axis of the fluid"):
        ps.Simulation(scene, device="cpu")


@pytest.mark.slow
def test_shifting_bounds_the_step(fluid):
    x = ps.sample.box((0, 0, 0), SIDE, 0.5)
    scene = fluid(x, m=0.125, periodic=((0, 0, 0), SIDE), viscosity=ps.ParticleShifting(50.0))
    sim = ps.Simulation(scene, ps.Settings(precision="float64"), device="cpu")
    bound = sim.stability().binding
    assert bound.kind == "shifting"
    spread = []
    for factor in (0.9, 1.2):
        scene = fluid(x + np.random.default_rng(0).uniform(-1e-4, 1e-4, x.shape), m=0.125,
                      periodic=((0, 0, 0), SIDE), viscosity=ps.ParticleShifting(50.0))  # fmt: skip
        settings = ps.Settings(dt=40 * factor * bound.dt, substeps=40, precision="float64")
        sim = ps.Simulation(scene, settings, device="cpu")
        sim.step()
        moved = (sim.position - x + SIDE / 2) % SIDE - SIDE / 2
        spread.append((moved - moved.mean(axis=0)).std())
    assert spread[0] < 2e-4 and spread[1] > 1e-2
