"""The ledger: works and impulses by closed forms, balances that close, and what it leaves alone."""

import itertools

import numpy as np
import pytest
import warp as wp

import particlesim as ps
from particlesim.cli import main
from particlesim.commands.scene_files import load_scene, ready_scenes

G = 10.0
SMALL = {
    "dam_break": {"spacing": 0.05},
    "star_collision": {"count": 150},
    "freezing": {"cells": 5},
    "gas_in_a_box": {"count": 400},
    "pile": {"count": 100},
}
# Round-off: a contribution is rounded to eps of the forces, and these are added up substep after
# substep; in parts of the works (or impulses) of all parts without their signs.
EPS = {"float32": 2e-6, "float64": 1e-13}


def stepped(scene, device, frames, **knobs):
    sim = ps.Simulation(scene, ps.Settings(ledger=True, **knobs), device=device)
    for _ in range(frames):
        sim.step()
    return sim


def stone(mass=3.0, height=2.0, velocity=(1, 0, 0), **options):
    scene = ps.Scene()
    scene.add_particles([(0, height, 0)], mass=mass, velocity=velocity, **options)
    return scene


def assert_closed(sim, scale=1.0):
    """What no part accounts for is round-off of what all of them have moved to and fro."""
    ledger, eps = sim.ledger(), EPS[sim.settings.precision]
    kinetic = np.abs(ledger.kinetic_change) + sum(np.abs(each.work) for each in ledger)
    assert (np.abs(ledger.unaccounted) <= scale * eps * kinetic + 1e-300).all()
    moved = np.abs(ledger.momentum_change).max(axis=1)
    moved = moved + sum(np.abs(each.impulse).max(axis=1) for each in ledger)
    mass, v = sim.model.column("mass"), np.abs(sim.velocity).max(axis=1)
    there = np.bincount(sim.model.world_of, mass * v, sim.world_count)  # each is rounded by itself
    left = np.abs(ledger.unaccounted_momentum).max(axis=1)
    assert (left <= scale * eps * (moved + there) + 1e-300).all()


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
    """XPBD takes energy out of a swing in proportion to the substep: order 1."""
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
        assert np.log2(coarse / fine) == pytest.approx(1.0, abs=0.1)


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


@pytest.mark.parametrize("name", list(ready_scenes()))
def test_every_ready_scene_closes(name, device):
    module = load_scene(name)
    scene = module.build(**SMALL.get(name, {}))
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


@ps.law
def stirred(position: wp.vec3, velocity: wp.vec3, time: float):
    return wp.vec3(wp.sin(20.0 * time), 0.0, 0.0) - 0.3 * velocity


def busy(seed=0):
    """All kinds of parts, two of one kind, some fused without a ledger, and a pinned particle."""
    rng = np.random.default_rng(seed)
    scene = ps.Scene()
    x = ps.sample.lattice("sc", (4, 4, 4), 0.22, origin=(0, 0.3, 0))
    x = x + rng.uniform(-0.02, 0.02, x.shape)
    scene.add_particles(
        x, velocity=rng.normal(0, 1, x.shape), mass=rng.uniform(0.5, 2, len(x)), radius=0.1,
        pinned=np.arange(len(x)) == 7,
    )  # fmt: skip
    scene.add_interaction(ps.UniformGravity((0, -G, 0)))
    scene.add_interaction(ps.LennardJones(epsilon=0.1, sigma=0.2, cutoff=0.5))
    scene.add_interaction(ps.PairPotential(pull, cutoff=0.5, strength=0.5))
    scene.add_interaction(ps.ParticleForce(stirred))
    scene.add_constraint(ps.Distance([(0, 1), (1, 2), (7, 8)], compliance=1e-5))
    scene.add_constraint(ps.Distance([(20, 21)]))
    scene.add_constraint(ps.Contact(friction=0.3, restitution=0.4))
    scene.add_constraint(ps.BoxBoundary((-1, 0, -1), (2, 4, 2), friction=0.2, restitution=0.5))
    return scene


@ps.law
def pull(r: float, strength: float):
    return strength * r * r


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


def test_gravity_and_its_potential_agree(device):
    """Bodies that pull at each other: the work is what the potential energy has lost."""
    module = load_scene("three_body")
    sim = stepped(module.build(), device, 0, **knobs_of(module.settings))
    before = sim.diagnostics().potential
    for _ in range(20):
        sim.step()
    lost = before - sim.diagnostics().potential
    # But for the integrator's own error of the energy on the way, (omega dt)^2 of it: 8000 steps
    # in a period of 6.3 with encounters ten times as quick, (2 pi 10 / 8000)^2 / 24 = 3e-6.
    assert sim.ledger()["Gravity"].work == pytest.approx(lost, abs=3e-6)


def knobs_of(settings):
    return {name: getattr(settings, name) for name in ("dt", "substeps", "integrator", "precision")}


# What it leaves alone, and what it outlives -------------------------------------------------------


def test_it_is_there_only_when_asked_for(liquid, device, refused):
    sim = ps.Simulation(liquid(4), device=device)
    assert "mass" not in sim.state and sim.accounts is None
    with refused("Simulation.ledger: settings.ledger must be True"):
        sim.ledger()
    kept = ps.Simulation(liquid(4), ps.Settings(ledger=True), device=device)
    told = kept.explain()
    assert "(ledger)" in told.arrays
    assert sum(who == "ledger" for who, _, _ in told.launches) == 5  # x, v; before, after; sum
    assert told.launches_per_substep == sim.explain().launches_per_substep + 5
    for each in (sim, kept):
        each.run(3)
    np.testing.assert_array_equal(sim.position, kept.position)  # it only looks


