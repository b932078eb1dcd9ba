"""Several fluids in one SPH: density by number, forces, viscosities, walls, what is refused."""

import itertools

import numpy as np
import pytest

import particlesim as ps
from cases.gradients import assert_gradient
from cases.worlds import equal_alone, goes_on_after_reset_and_save

SIZE = 0.1  # of the particles' lattice
H = 1.3 * SIZE
RHO = np.array([1000.0, 2.0])
STATES = [ps.Tait(10.0), ps.Tait(100.0, 1.4)]
NU = np.array([0.3, 2.0])
VISCOSITY = [ps.ArtificialViscosity(0.2, 0.1), ps.LaminarViscosity(NU)]
BOX = ps.BoxBoundary((0, 0, 0), (1, 2, 1))


def layers(speed=0.0, walls=(), seed=1, **options):
    """A light fluid on a heavy one, somewhat compressed."""
    random = np.random.default_rng(seed)
    x = ps.sample.box((0, 0, 0), (0.5, 0.6, 0.4), SIZE, jitter=0.2, seed=seed)
    x = np.maximum(x, 0.075)  # so that no wall gives way
    scene, low = ps.Scene(), x[:, 1] < 0.3
    for name, own, rho in zip(("water", "air"), (low, ~low), RHO, strict=True):
        v = speed * random.normal(size=(own.sum(), 3))
        scene.add_particles(x[own], velocity=v, mass=1.1 * rho * SIZE**3, radius=1e-4, group=name)
    given = {"rest_density": RHO, "equation_of_state": STATES, "viscosity": VISCOSITY, **options}
    scene.add_interaction(ps.SPH(["water", "air"], smoothing_length=H, **given))
    for each in walls:
        scene.add_constraint(each)
    return scene


def distances(x):
    return np.linalg.norm(x[:, None] - x, axis=-1)


def simulation(scene, device="cpu", precision="float64", **knobs):
    settings = ps.Settings(dt=1e-4, substeps=2, precision=precision, **knobs)
    return ps.Simulation(scene, settings, device=device)


def reference(scene):
    """Densities and forces by sums over all pairs, as Hu and Adams (2006) and Morris write them."""
    x, v, m = scene.position, scene.velocity, scene.mass
    fluid = (np.arange(len(x)) >= len(scene["water"])).astype(int)
    W = ps.WendlandC2()
    r = distances(x)
    n = W.value(r, H).sum(axis=1)
    rho, exponent = m * n, np.array([7.0, 1.4])[fluid]
    c0, rho0 = np.array([10.0, 100.0])[fluid], RHO[fluid]
    s = np.maximum(rho / rho0, 1.0)
    P = c0**2 * rho0 / exponent * (s**exponent - 1.0)
    c = np.sqrt((exponent * P + c0**2 * rho0) / np.maximum(rho, rho0))
    x_ij, v_ij = x[:, None] - x, v[:, None] - v
    slope = W.derivative(r, H) / np.where(r > 0, r, 1.0)
    mean = lambda a: 0.5 * (a[:, None] + a)  # noqa: E731
    mu = H * np.minimum((x_ij * v_ij).sum(-1), 0.0) / (r**2 + 0.01 * H**2)
    pi = (-0.2 * mean(c) * mu + 0.1 * mu**2) / mean(rho)
    push = P / n**2
    along = -(push[:, None] + push + np.outer(m, m) * pi) * slope
    # Morris' term is that of dynamic viscosities: V_i V_j (eta_i + eta_j) W' / r v_ij.
    eta = NU[fluid] * rho
    aside = np.outer(1 / n, 1 / n) * (eta[:, None] + eta) * slope
    return rho, P, (along[..., None] * x_ij + aside[..., None] * v_ij).sum(axis=1)


def test_densities_and_forces_are_those_of_sums_by_number():
    scene = layers(speed=1.0)
    sim, (rho, P, force) = simulation(scene), reference(scene)
    # Sums of 50 terms in float64, of pressures that are a hundredth of the stiffness c^2 rho0.
    np.testing.assert_allclose(sim.get("density"), rho, rtol=1e-12)
    np.testing.assert_allclose(sim.get("pressure"), P, rtol=1e-10, atol=1e-9 * P.max())
    np.testing.assert_allclose(sim.get("force"), force, atol=1e-11 * np.abs(force).max())
    assert np.abs(sim.get("force").sum(axis=0)).max() < 1e-12 * np.abs(force).sum()


