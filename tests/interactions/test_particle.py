"""Forces on each particle by itself: of fields and potentials, groups, time, drag."""

import numpy as np
import pytest
import warp as wp

import particlesim as ps


def test_uniform_gravity_is_weight_and_height(precision, device, simulate):
    scene = ps.Scene()
    scene.add_particles([(0, 2, 0), (0, 3, 5)], mass=[1, 4])
    scene.add_interaction(ps.UniformGravity((0, -10, 0)))
    sim = simulate(scene, device, precision=precision)
    sim.forces(0.0)
    np.testing.assert_array_equal(sim.get("force"), [(0, -10, 0), (0, -40, 0)])
    assert sim.diagnostics().potential[0] == 20 + 120


def test_only_the_group_feels_it(precision, device, cluster, force_of):
    scene = cluster(8)
    few = scene.add_particles([(5, 0, 0), (6, 0, 0)], group="few")
    more = scene.add_particles([(5, 1, 0)], group="more")
    scene.add_interaction(ps.ConstantForce((0, 1, 0), few))
    scene.add_interaction(ps.ConstantForce((0, 0, 2), [few, more]))
    scene.add_interaction(ps.ConstantForce((3, 0, 0), [0, 2]))
    scene.add_interaction(ps.Gravity(few))
    expected = np.zeros((11, 3))
    expected[few.slice] = [(1, 1, 2), (-1, 1, 2)]
    expected[more.slice] = (0, 0, 2)
    expected[[0, 2], 0] = 3
    np.testing.assert_allclose(force_of(scene, precision, device), expected, atol=1e-6)


def test_time_in_a_law(precision, device, simulate):
    @ps.law
    def ramp(time: float, mass: float, jerk: wp.vec3):
        return mass * time * jerk

    scene = ps.Scene()
    scene.add_particles([(0, 0, 0)], mass=3.0)
    scene.add_interaction(ps.ParticleForce(ramp, jerk=(0, 6, 0)))
    for method, expected in (
        # v = sum of a(t_k) dt over t_k = 0, dt .. (n-1) dt; and by the trapezoidal rule, exactly.
        ("symplectic_euler", 6 * 0.01**2 * 100 * 99 / 2),
        ("velocity_verlet", 6 * 1.0 / 2),
    ):
        sim = simulate(scene, device, dt=0.1, substeps=10, precision=precision, integrator=method)
        for _ in range(10):
            sim.step()
        # 100 additions of rounded increments, compensated.
        assert sim.velocity[0, 1] == pytest.approx(expected, rel=1e-6)


def test_drag_takes_away_the_same_share_each_step(precision, device, simulate):
    # v -> v (1 - c dt/m) in every step of symplectic Euler: (1 - z)^n, near exp(-n z).
    c, m, n = 2.0, 0.5, 100
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0)], velocity=(3, 4, 0), mass=m)
    scene.add_interaction(ps.Drag(linear=c))
    sim = simulate(scene, device, dt=0.1, substeps=n, precision=precision)
    sim.step()
    z = c * 0.1 / n / m
    speed = np.linalg.norm(sim.velocity[0])
    # Each of n steps rounds the increment, z of the speed, by up to 4 eps; the speed by 2 more.
    eps = float(np.finfo(precision).eps)
    assert speed == pytest.approx(5 * (1 - z) ** n, rel=(4 * n * z + 2) * eps)
    # (1 - z)^n = exp(-n z - n z^2/2 - ...)
    assert speed == pytest.approx(5 * np.exp(-0.4), rel=n * z**2)


def test_quadratic_drag_is_against_the_flow(device, force_of):
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0)], velocity=(3, 0, 5))
    scene.add_interaction(ps.Drag(linear=0.5, quadratic=2.0, flow=(0, 4, 5)))
    # u = (3, -4, 0), |u| = 5: f = -(0.5 + 10) u.
    np.testing.assert_allclose(force_of(scene, "float64", device)[0], [-31.5, 42, 0], rtol=1e-14)


# Fields -------------------------------------------------------------------------------------------


@ps.law
def swell(position: wp.vec3, time: float, charge: float, height: float, k: wp.vec3):
    """q h cos(k.x - t)"""
    return charge * height * wp.cos(wp.dot(k, position) - time)


