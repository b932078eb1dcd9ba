"""Fluids of constraints on density: sweeps against NumPy, conservation, what is refused."""

import numpy as np
import pytest

import particlesim as ps
from cases.worlds import equal_alone, goes_on_after_reset_and_save
from particlesim.engine.model import Model
from particlesim.instruments.residuals import residuals

H, EPS = 0.15, float(np.finfo(np.float64).eps)
SIGMA = 21 / (16 * np.pi)  # of Wendland's C2


def tensors(n, length):
    """n n^T times a length, of directions (..., 3)."""
    return length[..., None, None] * n[..., :, None] * n[..., None, :]


def beyond_a_plane(t):
    """What a plane t h away cuts off of W, and W over the plane: integrals of (1-u)^4 (1+4u)."""
    s = np.clip(1 - t / 2, 0, 1)
    part = 16 * np.pi * SIGMA * s**6 * (1 / 6 - s * 3 / 14 + s**2 / 14)
    return part, 8 * np.pi * SIGMA * s**5 * (1 - 1.5 * s + 4 / 7 * s**2)


def sweeps(x, way, w, volume, count, relaxation, alpha, box=0.0, floor=-np.inf):
    """Corrections of so many sweeps, and what fills places more than once before the last."""
    start, lam, total = x - way, np.zeros(len(x)), np.zeros_like(x)
    b, free, alpha = volume * SIGMA / H**3, w > 0, alpha * H**2
    for _ in range(count):
        d = x[:, None] - x[None]
        d -= box * np.round(d / box) if box else 0.0
        y = d - ((x - start)[:, None] - (x - start)[None])
        r, r_y = np.linalg.norm(d, axis=-1), np.linalg.norm(y, axis=-1)
        straight = (d * y).sum(axis=-1) > 0.5 * r * r_y
        n = np.where(straight[..., None], y, d)
        n /= np.maximum(np.where(straight, r_y, r), EPS)[..., None]
        q, u = r / H, np.maximum(1 - 0.5 * r / H, 0)
        G = 5 * q * u**3
        part, lean = beyond_a_plane((x[:, 1] - floor) / H)
        C = (b * u**4 * (1 + 2 * q)).sum(axis=1) + part - 1
        lean = lean[:, None] * (0, 1, 0)
        g = ((n * (b * G)[..., None]).sum(axis=1) + lean) * free[:, None]
        steep = np.linalg.norm(g, axis=1)
        T = b[:, None, None] * tensors(n, G * free).sum(axis=1)
        T += tensors(g / np.maximum(steep, EPS)[:, None], steep)
        e = (np.linalg.eigvalsh(T).clip(0) ** 8).sum(axis=1) ** (1 / 8)
        D = G @ (w * e * b) + w * e * steep
        missing = np.minimum(C, 0.125 * np.trace(T, axis1=1, axis2=2)) - alpha * lam
        new = np.maximum(lam + relaxation * missing / (D + alpha), 0) * free
        push, lam = new - lam, new
        f = (b * push[:, None] + b[:, None] * push) * G
        dx = w[:, None] * H * ((f[..., None] * n).sum(axis=1) + lean * push[:, None])
        x, total = x + dx, total + dx
    return total, C


def cloud(count=430, side=0.62, seed=0):
    """Particles at random, some at the same place: positions, velocities, masses, densities."""
    rng = np.random.default_rng(seed)
    x, v = rng.uniform(0, side, (count, 3)), rng.normal(0, 2.0, (count, 3))
    return x, v, rng.uniform(0.5, 1.5, count), rng.uniform(500, 1500, count)


