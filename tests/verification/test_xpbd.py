"""Known answers of XPBD and mechanics: springs, pendulums, chains, strings, friction, bounces."""

import numpy as np
import pytest
import warp as wp

import particlesim as ps

G = 9.81
GRAVITY = (0.0, -G, 0.0)


@ps.law
def brake(velocity: wp.vec3, mass: float, rate: float):
    """A resistance that slows every particle alike."""
    return -rate * mass * velocity


def simulate(scene, device, **knobs):
    """A simulation in float64 unless told otherwise."""
    return ps.Simulation(scene, ps.Settings(**{"precision": "float64", **knobs}), device=device)


def hanging(x, mass=1.0, pinned=0, rate=0.0):
    """Particles under gravity, some pinned, with a resistance."""
    scene = ps.Scene()
    scene.add_particles(x, mass=mass, pinned=np.isin(np.arange(len(x)), pinned))
    scene.add_interaction(ps.UniformGravity(GRAVITY))
    if rate:
        scene.add_interaction(ps.ParticleForce(brake, rate=rate))
    return scene


@pytest.mark.parametrize("iterations", [1, 2, 5, 20, 100])
def test_compliance_does_not_depend_on_the_iterations(iterations, device, precision):
    """m = 1, k = 1000, h = 1/60: the stretch is m g / k = 0.00981 for any number of iterations."""
    scene = hanging([(0, 0, 0), (0, -1, 0)])
    spring = scene.add_constraint(ps.Distance([(0, 1)], compliance=1e-3))
    knobs = {"dt": 1 / 60, "substeps": 1, "iterations": iterations, "precision": precision}
    sim = simulate(scene, device, **knobs)
    sim.run(400)
    # The oscillation has died down by (1 + k h^2 / m)^(-400/2) = 5e-22: rounding of x is left.
    epsilon = float(np.finfo(precision).eps)
    assert -sim.position[1, 1] - 1 == pytest.approx(1e-3 * G, abs=4 * epsilon)
    # lam comes of a difference of lengths near 1, so the force is as exact as k times that.
    assert sim.force(spring)[0] == pytest.approx(G, abs=1000 * 8 * epsilon)


@pytest.mark.parametrize("substeps", [60, 600, 6000])
def test_numerical_damping_of_a_spring(substeps, device):
    """E / E0 = (1 + omega^2 h^2)^-n, as for implicit Euler: exact for a linear spring."""
    k, m, start = 200.0, 2.0, 0.1
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0), (1 + start, 0, 0)], mass=m, pinned=[True, False])
    scene.add_constraint(ps.Distance([(0, 1)], 1.0, compliance=1 / k))
    sim = simulate(scene, device, dt=1.0, substeps=substeps)
    sim.step()
    stretch, v = sim.position[1, 0] - 1, sim.velocity[1, 0]
    energy = (m * v**2 + k * stretch**2) / (k * start**2)
    expected = (1 + (k / m) / substeps**2) ** -substeps
    # Rounding of n steps, each of a few last bits of lengths near 1 out of a stretch of 0.1.
    assert energy == pytest.approx(expected, rel=20 * substeps * np.finfo(float).eps)


def quarter_periods(angles, substeps, device):
    """Times 4 T/4 from rest at each angle to the first passage through the lowest point."""
    scenes = []
    for angle in np.radians(angles):
        scene = hanging([(0, 0, 0), (np.sin(angle), -np.cos(angle), 0)])
        scene.add_constraint(ps.Distance([(0, 1)]))
        scenes.append(scene)
    frame = 0.01
    sim = simulate(scenes, device, dt=frame, substeps=substeps)
    theta = []
    for _ in range(125):
        x = sim.position[1::2]
        theta.append(np.arctan2(x[:, 0], -x[:, 1]))
        sim.step()
    theta = np.array(theta)
    after = np.argmax(theta < 0, axis=0)
    worlds = np.arange(len(angles))
    a, b = theta[after - 1, worlds], theta[after, worlds]
    return 4 * frame * (after - 1 + a / (a - b))


