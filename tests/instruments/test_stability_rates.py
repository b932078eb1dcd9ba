"""Limits of forces: rates, the largest eigenvalue, and where runs diverge."""

import math

import numpy as np
import pytest
import warp as wp

import particlesim as ps
from cases.stability import chain, limit, oscillator, simulation
from particlesim.engine.limit import Limit, explicit_step
from particlesim.engine.rates.spectrum import largest
from particlesim.interactions.bonded.harmonic_bonds import spring_bound


def dimer(interaction, distance, mass=(1.0, 1.0), **kwargs):
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0), (distance, 0, 0)], mass=mass, **kwargs)
    scene.add_interaction(interaction)
    return scene


# The formula, and the largest eigenvalue


@pytest.mark.parametrize(("omega", "gamma"), [(3.0, 0.0), (0.0, 3.0), (3.0, 2.0), (3.0, 40.0)])
def test_step_is_where_the_eigenvalues_leave_the_unit_circle(omega, gamma):
    def radius(dt):
        # v' = v - dt (omega^2 x + gamma v), x' = x + dt v'
        kick = np.array([[1, 0], [-dt * omega**2, 1 - dt * gamma]])
        return np.abs(np.linalg.eigvals(np.array([[1, dt], [0, 1]]) @ kick)).max()

    dt = explicit_step(omega**2, gamma)
    # Without omega x alone is marginal, so the circle is reached to round-off of a double root.
    assert radius(0.999 * dt) < 1 + 1e-7
    assert radius(1.001 * dt) > 1 + 1e-4


def test_step_without_rates_is_any():
    assert explicit_step(0.0, 0.0) == math.inf


@pytest.mark.parametrize("symmetric", [True, False])
def test_largest_eigenvalue(symmetric):
    rng = np.random.default_rng(3)
    matrix = rng.normal(size=(60, 60))
    matrix = matrix + matrix.T if symmetric else matrix @ matrix
    expected = np.abs(np.linalg.eigvals(matrix)).max()
    found = largest(lambda q: (q, matrix @ q), rng.normal(size=60), steps=40, tolerance=0.005)
    # The residual is 0.5 % of it when the iteration stops.
    assert found.bound == pytest.approx(expected, rel=0.01)


def test_largest_eigenvalue_of_nothing():
    found = largest(lambda q: (q, 0 * q), np.ones(6), steps=9, tolerance=0.005)
    assert found.bound == 0.0 and found.steps == 1


# Known limits. The estimate stops at a residual of 0.5 % of omega^2, 0.25 % of dt; within 1 %.


@pytest.mark.parametrize("mass", [2.0, 1e-6])
def test_oscillator(precision, mass):
    expected = 2 / math.sqrt(100.0 / mass)
    assert limit(oscillator(mass=mass), precision=precision) == pytest.approx(expected, rel=0.01)


@pytest.mark.parametrize("integrator", ["symplectic_euler", "velocity_verlet"])
def test_oscillator_is_bounded_below_and_diverges_above(integrator):
    omega = math.sqrt(50.0)
    reach = {}
    for factor in (1.99, 2.01):
        sim = simulation(
            oscillator(start=1.0 + 1e-3), dt=100 * factor / omega, substeps=100,
            precision="float64", integrator=integrator, watchdog=False,
        )  # fmt: skip
        for _ in range(5):
            sim.step()
        reach[factor] = np.abs(sim.position[1, 0] - 1.0)
    # Eigenvalues -1.99 and below leave an amplitude of 1e-3 / sqrt(1 - (1.99 / 2)^2) = 1e-2 at
    # most; at 2.01 it grows by 1.105 a step, 1.105^500 = 5e21, until the law is no longer linear.
    assert reach[1.99] < 0.011
    assert reach[2.01] > 1.0