@pytest.mark.parametrize(
    ("precision", "floored", "vectorised"),
    [
        ("float64", True, True),
        *(
            pytest.param(precision, floored, vectorised, marks=pytest.mark.slow)
            for precision in ("float32", "float64")
            for floored in (True, False)
            for vectorised in (True, False)
            if (precision, floored, vectorised) != ("float64", True, True)
        ),
    ],
)
def test_sweeps_equal_numpy(precision, floored, vectorised, device, simulate, monkeypatch):
    """Three sweeps, in a periodic box and above a floor, over a cloud that is too dense."""
    monkeypatch.setattr(Model, "vectorised", vectorised and device == "cpu")
    x, v, mass, density = cloud()
    box, dt, alpha = (0.0 if floored else 0.62), 0.002, 1e-3
    pinned = np.arange(len(x)) < 20
    scene = ps.Scene(periodic=None if floored else ((0, 0, 0), (box,) * 3))
    scene.add_particles(x, velocity=v * ~pinned[:, None], mass=mass, pinned=pinned)
    fluid = {"rest_density": density, "smoothing_length": H, "compliance": alpha}
    scene.add_constraint(ps.FluidDensity(**fluid))
    if floored:  # which holds points up by their density alone
        scene.add_constraint(ps.PlaneBoundary((0, -0.05, 0), (0, 1, 0)))
    sim = simulate(scene, device, iterations=3, relaxation=0.8, precision=precision, dt=dt)
    sim.constraints[0].easing.unmark()  # or what is too dense at the start would be forgiven
    sim.step()
    way = dt * v * ~pinned[:, None]
    w = np.where(pinned, 0.0, 1.0 / mass)
    expected, _ = sweeps(
        x + way, way, w, mass / density, 3, 0.8, alpha / dt**2, box, -0.05 if floored else -np.inf
    )
    found = sim.position - x - way
    found -= box * np.round(found / box) if box else 0.0
    assert np.abs(expected).max() > 0.01
    # Sums of 100 neighbours; the table of what a plane cuts off is 1e-6 off, by (2/512)^2 / 8.
    tolerance = 1e-4 if precision == "float32" else 1e-5 if floored else 1e-12
    assert np.abs(found - expected).max() < tolerance * np.abs(expected).max()
    values, _ = residuals(sim.constraints[0], sim)
    _, C = sweeps(sim.position, 0 * x, w, mass / density, 1, 0, 0, box,
                  -0.05 if floored else -np.inf)  # fmt: skip
    assert values.max() == pytest.approx(C.max(), rel=tolerance)
    assert sim.diagnostics().constraint_error[0] == pytest.approx(C.max(), rel=tolerance)


def drop(group=None, seed=1, heavy=1.0, **options):
    """A drop of unequal particles that spins and falls onto itself, far above a floor."""
    rng = np.random.default_rng(seed)
    x = ps.sample.sphere((0, 0, 0), 0.4, 0.1)
    v = np.cross((0, 0, 3.0), x) - 4.0 * x + rng.normal(0, 0.5, x.shape)
    volume = 1e-3 * rng.uniform(0.8, 1.2, len(x))
    scene = ps.Scene()
    scene.add_particles(x, velocity=v, mass=heavy * volume * (500 + 1000 * (x[:, 0] > 0)))
    options = {"rest_density": heavy * (500 + 1000.0 * (x[:, 0] > 0)), **options}
    scene.add_constraint(ps.FluidDensity(group, smoothing_length=H, **options))
    scene.add_constraint(ps.PlaneBoundary((0, -50, 0), (0, 1, 0)))
    return scene


def test_a_drop_keeps_its_momenta(device, simulate):
    """Every push is opposite and equal, and along the pair where the substep began.

    A sum of n terms is off by less than n eps of its largest: 268 particles of 0.5 to 2 kg, at up
    to 3 m/s and 0.4 m, in 20 substeps of 4 sweeps: 1e-12 of sum m |v| and of sum m |x| |v|.
    """
    scene = drop()
    sim = simulate(scene, device, iterations=4)
    first = sim.diagnostics()
    sim.run(20)
    last = sim.diagnostics()
    m, v, x = scene.mass, scene.velocity, scene.position
    speed = m * np.linalg.norm(v, axis=1)
    assert last.kinetic < 0.9 * first.kinetic  # it was stopped
    assert np.abs(last.momentum - first.momentum).max() < 1e-12 * speed.sum()
    spin = (speed * np.linalg.norm(x, axis=1)).sum()
    assert np.abs(last.angular_momentum - first.angular_momentum).max() < 1e-12 * spin
    assert last.constraint_error < 0.05