def test_pendulum_period(device):
    """T / T0 of a rigid pendulum at six amplitudes, and convergence of first order."""
    angles = [30, 60, 90, 120, 150, 170]
    expected = np.array([1.017409, 1.073182, 1.180341, 1.372881, 1.762204, 2.439363])
    small = 2 * np.pi / np.sqrt(G)
    coarse, fine = (quarter_periods(angles, n, device) / small for n in (50, 100))
    # Symplectic Euler with projection is of first order: errors of h sqrt(g / L) = 3e-4 halve.
    assert np.abs(fine / expected - 1).max() < 3e-4
    assert np.allclose((coarse - expected) / (fine - expected), 2.0, atol=0.1)
    # What is left without the first order: h^2 g / L, and the six digits of the reference.
    assert np.abs((2 * fine - coarse) / expected - 1).max() < 1e-6


@pytest.mark.parametrize("ratio", [1e3, 1e4])
def test_heavy_chain(ratio, device):
    """Link i stretches by alpha_i g (mass below), under a weight of 1000 and 10 000 links."""
    links, h = 8, 2e-5
    mass = np.ones(links + 1)
    mass[-1] = ratio
    below = np.cumsum(mass[::-1])[::-1][1:]
    compliance = np.linspace(1, 2, links) * 0.01 / (ratio * G)  # stretches of 1 to 2 cm
    x = np.zeros((links + 1, 3))
    x[:, 1] = -np.arange(links + 1)
    scene = hanging(x, mass=mass, rate=18.0)
    pairs = np.stack([np.arange(links), np.arange(1, links + 1)], axis=1)
    chain = scene.add_constraint(ps.Distance(pairs, compliance=compliance))
    sim = simulate(scene, device, dt=1000 * h, substeps=1000)
    sim.run(100)  # near critical damping, sqrt(g / sum of stretches) = 9: down to 20 exp(-18)
    stretch = -np.diff(sim.position[:, 1]) - 1
    expected = compliance * G * below
    # One sweep a substep leaves each link what its neighbours' turns have added after its own: at
    # most 2 w f h^2, f the pull, that is 2 w h^2 / alpha of the stretch.
    assert np.all(np.abs(stretch / expected - 1) < 2 * h**2 / compliance)
    assert np.allclose(sim.force(chain), G * below, rtol=1e-6)


def sag(links, substeps, device):
    """Lowest point of a hanging chain of span 1 and length 1.2."""
    k = np.arange(links + 1) / links
    drop = np.sqrt(0.6**2 - 0.5**2)
    x = np.stack([k - 0.5, -drop * (1 - np.abs(2 * k - 1)), 0 * k], axis=1)
    scene = hanging(x, mass=1 / links, pinned=(0, links), rate=8.0)
    pairs = np.stack([np.arange(links), np.arange(1, links + 1)], axis=1)
    scene.add_constraint(ps.Distance(pairs, 1.2 / links))
    sim = simulate(scene, device, dt=0.02, substeps=substeps)
    sim.run(200)
    return -sim.position[:, 1].min()


def test_catenary(device):
    """Sag of a rigid chain of 20 links: 0.292721 (0.292344 of the smooth curve)."""
    coarse, fine = sag(20, 40, device), sag(20, 80, device)
    # At rest a link is longer by what the other sweeps add, of the order of links^2 g h^2 = 2.5e-4
    # here: of second order in h, so that two runs tell the limit.
    assert fine == pytest.approx(0.292721, abs=2.5e-4)
    assert (4 * fine - coarse) / 3 == pytest.approx(0.292721, abs=5e-6)


def test_string_frequency(device):
    """T 100, mu 0.01, L 1: 50 Hz, times (2N/pi) sin(pi/(2N)) for N segments."""
    segments, tension, density, h = 10, 100.0, 0.01, 1e-5
    length = 1 / segments
    k = np.arange(segments + 1)
    mode = np.sin(np.pi * k / segments)
    scene = ps.Scene()
    x = np.stack([k * length, 1e-4 * mode, 0 * k], axis=1)
    pinned = (k == 0) | (k == segments)
    scene.add_particles(x, mass=density * length, pinned=pinned)
    pairs = np.stack([k[:-1], k[1:]], axis=1)
    half = 0.5 * length  # unstretched, so that the tension hardly changes
    scene.add_constraint(ps.Distance(pairs, half, compliance=half / tension))
    sim = simulate(scene, device, dt=10 * h, substeps=10)
    before = after = float(sim.position[:, 1] @ mode)
    while after > 0:
        sim.step()
        before, after = after, float(sim.position[:, 1] @ mode)
    quarter = sim.time - sim.settings.dt * after / (after - before)
    expected = 50 * 2 * segments / np.pi * np.sin(np.pi / (2 * segments))
    # First order in h, and the stretch of the amplitude: (pi 1e-4)^2.
    assert 1 / (4 * quarter) == pytest.approx(expected, rel=h * 2 * np.pi * 50)