@ps.law
def swell_force(position: wp.vec3, time: float, charge: float, height: float, k: wp.vec3):
    return charge * height * wp.sin(wp.dot(k, position) - time) * k


SWELL = {"height": 0.7, "k": (1.0, 2.0, -0.5)}


def riders(interaction, w=0):
    scene = ps.Scene()
    rng = np.random.default_rng(w)
    scene.add_particles(rng.normal(size=(20, 3)), charge=rng.normal(size=20))
    scene.add_interaction(interaction)
    return scene


def test_a_potential_is_enough(precision, device, simulate):
    results = []
    for laws in ({"potential": swell}, {"law": swell_force, "potential": swell}):
        scene = riders(ps.ParticleForce(**laws, **SWELL))
        sim = simulate(scene, device, dt=0.1, substeps=10, precision=precision)
        for _ in range(5):
            sim.step()
        results.append((sim.position, sim.get("force"), sim.diagnostics().potential))
    # A handful of roundings of forces below 2, in each of 50 steps.
    for derived, written in zip(*results, strict=True):
        np.testing.assert_allclose(derived, written, rtol=0, atol=500 * np.finfo(precision).eps)


def test_a_field_has_its_force_at_every_place_and_time(precision, device, simulate):
    scene = riders(ps.ParticleForce(potential=swell, **SWELL))
    sim = simulate(scene, device, dt=0.25, substeps=1, precision=precision)
    for frame in range(3):
        x, time = sim.position, 0.25 * frame
        sim.step()
        phase = x @ np.array(SWELL["k"]) - time
        expected = (0.7 * scene.column("charge") * np.sin(phase))[:, None] * np.array(SWELL["k"])
        np.testing.assert_allclose(
            sim.get("force"), expected, rtol=0, atol=50 * np.finfo(precision).eps
        )


def test_fields_of_worlds(device, simulate):
    def scenes():
        return [
            riders(ps.ParticleForce(potential=swell, k=(1, 0, 0), height=h)) for h in (1.0, 3.0)
        ]

    together = simulate(scenes(), device, dt=0.1)
    together.step()
    for w, scene in enumerate(scenes()):
        alone = simulate(scene, device, dt=0.1)
        alone.step()
        np.testing.assert_array_equal(together.world(w).position, alone.position)


@ps.law
def nowhere(velocity: wp.vec3):
    return wp.dot(velocity, velocity)


@ps.law
def endless(position: wp.vec3):
    total = float(0.0)
    while total < position[0]:
        total += 1.0
    return total


@pytest.mark.parametrize(
    ("laws", "says"),
    [
        ({}, "law must be given, or a potential, got None"),
        ({"potential": nowhere}, "potential nowhere must take position, to be derived by it"),
        ({"potential": endless}, "law endless must loop at most 16 rounds"),
    ],
)
def test_what_gives_no_force(laws, says, refused):
    with refused(says):
        ps.ParticleForce(**laws)


@pytest.mark.parametrize("start", [0.0, 1e3, 1e5, 1e7])
def test_time_keeps_its_digits(start, precision, device):
    """A drive of 50 Hz after hours and months: off by the rounding of the clock, 2e-9 s at 1e7."""

    @ps.law
    def drive(time: float, rate: float):
        return wp.vec3(wp.cos(rate * time), 0.0, 0.0)

    @ps.law
    def tide(position: wp.vec3, time: float, k: wp.vec3, count: int):
        return float(count) * wp.dot(k, position) * wp.cos(64.0 * time)

    scene = ps.Scene()
    scene.add_particles([(0, 0, 0)])
    scene.add_interaction(ps.ParticleForce(drive, rate=64.0))
    scene.add_interaction(ps.ParticleForce(potential=tide, k=(0, -1, 0), count=2))
    sim = ps.Simulation(scene, ps.Settings(precision=precision), device=device)
    sim.state.time.assign([start + 0.003])
    sim.forces(0.0)
    phase = 64.0 * (start + 0.003)
    rounding = 4 * float(np.finfo(precision).eps) + np.spacing(phase)
    expected = [np.cos(phase), 2 * np.cos(phase), 0]
    np.testing.assert_allclose(sim.get("force")[0], expected, rtol=0, atol=2 * rounding)
