"""The ledger: works and impulses by closed forms, and balances that close."""

import itertools

import numpy as np
import pytest

import particlesim as ps
from cases.ledger import EPS, G, assert_closed, busy, stepped, stone
from cases.ready import small, swept

# Known works --------------------------------------------------------------------------------------


@pytest.mark.parametrize("method", ["symplectic_euler", "velocity_verlet"])
def test_gravity_does_the_work_of_the_fall(method, precision, device):
    scene = stone()
    scene.add_interaction(ps.UniformGravity((0, -G, 0)))
    sim = stepped(scene, device, 5, dt=0.1, substeps=4, integrator=method, precision=precision)
    fallen = 2.0 - float(sim.position[0, 1])
    entry = sim.ledger()["UniformGravity"]
    # m g h with velocity Verlet. Symplectic Euler moves with the velocity at a substep's end, not
    # with the mean: it falls further than the work by g dt^2 / 2 in each, and so g t dt / 2 in all.
    further = 0.5 * G * 0.5 * 0.025 if method == "symplectic_euler" else 0.0
    expected = 3.0 * G * (fallen - further)
    assert entry.work[0] == pytest.approx(expected, rel=EPS[precision] * 10)
    assert entry.impulse[0] == pytest.approx((0, -3 * G * 0.5, 0), rel=EPS[precision] * 10)
    # The torque x F over x = t: - m g t^2 / 2, but for x at the start of the substep.
    torque = -3.0 * G * 0.025**2 * sum(range(20))
    halves = -3.0 * G * 0.5**2 / 2
    expected = torque if method == "symplectic_euler" else halves
    assert entry.angular_impulse[0, 2] == pytest.approx(expected, rel=EPS[precision] * 100)
    assert entry.kind == "interaction"
    assert_closed(sim)


@pytest.mark.parametrize("method", ["symplectic_euler", "velocity_verlet"])
def test_drag_takes_what_is_lost(method, precision, device):
    scene = stone(velocity=(3, 0, 4))
    scene.add_interaction(ps.Drag(0.6))
    sim = stepped(scene, device, 5, dt=0.1, substeps=50, integrator=method, precision=precision)
    # v = v0 exp(-a t / m); Euler's v is smaller by a^2 t dt / (2 m^2) = 4e-5 of it, so twice that
    # in energy; half kicks with drag are of first order, too.
    left = np.exp(-2 * 0.6 * 0.5 / 3.0)
    (entry,) = sim.ledger()
    assert entry.work[0] == pytest.approx(0.5 * 3.0 * 25.0 * (left - 1), rel=1e-3)
    assert entry.work[0] == pytest.approx(
        sim.diagnostics().kinetic[0] - 0.5 * 3.0 * 25.0, rel=30 * EPS[precision]
    )
    assert_closed(sim, 10.0)


def test_a_spring_gives_and_takes(device):
    # From x = 1 to 0 in a quarter of a period it gives all of k x^2 / 2, and takes it until -1.
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0)], pinned=True)
    scene.add_particles([(1, 0, 0)], mass=2.0)
    scene.add_interaction(ps.Springs([(0, 1)], 8.0, rest_length=0.0))
    errors = []
    for substeps in (50, 100):
        sim = stepped(
            scene, device, 1, dt=np.pi / 4, substeps=substeps, integrator="velocity_verlet",
            precision="float64",
        )  # fmt: skip
        (entry,) = sim.ledger()
        errors.append(abs(entry.work[0] - 4.0))
        assert_closed(sim)
        sim.step()
        assert abs(sim.ledger()["Springs"].work[0]) < 1e-3
    # Leapfrog's energy is that of x^2 (1 - (omega dt)^2 / 4): off by (pi / 2 / 50)^2 / 4 at zero.
    assert errors[0] == pytest.approx(4.0 * (np.pi / 100) ** 2 / 4, rel=0.05)
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.05)


def test_a_rod_does_no_work_in_the_limit(device):
    """What a rod takes out of a swing goes with the square of the substep.

    It pulls along where it was, as SHAKE does: places are then those of Verlet's method, shifted by
    half a substep of gravity at the start, which is of first order in time but not in energy.
    """
    works = []
    for substeps in (50, 100, 200):
        scene = ps.Scene()
        scene.add_particles([(0, 0, 0)], pinned=True)
        scene.add_particles([(1, 0, 0)])
        scene.add_interaction(ps.UniformGravity((0, -G, 0)))
        scene.add_constraint(ps.Distance([(0, 1)]))
        sim = stepped(scene, device, 10, dt=0.05, substeps=substeps, precision="float64")
        ledger = sim.ledger()
        works.append(abs(ledger["Distance"].work[0]))
        # It is the pull that turns gravity's momentum: without work, not without impulse.
        assert abs(ledger["Distance"].impulse[0, 1]) > 1.0
        assert ledger["Distance"].kind == "constraint"
        assert_closed(sim)
    assert works[0] < 0.05 * abs(ledger["UniformGravity"].work[0])
    for coarse, fine in itertools.pairwise(works):
        assert np.log2(coarse / fine) == pytest.approx(2.0, abs=0.1)