# Friction and restitution -------------------------------------------------------------------


def on_slope(slope, friction, device, speed=0.0, frames=60, substeps=20, **knobs):
    """Way down a slope, and velocity, of a grain that starts on it with a speed downhill."""
    angle = np.arctan(slope)
    normal = np.array([np.sin(angle), np.cos(angle), 0.0])
    down = np.array([np.cos(angle), -np.sin(angle), 0.0])
    scene = ps.Scene()
    scene.add_particles([0.1 * normal], velocity=speed * down, radius=0.1)
    scene.add_interaction(ps.UniformGravity(GRAVITY))
    scene.add_constraint(ps.PlaneBoundary((0, 0, 0), normal, friction=friction))
    sim = simulate(scene, device, dt=1 / 60, substeps=substeps, **knobs)
    sim.run(frames)
    return float(sim.position[0] @ down), float(sim.velocity[0] @ down)


@pytest.mark.parametrize("friction", [0.3, 0.5, 1.0])
def test_block_slides_if_the_slope_is_above_mu(friction, device):
    """It holds at tan(theta) = 0.99 mu, and at 1.01 mu goes s = g t^2 (sin - mu cos) / 2."""
    still, _ = on_slope(0.99 * friction, friction, device)
    assert abs(still) < 1e-15  # what rounding leaves
    slope = 1.01 * friction
    way, speed = on_slope(slope, friction, device)
    a = G * (slope - friction) / np.hypot(1, slope)
    # Symplectic Euler goes v h further each second: 1 + h relative, h = 1/1200.
    assert way == pytest.approx(0.5 * a, rel=2e-3)
    assert speed == pytest.approx(a, rel=1e-9)


@pytest.mark.parametrize("iterations", [1, 5])
def test_block_stops(iterations, device, precision):
    """A sliding block stops after v^2 / (2 mu g), within 1 %."""
    friction, speed = 0.4, 2.0
    knobs = {"precision": precision, "iterations": iterations}
    way, after = on_slope(0.0, friction, device, speed=speed, **knobs)
    assert abs(after) < 1e-6
    # Symplectic Euler stops mu g h / v sooner: 0.16 %.
    assert way == pytest.approx(speed**2 / (2 * friction * G), rel=2 * friction * G / 1200 / speed)


@pytest.mark.parametrize("onto", ["plane", "box", "bowl", "hill", "grain"])
@pytest.mark.parametrize("e", [0.5, 0.8, 1.0])
def test_drop_returns_to_e_squared(e, onto, device):
    """From 1 m back to e^2 m, within 1 %."""
    radius, h = 0.1, 1 / 4800
    scene = ps.Scene()
    if onto == "grain":
        scene.add_particles([(0, -100, 0)], radius=100.0, pinned=True)
    ball = scene.add_particles([(0, 1 + radius, 0)], radius=radius)
    scene.add_interaction(ps.UniformGravity(GRAVITY))
    scene.add_constraint(
        {
            "plane": ps.PlaneBoundary((0, 0, 0), (0, 1, 0), restitution=e),
            "box": ps.BoxBoundary((-1, 0, -1), (1, np.inf, 1), restitution=e),
            "bowl": ps.SphereBoundary((0, 2, 0), 2.0, restitution=e),
            "hill": ps.SphereBoundary((0, -2, 0), 2.0, inside=False, restitution=e),
            "grain": ps.Contact(restitution=e),
        }[onto]
    )
    sim = simulate(scene, device, dt=20 * h, substeps=20)
    fall = np.sqrt(2 / G)
    sim.run(round((fall * (1 + e)) / sim.settings.dt))  # to the top of the rebound
    # The speed counts that the substep of the hit began with: up to g h too low; and the start of
    # the fall is g h t / 2 low. Together under 2 g h / v of the height, 0.1 %.
    height = sim.position[ball[0], 1] - radius
    assert height == pytest.approx(e**2, rel=0.01)
    assert height == pytest.approx(e**2, rel=4 * G * h / np.sqrt(2 * G) * (1 + 1 / e))
