"""The ledger: what it leaves alone, and what becomes of the books."""

import numpy as np
import pytest

import particlesim as ps
from cases.ledger import G, assert_closed, busy, pull, stepped, stirred, stone
from particlesim.cli import main
from particlesim.commands.scene_files import load_scene


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