def test_rows_that_grow_are_not_counted_twice(device):
    rng = np.random.default_rng(3)
    x = rng.uniform(-4, 4, (400, 3))
    scene = ps.Scene()
    scene.add_particles(x, velocity=-2 * x)
    scene.add_interaction(ps.PairPotential(pull, cutoff=2.0, strength=-0.01))
    sim = stepped(scene, device, 20, dt=0.02, substeps=2)
    assert sim.neighbors.lists[0].generation > 2
    assert_closed(sim, 10.0)


@pytest.mark.parametrize("method", ["symplectic_euler", "velocity_verlet"])
def test_writing_and_reset(method, precision, device):
    def build(mass):
        scene = stone(mass)
        scene.add_interaction(ps.UniformGravity((0, -G, 0)))
        scene.add_interaction(ps.ParticleForce(stirred))
        return scene

    knobs = {"dt": 0.1, "integrator": method, "precision": precision}
    sim = stepped([build(1.0), build(2.0)], device, 3, **knobs)
    before = sim.ledger()
    sim.world(0).velocity = (100, 0, 0)  # nobody's work
    sim.world(1).position = (0, 50, 0)
    after = sim.ledger()
    # Kinetic energies of 5000 J are in and out of it, in float64.
    np.testing.assert_allclose(after.unaccounted, before.unaccounted, atol=5000 * 1e-15)
    sim.step()
    assert_closed(sim, 1000.0)  # of a world that is a thousand times as fast as its work says
    sim.reset([1])
    ledger = sim.ledger()
    assert [each.work[1] for each in ledger] == [0.0, 0.0] and ledger.kinetic_change[1] == 0.0
    kept = [each.work[0] for each in ledger]
    sim.step()
    assert all(each.work[0] != old for each, old in zip(sim.ledger(), kept, strict=True))
    alone = stepped(build(2.0), device, 1, **knobs)
    for ours, theirs in zip(sim.ledger(), alone.ledger(), strict=True):
        assert ours.work[1] == theirs.work[0]


@pytest.mark.parametrize("on_failure", ["retry", "freeze"])
def test_what_went_wrong_is_not_on_the_books(on_failure, device):
    def build(omega):
        scene = stone(1.0, 1.0, (0, 0, 0))
        scene.add_particles([(0, 0, 0)], pinned=True)
        scene.add_interaction(ps.Springs([(0, 1)], omega**2, rest_length=0.0))
        scene.add_interaction(ps.Drag(1e-3))
        return scene

    settings = ps.Settings(dt=2.0, substeps=4, precision="float64", on_failure=on_failure,
                           ledger=True)  # fmt: skip
    sim = ps.Simulation([build(1.0), build(8.0)], settings, device=device)
    with pytest.warns(ps.SimulationWarning):
        sim.step()
    ledger = sim.ledger()
    assert_closed(sim, 10.0)
    if on_failure == "freeze":
        assert [each.work[1] for each in ledger] == [0.0, 0.0]
    else:
        assert ledger["Springs"].work[1] == pytest.approx(ledger.kinetic_change[1], rel=0.1)
    twin = ps.Simulation(build(1.0), settings, device=device)
    twin.step()
    assert twin.ledger()["Springs"].work[0] == ledger["Springs"].work[0]


@pytest.mark.parametrize("method", ["symplectic_euler", "velocity_verlet"])
def test_a_checkpoint_carries_the_books(method, device, tmp_path, refused):
    def build():
        scene = stone()
        scene.add_interaction(ps.UniformGravity((0, -G, 0)))
        scene.add_interaction(ps.ParticleForce(stirred))
        return scene

    sim = stepped(build(), device, 3, dt=0.1, integrator=method)
    sim.save(tmp_path / "run.npz")
    loaded = ps.Simulation.load(tmp_path / "run.npz", build(), device=device)
    for _ in range(2):
        sim.step()
        loaded.step()
    ours, theirs = sim.ledger(), loaded.ledger()
    for a, b in zip(ours, theirs, strict=True):
        assert a.work[0] == b.work[0] and (a.angular_impulse == b.angular_impulse).all()
    np.testing.assert_array_equal(ours.kinetic_change, theirs.kinetic_change)
    with refused("settings.ledger must be True as in 'run.npz', got False"):
        ps.Simulation.load(tmp_path / "run.npz", build(), ps.Settings(dt=0.1, integrator=method))


def test_the_table_reads(device, capfd, refused):
    sim = stepped([busy(0), busy(1)], device, 1, dt=0.02)
    text = str(sim.ledger())
    for part in ("since the start, 2 worlds", "work [J]", "impulse [N s]", "Distance 2",
                 "kinetic energy, momentum", "unaccounted"):  # fmt: skip
        assert part in text, part
    assert len(text.splitlines()) == 8 + 4
    with refused("Ledger: name must be one of UniformGravity, .*did you mean 'Contact'"):
        sim.ledger()["Contacts"]
    assert main(["run", "pendulum", "--frames", "1", "--device", "cpu", "--ledger"]) == 0
    assert "unaccounted" in capfd.readouterr().out


def test_nothing_at_all(device):
    for scene in (ps.Scene(), stone()):
        sim = stepped(scene, device, 2)
        assert list(sim.ledger()) == []
        assert (sim.ledger().unaccounted == 0).all() and "unaccounted" in str(sim.ledger())
