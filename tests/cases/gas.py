"""A gas of which each particle has a smoothing length of its own, and what its sums should be."""

import numpy as np

import particlesim as ps

ETA, GAMMA = 1.2, 5 / 3
VISCOSITY = ps.ArtificialViscosity(1.0, 2.0)
SIGMA = 21 / (16 * np.pi)
BOX = ((-2.0, -2.0, -2.0), (2.0, 2.0, 2.0))


def cloud(count, seed=1, periodic=None, viscosity=VISCOSITY, state=None, group=None, **options):
    """Gas that is some hundred times as dense in the middle as outside, and quick."""
    random = np.random.default_rng(seed)
    x = random.normal(0, 0.7, (count, 3))
    if periodic is not None:
        x = random.uniform(-2, 2, (count, 3)) * np.where(np.arange(count) % 2, 1, 0.3)[:, None]
    scene = ps.Scene(periodic=periodic)
    scene.add_particles(
        x, mass=random.uniform(0.5, 1.5, count) / count, velocity=random.normal(0, 0.5, (count, 3)),
        internal_energy=random.uniform(0.5, 1.5, count),
    )  # fmt: skip
    scene.add_interaction(
        ps.SPH(group, smoothing_length=ps.AdaptiveSmoothing(ETA, **options),
               equation_of_state=state or ps.IdealGas(GAMMA), viscosity=viscosity)
    )  # fmt: skip
    return scene


def simulate(scene, device="cpu", integrator="velocity_verlet", **knobs):
    settings = ps.Settings(
        **{"dt": 0.02, "substeps": 4, "precision": "float64", "integrator": integrator, **knobs}
    )
    return ps.Simulation(scene, settings, device=device)


def reference(scene, sim):
    """Of all pairs, at the present state: eta, densities, accelerations and heating."""
    m, h = scene.mass, sim.state.smoothing_length.numpy().astype(float)
    x, v, u = (sim.get(name).astype(float) for name in ("position", "velocity", "internal_energy"))
    x_ij, v_ij = x[:, None] - x, v[:, None] - v
    if scene.periodic:
        x_ij -= 4.0 * np.round(x_ij / 4.0)
    r = np.linalg.norm(x_ij, axis=-1)
    q = r / h[:, None]
    s = np.maximum(1 - q / 2, 0)
    w, slope = s**4 * (1 + 2 * q), -5 * s**3
    sums = (m * w).sum(axis=1)
    rho = SIGMA / h**3 * sums
    omega = -(m * q * q * slope).sum(axis=1) / (3 * sums)
    omega[sim.interactions[0].lengths.at_bound()] = 1.0  # lengths that do not follow
    c, approach = np.sqrt(GAMMA * (GAMMA - 1) * u), (v_ij * x_ij).sum(axis=-1)
    mean = lambda a: (a[:, None] + a) / 2  # noqa: E731
    mu = mean(h) * np.minimum(approach, 0) / (r**2 + 0.01 * mean(h) ** 2)
    viscous = (2 * mu - mean(c)) * mu / mean(rho)
    stress = (GAMMA - 1) * u / (omega * rho)
    g = SIGMA / h[:, None] ** 5 * slope
    pull = (stress[:, None] + viscous / 2) * g
    a = -((m * (pull + pull.T))[:, :, None] * x_ij).sum(axis=1)
    heat = (m * (stress[:, None] * g + viscous / 4 * (g + g.T)) * approach).sum(axis=1)
    return (h**3 * rho / m) ** (1 / 3), rho, a, heat


def check(scene, sim):
    """Sums of the simulation, whose forces were taken at its present state, and all pairs'."""
    precision = sim.model.precision.name
    eta, rho, a, heat = reference(scene, sim)
    # ln h is found to the tolerance in a Newton step, and twice that where Omega is far off 1.
    tolerance, eps = {"float32": 1e-5, "float64": 1e-9}[precision], np.finfo(precision).eps
    free = ~sim.interactions[0].lengths.at_bound()
    assert free.mean() > 0.98
    np.testing.assert_allclose(eta[free], ETA, rtol=10 * tolerance + 100 * eps)
    np.testing.assert_allclose(sim.get("density"), rho, rtol=100 * eps)
    size = np.abs(a).max()
    np.testing.assert_allclose(sim.get("force") / scene.mass[:, None], a, atol=60 * 16 * eps * size)
    return heat