def test_friction_takes_mu_m_g_d(precision, device):
    scene = stone(mass=2.0, height=0.1, velocity=(3, 0, 0), radius=0.1)
    scene.add_interaction(ps.UniformGravity((0, -G, 0)))
    scene.add_constraint(ps.PlaneBoundary((0, 0, 0), (0, 1, 0), friction=0.5))
    sim = stepped(scene, device, 4, dt=0.1, substeps=50, precision=precision)
    way = float(sim.position[0, 0])
    ledger = sim.ledger()
    # The way is walked with the velocity at the end of a substep, the work done at the mean: as
    # far again as half of what is lost of the velocity, times the substep.
    way += 0.5 * (3.0 - float(sim.velocity[0, 0])) * 0.002
    # In float32 the overlap of the resting block is a few bits of its height: 1e-8 / g dt^2.
    tolerance = 2e-3 if precision == "float32" else 1e-9
    assert ledger["PlaneBoundary"].work[0] == pytest.approx(-0.5 * 2 * G * way, rel=tolerance)
    # What rests does no work: neither its weight nor what holds it.
    assert abs(ledger["UniformGravity"].work[0]) < tolerance
    assert ledger["PlaneBoundary"].impulse[0, 1] == pytest.approx(2 * G * 0.4, rel=tolerance)
    for _ in range(4):  # v = 3 stops after 0.6 s; all is then gone
        sim.step()
    assert sim.ledger()["PlaneBoundary"].work[0] == pytest.approx(-9.0, rel=tolerance)
    assert_closed(sim, 10.0)


@pytest.mark.parametrize("restitution", [0.0, 0.6, 1.0])
def test_a_bounce_takes_its_share(restitution, device):
    # Without gravity it arrives with all of its speed and leaves with e of it.
    scene = stone(mass=2.0, velocity=(0.5, -3, 0), radius=0.1, height=0.5)
    scene.add_constraint(ps.PlaneBoundary((0, 0, 0), (0, 1, 0), restitution=restitution))
    sim = stepped(scene, device, 4, dt=0.1, precision="float64")
    entry = sim.ledger()["PlaneBoundary"]
    assert entry.work[0] == pytest.approx(-0.5 * 2 * 9 * (1 - restitution**2), abs=1e-12)
    assert entry.impulse[0] == pytest.approx((0, 2 * 3 * (1 + restitution), 0), abs=1e-12)
    left = sim.ledger().angular_momentum_change - entry.angular_impulse
    assert np.abs(left).max() < 1e-12
    assert_closed(sim)


# Balances -----------------------------------------------------------------------------------------


LATE = ["sod_tube", "dam_break"]  # the dearest


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(*k.values, marks=[*k.marks, *[pytest.mark.slow] * (k.values[0] in LATE)])
        for k in swept()
    ],
)
def test_every_ready_scene_closes(name, device):
    module, scene = small(name)
    settings = module.settings.replace(ledger=True, substeps=min(module.settings.substeps, 100))
    for other in ("float32", "float64"):
        sim = ps.Simulation(scene, settings.replace(precision=other), device=device)
        for _ in range(3):
            sim.step()
        assert_closed(sim, 10.0)
        if other == "float64" and not sim.model.periodic:
            ledger = sim.ledger()
            left = ledger.angular_momentum_change - sum(each.angular_impulse for each in ledger)
            moved = sum(np.abs(each.angular_impulse).max() for each in ledger)
            assert np.abs(left).max() <= 1e-11 * moved + 1e-15


def test_all_parts_together_close(precision, device):
    knobs = {"dt": 0.02, "substeps": 8, "iterations": 3, "precision": precision}
    sim = stepped([busy(0), busy(1)], device, 10, **knobs)
    ledger = sim.ledger()
    names = [each.name for each in ledger]
    assert names == [
        "UniformGravity", "LennardJones", "PairPotential", "ParticleForce", "Distance",
        "Distance 2", "Contact", "BoxBoundary",
    ]  # fmt: skip
    assert_closed(sim, 20.0)
    # Forces between particles give no momentum, but for what the pinned one takes; rods without it
    # give none, and Distance 2 is far from it.
    assert np.abs(ledger["Distance 2"].impulse).max() < 30 * EPS[precision]
    assert (ledger["Contact"].work < 0).all()
    # A world's account is that of the world alone.
    alone = stepped(busy(1), device, 10, **knobs).ledger()
    for ours, theirs in zip(ledger, alone, strict=True):
        assert ours.work[1] == theirs.work[0]
        np.testing.assert_array_equal(ours.impulse[1], theirs.impulse[0])
