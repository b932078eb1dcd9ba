"""Sums over pairs: what laws may name, coincident particles, and what they refuse."""

import numpy as np
import pytest
import warp as wp

import particlesim as ps

# What laws may name -----------------------------------------------------------------------------


@ps.law
def everything(
    r: float, distance_squared: float, x_ij: wp.vec3, mass_j: float, velocity_i: wp.vec3,
    velocity_j: wp.vec3, charge_i: float, cutoff: float, strength: float, along: wp.vec3, n: int,
    scale: float = 2.0,
) -> wp.vec3:  # fmt: skip
    relative = scale * (velocity_i - velocity_j) + float(n) * along
    return strength * mass_j * charge_i * (relative + x_ij / r + (cutoff / distance_squared) * x_ij)


@ps.law
def by_mass(total: wp.vec3, mass: float, position: wp.vec3) -> wp.vec3:
    return mass * (total + position)


class Everything(ps.Interaction):
    def __init__(self, cutoff, parameters=None):
        self.cutoff, self.parameters = cutoff, parameters or {}

    def prepare(self, model, neighbors):
        self.sum = ps.PairSum(self, model, neighbors, everything, then=by_mass)

    def apply(self, state, neighbors, dt):
        self.sum.add_to(state.force)


@pytest.mark.parametrize("cutoff", [None, 1.5])
def test_laws_name_the_pair_the_particles_and_the_parameters(cutoff, precision, device):
    random = np.random.default_rng(2)
    x, v = random.uniform(0, 3, (2, 40, 3))
    m, q = random.uniform(1, 2, (2, 40))
    parameters = {"strength": 3.0, "along": (0.5, 0.0, 1.0), "n": 2}
    if cutoff is None:
        parameters["cutoff"] = 1.5
    scene = ps.Scene()
    scene.add_particles(x, velocity=v, mass=m, charge=q)
    scene.add_interaction(Everything(cutoff, parameters))
    sim = ps.Simulation(scene, ps.Settings(precision=precision), device=device)
    sim.forces(0.0)
    d = x[:, None] - x[None]
    r = np.linalg.norm(d, axis=2)[..., None] + np.eye(40)[..., None]
    relative = 2.0 * (v[:, None] - v[None]) + 2 * np.array([0.5, 0.0, 1.0])
    terms = 3.0 * m[None, :, None] * q[:, None, None] * (relative + d / r + 1.5 / r**2 * d)
    terms[(r[..., 0] > (cutoff or np.inf)) | np.eye(40, dtype=bool)] = 0.0
    expected = m[:, None] * (terms.sum(axis=1) + x)
    allowed = 100 * np.finfo(precision).eps * np.abs(terms).sum(axis=1).max()
    np.testing.assert_allclose(sim.get("force"), expected, rtol=0, atol=allowed)


@ps.law
def apart(r: float, x_ij: wp.vec3) -> wp.vec3:
    return x_ij / r


class Apart(Everything):
    def prepare(self, model, neighbors):
        self.sum = ps.PairSum(self, model, neighbors, apart)


@pytest.mark.parametrize("cutoff", [None, 1.0])
def test_coincident_particles_have_a_direction(cutoff, precision, device):
    scene = ps.Scene()
    scene.add_particles(np.repeat([[1.0, 2.0, 3.0]], 2, axis=0))
    scene.add_interaction(Apart(cutoff))
    sim = ps.Simulation(scene, ps.Settings(precision=precision), device=device)
    sim.forces(0.0)
    force = sim.get("force")
    np.testing.assert_array_equal(force[0], -force[1])
    assert np.linalg.norm(force[0]) == pytest.approx(1.0, rel=1e-6)


# What it refuses --------------------------------------------------------------------------------


@ps.law
def number(r: float):
    return r


@ps.law
def by_slope(r: float, slope_j: float):
    return slope_j * r


@ps.law
def of_nothing(r: float, stiffness: float):
    return stiffness * r


@ps.law
def of_the_loop(r: float, cutoff_squared: float):
    return r


@ps.law
def of_charges(charge_i: float, charge_j: float):
    return charge_i * charge_j


@ps.law
def truth(r: float) -> bool:
    return r > 1.0


class Own(ps.Interaction):
    def __init__(self, law, **options):
        self.cutoff, self.law, self.options = 1.0, law, options

    def prepare(self, model, neighbors):
        self.sum = ps.PairSum(self, model, neighbors, self.law, **self.options)

    def apply(self, state, neighbors, dt):
        self.sum.add_to(state.force)


@pytest.mark.parametrize(
    ("law", "options", "says"),
    [
        (of_nothing, {}, "Own.PairSum: stiffness must be given, as of_nothing"),
        (of_the_loop, {}, "a name of its own, got 'cutoff_squared'"),
        (of_charges, {}, "charge must be given or be one of the particles' density, mass"),
        (truth, {}, "truth must return a number or a vector of 2 to 4"),
        (by_slope, {"slope": 3.0}, "slope must be a PairSum of the same interaction, got 3.0"),
        (apart, {"slope": 3.0}, "what its laws name"),
    ],
)
def test_bad_laws(law, options, says, refused):
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0)])
    scene.add_interaction(Own(law, **options))
    with refused(says, kind=TypeError if "slope" in options else ValueError):
        ps.Simulation(scene, device="cpu")


def test_a_number_is_not_added_to_a_force(refused):
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0)])
    scene.add_interaction(Own(number))
    sim = ps.Simulation(scene, device="cpu")
    with refused("Own.PairSum: array must hold .particles, numbers. = .1, 1., got .1, 3."):
        sim.step()