@pytest.mark.parametrize("count", [2, 5, 60])
def test_chain(precision, count):
    # Free chain of n masses: omega = 2 sqrt(k/m) sin(pi (n - 1) / (2 n)).
    omega = 2 * math.sqrt(50.0 / 0.3) * math.sin(math.pi * (count - 1) / (2 * count))
    dt = limit(chain(count), precision=precision)
    assert dt == pytest.approx(2 / omega, rel=0.01)
    assert dt >= 1 / math.sqrt(50.0 / 0.3) * (1 - 1e-6)  # the bound of Anderson and Morley


def test_masses_apart():
    scene = dimer(ps.Springs([(0, 1)], 7.0), 1.0, mass=[1.0, 1e4])
    assert limit(scene) == pytest.approx(2 / math.sqrt(7.0 * (1 + 1e-4)), rel=0.01)


def test_bound_of_springs_is_above_the_largest_eigenvalue():
    rng = np.random.default_rng(1)
    for _ in range(10):
        pairs = np.array([p for p in np.ndindex(12, 12) if p[0] < p[1] and rng.random() < 0.4])
        k, w = rng.uniform(0.0, 9.0, len(pairs)), rng.uniform(0.0, 3.0, 12)
        w[:2] = 0.0
        laplacian = np.zeros((12, 12))
        for (i, j), each in zip(pairs, k, strict=True):
            laplacian[[i, j, i, j], [i, j, j, i]] += [each, each, -each, -each]
        true = np.linalg.eigvalsh(np.sqrt(w)[:, None] * laplacian * np.sqrt(w)).max()
        assert true <= spring_bound(pairs, k, w) <= 4 * true


def test_springs_with_damping():
    # Along the spring omega^2 = 2 k / m and gamma = 2 c / m.
    scene = dimer(ps.Springs([(0, 1)], 30.0, damping=4.0), 1.0)
    assert limit(scene) == pytest.approx(explicit_step(60.0, 8.0), rel=0.01)
    report = simulation(scene).stability()
    assert report.binding.kind == "frequency and damping"


def test_lennard_jones_dimer():
    # u'' at r = 2^(1/6): 4 (12 * 13 / r^14 - 6 * 7 / r^8) = 72 / 2^(1/3) = 57.146.
    scene = dimer(ps.LennardJones(cutoff=3.0), 2 ** (1 / 6), mass=[2.0, 2.0])
    dt = limit(scene, precision="float64")
    assert dt == pytest.approx(2 / math.sqrt(72 / 2 ** (1 / 3)), rel=0.01)


def of_kind(scene, kind, **knobs):
    """The limit of one kind."""
    (found,) = [each for each in simulation(scene, **knobs).stability().limits if each.kind == kind]
    return found


def test_gravity_of_a_close_pair():
    # The tide along the line: 2 G (m_i + m_j) / r^3.
    scene = dimer(ps.Gravity(G=3.0), 0.5, mass=[2.0, 1.0])
    tide = of_kind(scene, "frequency", precision="float64")
    assert tide.dt == pytest.approx(2 / math.sqrt(2 * 3 * 3 / 0.125), rel=0.01)


def test_gravity_through_the_softening_length():
    scene = dimer(ps.Gravity(G=3.0, softening=0.01), 5.0, mass=[2.0, 1.0])
    passage = of_kind(scene, "passage")
    assert passage.dt == pytest.approx(2 / math.sqrt(3 * 3 / 1e-6), rel=1e-6)


def test_drag():
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0), (1, 0, 0)], mass=[0.5, 2.0], velocity=(3, 0, 0))
    scene.add_interaction(ps.Drag(linear=4.0))
    report = simulation(scene).stability()
    assert report.dt == pytest.approx(2 * 0.5 / 4.0, rel=0.01)
    assert report.binding.kind == "damping" and report.binding.particle == 0
    # v falls or grows by 1 - dt gamma a step: |v| = 3 * 1.01^300 = 59 against 3 * 0.99^300.
    for factor, bounded in ((0.995, True), (1.005, False)):
        sim = simulation(scene, dt=300 * factor * 0.25, substeps=300, watchdog=False)
        sim.step()
        assert (abs(sim.velocity[0, 0]) < 3.0) == bounded