def test_worlds_threads_and_restarts_are_the_same(device, simulate, tmp_path):
    """Bit for bit: in a batch as alone, on one thread as on two, and from a checkpoint."""
    scenes = [drop(), drop(seed=2, heavy=2.0, compliance=1e-5)]
    knobs = {"iterations": 2, "precision": "float64"}
    equal_alone(simulate, scenes, device, 5, **knobs)
    runs = [simulate(drop(), device, threads=threads, **knobs) for threads in (1, 2)]
    for sim in runs:
        sim.run(5)
    assert np.array_equal(runs[0].position, runs[1].position)

    def make(given, device):
        return simulate(given, device, **knobs)

    goes_on_after_reset_and_save(make, scenes, device, tmp_path / "drop.npz")


def test_what_is_no_fluid_is_refused():
    good = {"rest_density": 1000.0, "smoothing_length": H}
    for bad, says in (
        ({"smoothing_length": 0.0}, "smoothing_length must be above 0"),
        ({"rest_density": 0.0}, "rest_density must be above 0"),
        ({"rest_density": [1000.0, -1.0]}, "rest_density must be above 0"),
        ({"compliance": -1.0}, "compliance must be at least 0"),
        ({"smoothing": "wendland"}, "smoothing must be one of"),
        ({"dimension": 4}, "dimension must be 1, 2 or 3"),
    ):
        with pytest.raises(ValueError, match=f"FluidDensity: {says}"):
            ps.FluidDensity(**{**good, **bad})
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0)])
    scene.add_constraint(ps.FluidDensity(rest_density=[1.0, 2.0], smoothing_length=H))
    with pytest.raises(ValueError, match="rest_density must be one number or 1, one for each"):
        ps.Simulation(scene, ps.Settings(dt=0.01), device="cpu")


def test_nothing_is_held_where_there_is_nothing(device, simulate):
    """No particles, one alone, all of them pinned, a group of none."""
    lone = ps.Scene()
    lone.add_particles([(0, 1, 0)], velocity=(1, 0, 0))
    lone.add_constraint(ps.FluidDensity([], rest_density=1.0, smoothing_length=1.0))
    held = ps.Scene()
    held.add_particles(np.zeros((9, 3)), pinned=True)
    held.add_constraint(ps.FluidDensity(rest_density=1e-3, smoothing_length=H))
    empty = ps.Scene()
    empty.add_constraint(ps.FluidDensity(rest_density=1.0, smoothing_length=1.0))
    for scene in (lone, held, empty):
        scene.add_constraint(ps.PlaneBoundary((0, -50, 0), (0, 1, 0)))
        sim = simulate(scene, device)
        sim.run(3)
        assert np.isfinite(sim.position).all()
    still = simulate(held, device)
    still.run(3)
    assert np.array_equal(still.position, np.zeros((9, 3)))


def test_particles_in_one_place_part(device, simulate):
    """20 in one place, at rest, of which half fill it: they part, and none flies off.

    Each is let go at half the depenetration speed of 1, by each of two sweeps. (The watchdog would
    ask finer substeps what they make of it, which is to part more evenly.)
    """
    scene = ps.Scene()
    scene.add_particles(np.zeros((20, 3)), mass=1.0)
    scene.add_constraint(ps.FluidDensity(rest_density=1000.0, smoothing_length=H))
    scene.add_constraint(ps.PlaneBoundary((0, -50, 0), (0, 1, 0)))
    sim = simulate(scene, device, iterations=2, depenetration_speed=1.0, watchdog=False)
    sim.run(150)
    apart = np.linalg.norm(sim.position[:, None] - sim.position, axis=-1)
    assert apart[np.triu_indices(20, 1)].min() > 0.01 * H
    assert np.linalg.norm(sim.velocity, axis=1).max() < 1.5
    assert np.abs(sim.diagnostics().momentum).max() < 1e-12
    assert sim.diagnostics().constraint_error < 0.02
