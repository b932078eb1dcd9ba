"""Fields: waves and potentials on grids against closed forms, and what they exchange."""

import numpy as np
import pytest

import particlesim as ps
from cases.worlds import equal_alone, same

L, SPEED = 2.0, 1.5


def simulate(scenes, device="cpu", **knobs):
    return ps.Simulation(scenes, ps.Settings(**{"precision": "float64", **knobs}), device=device)


def pond(seed=0, **options):
    """Charges on a sheet of water; positions, strengths and waves of their own."""
    rng = np.random.default_rng(seed)
    options = {"speed": 1.0, "density": 2.0, "edges": "free", **options}
    water = ps.GridField(
        (0, 0, None), (3, 2, None), 0.1,
        start=lambda x: 0.02 * np.cos(np.pi * x[:, 0] / 3 + seed), **options,
    )  # fmt: skip
    scene = ps.Scene()
    x = rng.uniform(0.6, 1.4, (6, 3))
    scene.add_particles(x, velocity=rng.normal(0, 0.1, x.shape), charge=rng.uniform(0.1, 0.3, 6))
    scene.add_interaction(ps.FieldForce(water, coupling="charge"))
    return scene


@pytest.mark.parametrize("damping", [0.0, 2.0])
def test_a_wave_goes_round_a_periodic_box(damping, device):
    """By the differences that it is made of, to rounding; by the wave equation to second order.

    A mode of c K = c (2 / h) sin(k h / 2) is u_t' = (u_t - dt c^2 K^2 u) / (1 + gamma dt),
    u' = u + dt u_t'. Of cos(omega t) exp(-gamma t / 2) it differs by the half step that u is
    behind, omega dt / 2, and phases of (omega dt)^2 / 24 and (k h)^2 / 24 of omega t.
    """
    k, steps, dt = 2 * np.pi / L, 300, 0.002
    field = ps.GridField(
        (0, None, None), (L, None, None), L / 64, speed=SPEED, damping=damping,
        start=lambda x: np.cos(k * x[:, 0]),
    )  # fmt: skip
    scene = ps.Scene(periodic=((0, None, None), (L, None, None)))
    scene.add_particles([(0, 0, 0)], charge=0.0)
    part = scene.add_interaction(ps.FieldForce(field, coupling="charge"))
    sim = simulate(scene, device, dt=dt * steps, substeps=steps)
    sim.step()
    h = L / 64
    omega = SPEED * 2 / h * np.sin(k * h / 2)
    u, rate = 1.0, 0.0
    for _ in range(steps):
        rate = (rate - dt * omega**2 * u) / (1 + damping * dt)
        u += dt * rate
    found = sim.field(part)[:, 0, 0]
    np.testing.assert_allclose(found, u * np.cos(k * h * np.arange(64)), rtol=0, atol=1e-12)
    t, free = dt * steps, np.sqrt((k * SPEED) ** 2 - damping**2 / 4)
    exact = np.exp(-damping * t / 2) * (np.cos(free * t) + damping / (2 * free) * np.sin(free * t))
    allowed = omega * dt / 2 + omega * t * ((omega * dt) ** 2 + (k * h) ** 2) / 24
    assert abs(found[0] - exact) < allowed + damping * dt * omega * t / 2


def test_a_weight_hangs_in_a_string(device):
    """Held at both ends it comes to rest as u = -q x (L - x0) / (L rho c^2) up to the weight."""
    q, at, density = 0.3, 0.7, 2.0
    string = ps.GridField(
        (0, None, None), (L, None, None), 0.1, speed=SPEED, density=density, damping=6.0,
        edges="held",
    )  # fmt: skip
    scene = ps.Scene()
    scene.add_particles([(at, 0, 0)], charge=q, pinned=True)
    part = scene.add_interaction(ps.FieldForce(string, coupling="charge"))
    sim = simulate(scene, device, dt=30.0, substeps=3000)
    sim.step()
    x = np.linspace(0, L, 21)
    hanging = -q / (density * SPEED**2) * np.where(x < at, x * (L - at), at * (L - x)) / L
    # Transients fall as exp(-(3 - sqrt(9 - (pi c / L)^2)) t): exp(-30) here.
    np.testing.assert_allclose(sim.field(part)[:, 0, 0], hanging, rtol=0, atol=1e-12)


def test_what_particles_and_waves_exchange_is_kept():
    """The energy of both together, to first order in the step: halved with it."""
    off = []
    for substeps in (25, 50):
        sim = simulate(pond(), dt=0.05, substeps=substeps)
        energies = [sim.diagnostics().energy[0]]
        for _ in range(10):
            sim.step()
            energies.append(sim.diagnostics().energy[0])
        off.append(np.abs(np.array(energies) - energies[0]).max())
    assert 1.8 < off[0] / off[1] < 2.2