@pytest.mark.slow
def test_fields_are_interpolated_by_volumes():
    scene = layers()
    sim = simulation(scene)
    one = np.ones(sim.particle_count)
    found = sim.interpolate(sim.interactions[0], None, one)
    W = ps.WendlandC2().value(distances(scene.position), H)
    np.testing.assert_allclose(found, W @ (1.0 / W.sum(axis=1)), rtol=1e-12)


@pytest.mark.parametrize("walls", [[], pytest.param([BOX], marks=pytest.mark.slow)])
def test_forces_are_minus_the_gradient_of_the_energy(walls):
    """At rest, on both sides and in a corner, of walls too."""
    scene = layers(walls=walls)
    x, sim = scene.position, simulation(scene)
    force, corner = sim.get("force"), int(np.argmin(scene.position.max(axis=1)))
    between = np.argsort(np.abs(x[:, 1] - 0.3))[:4]
    for i, axis in itertools.product([corner, *between], range(3)):
        assert_gradient(sim, x, force, i, axis)


@pytest.mark.slow
def test_fluids_of_equal_masses_are_one():
    alike = {"rest_density": [1000.0, 1000.0], "equation_of_state": [STATES[0]] * 2}
    one = {"rest_density": 1000.0, "equation_of_state": STATES[0]}
    alike["viscosity"] = one["viscosity"] = [VISCOSITY[0], ps.LaminarViscosity(0.3)]
    forces = []
    for options in (alike, one):
        scene = layers(speed=1.0, walls=[BOX], **options)
        scene.mass[:] = 1100 * SIZE**3
        forces.append(simulation(scene).get("force"))
    np.testing.assert_allclose(forces[0], forces[1], atol=1e-12 * np.abs(forces[1]).max())


@pytest.mark.slow
def test_worlds_go_alone_as_together(device, tmp_path):
    scenes = [layers(speed=1.0), layers(speed=1.0, seed=2, rest_density=[1000.0, 1.8])]
    equal_alone(simulation, scenes, device, 10)
    goes_on_after_reset_and_save(simulation, scenes, device, tmp_path / "two.npz")


@pytest.mark.slow
def test_energy_is_kept_without_viscosity():
    """Of a step a hundredth of a period of sound the leapfrog keeps all but (omega dt)^2 / 24."""
    sim = simulation(layers(viscosity=VISCOSITY[0:0]), integrator="velocity_verlet")
    before = sim.diagnostics()
    sim.run(40)
    after = sim.diagnostics()
    assert after.kinetic[0] > 0.1 * before.potential[0]
    assert after.energy[0] == pytest.approx(before.energy[0], rel=2e-3)
    # Round-off of 80 steps of forces that sum to 1e-12 of what moves.
    moving = np.abs(sim.velocity * sim.scenes[0].mass[:, None]).sum()
    assert np.abs(after.momentum).max() < 1e-10 * moving


@pytest.mark.parametrize(
    "change, said",
    [
        ({"rest_density": [1000.0, 2.0, 1.0]}, "one for each of 2 groups"),
        ({"equation_of_state": [STATES[0]]}, "one for each of 2 groups"),
        ({"equation_of_state": [STATES[0], ps.Polytrope(1.0)]}, "of one kind for all fluids"),
        ({"equation_of_state": [ps.IdealGas(1.4)] * 2}, "no internal energy with several fluids"),
        ({"smoothing_length": ps.AdaptiveSmoothing()}, "one number with several fluids"),
        ({"rest_density": [1000.0, 0.0]}, "above 0"),
        ({"viscosity": ps.LaminarViscosity([1.0, 2.0, 3.0])}, "one for each of 2 groups"),
        ({"group": None}, "list of groups, one a fluid"),
    ],
)
def test_what_is_refused(change, said):
    given = {"group": ["a", "b"], "smoothing_length": H, "rest_density": RHO, **change}
    with pytest.raises(ValueError, match=said):
        ps.SPH(**{"equation_of_state": STATES, **given})


def test_fluids_share_no_particle_and_fit_their_densities():
    scene = layers(rest_density=[4000.0, 8.0])  # both too light
    assert "mass must make the rest density" in simulation(scene).interactions[0].complaint()
    scene = ps.Scene()
    group = scene.add_particles(np.eye(3), mass=1.0)
    scene.add_interaction(
        ps.SPH([group, group], smoothing_length=1.0, rest_density=RHO, equation_of_state=STATES)
    )
    with pytest.raises(ValueError, match="no particle in common"):
        simulation(scene)