def test_quadratic_drag_at_the_present_speed():
    # f = -b |u| u: df/du = 2 b |u| along u.
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0)], velocity=(0, 3, 4))
    scene.add_interaction(ps.Drag(quadratic=0.5))
    assert limit(scene) == pytest.approx(2 / (2 * 0.5 * 5), rel=0.01)


@ps.law
def crooked_trap(position: wp.vec3, soft: float, hard: float):
    return -wp.vec3(soft * position[0], soft * position[1], hard * position[2])


@pytest.mark.parametrize("place", [(0.0, 0.0, 0.0), (1.0, 2.0, 3.0), (1e-9, 0.0, 0.0)])
def test_particle_force(place):
    scene = ps.Scene()
    scene.add_particles([place], mass=0.1)
    scene.add_interaction(ps.ParticleForce(crooked_trap, soft=1.0, hard=90.0))
    assert limit(scene) == pytest.approx(2 / math.sqrt(900.0), rel=0.01)


def test_gravity_on_earth_limits_nothing():
    scene = ps.Scene()
    scene.add_particles([(0, 1, 0)], velocity=(1, 0, 0), radius=0.1)
    scene.add_interaction(ps.UniformGravity())
    scene.add_constraint(ps.PlaneBoundary((0, 0, 0), (0, 1, 0)))
    report = simulation(scene).stability()
    assert report.dt == math.inf and report.binding is None and report.substeps == 1
    assert report.safe and "nothing limits it" in str(report)


class Doubled(ps.Springs):
    """A user's interaction, of which nothing is known but apply."""

    limits = ps.Interaction.limits

    def apply(self, state, neighbors, dt):
        super().apply(state, neighbors, dt)
        super().apply(state, neighbors, dt)


def test_an_interaction_that_says_nothing_is_probed():
    scene = dimer(Doubled([(0, 1)], 8.0), 1.0)
    assert limit(scene) == pytest.approx(2 / math.sqrt(32.0), rel=0.01)


class Thermostat(ps.Drag):
    """A part that knows its limit."""

    def limits(self, probe):
        return [Limit(self.name, "thermostat", 0.125, "an eighth of its time")]


def test_a_part_offers_its_own_limit():
    scene = oscillator()
    scene.add_interaction(Thermostat(linear=1.0))
    report = simulation(scene).stability()
    assert (report.dt, report.binding.kind) == (0.125, "thermostat")


def test_a_constraint_as_a_force():
    rod = ps.Distance([(0, 1)], rest_length=1.0, compliance=0.02)
    assert limit(dimer(rod.as_force(), 1.0)) == pytest.approx(2 / math.sqrt(100.0), rel=0.01)


def test_forces_add_up():
    scene = dimer(ps.Springs([(0, 1)], 3.0), 1.0)
    scene.add_interaction(ps.Springs([(0, 1)], 5.0))
    report = simulation(scene).stability()
    assert report.dt == pytest.approx(2 / math.sqrt(16.0), rel=0.01)
    assert report.binding.part == "Springs + Springs"
    # On different particles they do not.
    scene = chain(2, 3.0)
    scene.add_particles([(0, 5, 0), (1, 5, 0)])
    scene.add_interaction(ps.Springs([(2, 3)], 5.0))
    assert limit(scene) == pytest.approx(2 / math.sqrt(20.0), rel=0.01)


def test_far_from_the_origin_and_large():
    scene = oscillator()
    x = scene.position.copy()
    for offset in (1e3, 1e5):
        far = ps.Scene()
        far.add_particles([x[0] + offset], pinned=True)
        far.add_particles([x[1] + offset], mass=2.0)
        far.add_interaction(ps.Springs([(0, 1)], 100.0, 1.0))
        # Rounded at 0.008 the two are no longer along x, nor 1.3 apart, but as stiff.
        assert limit(far) == pytest.approx(2 / math.sqrt(50.0), rel=0.02)