def test_sheets_attract_each_other(device):
    """In one dimension two of masses a and b, d apart, by 2 pi G a b (1 - 2 d / L).

    Differences of second order are exact there, where masses lie on nodes.
    """
    a, b, d, G = 2.0, 3.0, 0.25, 0.7
    field = ps.PoissonField((0, None, None), (1, None, None), 1 / 32, constant=G)
    scene = ps.Scene(periodic=((0, None, None), (1, None, None)))
    scene.add_particles([(0.25, 0, 0), (0.25 + d, 0, 0)], mass=[a, b])
    scene.add_interaction(ps.FieldForce(field))
    F = 2 * np.pi * G * a * b * (1 - 2 * d)
    # On a node it is the mean of the slopes to both sides, where what is its own cancels.
    beside = [
        simulate_at(scene.position + np.array([each, 0, 0]), scene, device)
        for each in (1e-9, -1e-9)
    ]
    np.testing.assert_allclose(np.mean(beside, axis=0)[:, 0], [F, -F], rtol=1e-6)


def simulate_at(x, scene, device):
    """Forces with the particles elsewhere."""
    sim = simulate(scene, device)
    sim.position = x
    return sim.get("force")


@pytest.mark.parametrize("threads", [1, 2])
def test_a_world_goes_as_it_goes_alone(threads, device):
    def run(scenes, device, **knobs):
        return simulate(scenes, device, dt=0.02, substeps=4, threads=threads, **knobs)

    equal_alone(run, [pond(0), pond(1, damping=0.5), pond(2, speed=1.3)], device, 5)


def test_a_run_goes_on_from_a_checkpoint(tmp_path, device):
    knobs = {"dt": 0.02, "substeps": 4}
    straight, saved = (simulate(pond(), device, **knobs) for _ in range(2))
    straight.run(9)
    saved.run(4)
    saved.save(tmp_path / "pond.npz")
    loaded = ps.Simulation.load(tmp_path / "pond.npz", pond(), device=device)
    loaded.run(5)
    same(loaded, straight)
    part = loaded.scenes[0].interactions[0]
    field = straight.field(straight.scenes[0].interactions[0])
    assert np.array_equal(loaded.field(part), field)
    straight.reset()
    straight.run(9)
    assert np.array_equal(straight.field(straight.scenes[0].interactions[0]), field)


def test_the_step_is_bounded_by_the_shortest_wave():
    """2 / omega, omega = 2 c sqrt(2) / h: of the fastest world."""
    report = simulate([pond(), pond(1, speed=2.0)]).stability()
    (limit,) = (each for each in report.limits if each.kind == "wave")
    assert limit.dt == pytest.approx(0.1 / (2.0 * np.sqrt(2.0)))
    assert limit.world == 1


BOX = ((0, 0, 0), (1, 1, 1))


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: ps.GridField((0, 0), (1, 1), 0.1, speed=1), "lower must be three numbers"),
        (lambda: ps.GridField((0, None, 0), BOX[1], 0.1, speed=1), "upper must be None where"),
        (lambda: ps.GridField(BOX[1], BOX[0], 0.1, speed=1), "upper must be above lower"),
        (lambda: ps.GridField(*BOX, 0.0, speed=1), "spacing must be above 0"),
        (lambda: ps.GridField(*BOX, 0.1, speed=0), "speed must be above 0"),
        (lambda: ps.GridField(*BOX, 0.1, speed=1, edges="soft"), "edges must be one of"),
        (lambda: ps.PoissonField(*BOX, 0.1), "be periodic along all its axes"),
        (
            lambda: ps.FieldForce(ps.GridField(*BOX, 0.1, speed=1), coupling="charm"),
            "coupling must be a number of the particles",
        ),
        (
            lambda: ps.GridField(*BOX, 0.1, speed=1, start=lambda x: np.zeros(3)),
            r"start must have shape .*1331",
        ),
    ],
)
def test_what_does_not_fit_is_refused(make, message):
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0)])
    with pytest.raises(ValueError, match=message):
        part = make()
        scene.add_interaction(part if isinstance(part, ps.FieldForce) else ps.FieldForce(part))
        simulate(scene)


def test_a_grid_is_that_of_the_box():
    scene = ps.Scene(periodic=BOX)
    scene.add_particles([(0, 0, 0)])
    scene.add_interaction(ps.FieldForce(ps.GridField((0, 0, 0), (1, 1, 2), 0.1, speed=1)))
    with pytest.raises(ValueError, match="field must have the corners of the box"):
        simulate(scene)
