"""Thermostats in a scene: the same bits in any way, accounts that close, and what is refused."""

import re

import numpy as np
import pytest

import particlesim as ps
from cases.closed_forms import trap
from cases.worlds import equal_alone, goes_on_after_reset_and_save

RAMP = ((0.0, 0.4, 1.0), (0.5, 2.0, 1.0))


def scene(seed=0, count=40, temperature=RAMP):
    """Atoms in a trap, in a bath that warms; a chain in another; and one that is held."""
    rng = np.random.default_rng(seed)
    built = ps.Scene()
    x, v = rng.normal(size=(2, count, 3))
    atoms = built.add_particles(x, velocity=v, mass=2.0)
    chain = built.add_particles([(k, 0, 0) for k in range(9)], velocity=(1.0, 0.0, 0.0))
    held = built.add_particles([(0, 0, 0)], velocity=(0.5, 0, 0), pinned=True)
    built.add_interaction(ps.ParticleForce(potential=trap, stiffness=4.0))
    built.add_interaction(ps.Springs([(chain[k], chain[k + 1]) for k in range(8)], 20.0, 0.0))
    warm = ps.Langevin([atoms, held], temperature=temperature, friction=0.8, seed=seed)
    built.add_thermostat(warm)
    built.add_thermostat(
        ps.VelocityRescaling(chain, temperature=0.4, relaxation_time=0.3, seed=seed)
    )
    return built


def simulate(scenes, device="cpu", **knobs):
    chosen = {"dt": 0.1, "substeps": 4, "integrator": "velocity_verlet", **knobs}
    return ps.Simulation(scenes, ps.Settings(**chosen), device=device)


@pytest.fixture(scope="module")
def scenes():
    # Worlds of several sizes, seeds and temperatures.
    return [scene(1), scene(2, count=17, temperature=1.5), scene(3, count=300)]


def test_the_same_bits_in_a_batch_or_alone(scenes):
    equal_alone(simulate, scenes, "cpu", 5)


@pytest.mark.parametrize("integrator", ["symplectic_euler", "velocity_verlet"])
def test_the_same_bits_by_graph_and_by_threads(scenes, integrator):
    ends = []
    ways = [{"execution": "graph"}, *({"execution": "threads", "threads": n} for n in (1, 2))]
    for way in ways:
        sim = simulate([*scenes, scene(4, count=3000)], integrator=integrator, **way)
        sim.run(3)
        ends.append((sim.position, sim.velocity))
    for other in ends[1:]:
        np.testing.assert_array_equal(other, ends[0])


def test_the_same_bits_after_a_reset_and_a_restart(scenes, tmp_path):
    goes_on_after_reset_and_save(simulate, scenes, "cpu", tmp_path / "a.npz")


def test_another_seed_is_another_path():
    a, b, c = (simulate(scene(1)) for _ in range(3))
    a.run(1), b.run(1)
    np.testing.assert_array_equal(a.position, b.position)
    c.scenes[0].thermostats[0].seed = 9
    other = simulate(c.scenes[0])
    other.run(1)
    assert not np.array_equal(a.position[:40], other.position[:40])


@pytest.mark.parametrize("integrator", ["symplectic_euler", "velocity_verlet"])
def test_accounts_close(scenes, integrator):
    sim = simulate(scenes, integrator=integrator, ledger=True)
    sim.run(5)
    ledger = sim.ledger()
    assert [each.kind for each in ledger] == ["interaction"] * 2 + ["thermostat"] * 2
    assert abs(ledger["Langevin"].work.sum()) > 1.0
    # Every velocity is rounded in each of 20 substeps, at random: by eps / 2 of itself, some 2.
    rounding = np.sqrt(20 * 3 * 310) * np.finfo(np.float32).eps
    assert np.abs(ledger.unaccounted).max() < 4 * 2.0 * rounding * 2.0
    assert np.abs(ledger.unaccounted_momentum).max() < 4 * 2.0 * rounding
    # The held one is in the group, and left alone.
    for w in range(3):
        np.testing.assert_array_equal(sim.world(w).velocity[-1], (0.5, 0, 0))


def test_the_angular_momentum_is_accounted_for():
    built = ps.Scene()
    x = np.random.default_rng(0).normal(size=(30, 3))
    built.add_particles(x, velocity=x[::-1])
    built.add_thermostat(ps.Langevin(temperature=1.0, friction=2.0))
    sim = simulate(built, ledger=True)
    sim.run(3)
    ledger = sim.ledger()
    total = sum(each.angular_impulse for each in ledger)
    # As above, with arms of some 2.
    rounding = 4 * 2.0 * np.sqrt(12 * 3 * 30) * np.finfo(np.float32).eps
    np.testing.assert_allclose(total, ledger.angular_momentum_change, atol=rounding)


def test_heat_is_no_fault(recwarn):
    # From rest at a point to a temperature of 1: neither a runaway nor a drift of the energy.
    built = ps.Scene()
    atom = built.add_particles([(0, 0, 0)])
    built.add_interaction(ps.Springs([(0, 1)], 1.0, 0.0))
    built.add_particles([(0, 0, 0)], pinned=True)
    built.add_thermostat(ps.Langevin(atom, temperature=1.0, friction=1.0))
    sim = simulate(built, dt=0.05)
    sim.run(200)
    assert sim.diagnostics().energy[0] > 0 and not sim.incidents
    assert not [each for each in recwarn if issubclass(each.category, UserWarning)]


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("way", ["freeze", "retry"])
def test_what_the_watchdog_does_to_one_world_leaves_the_other_alone(way):
    def trapped(stiffness, seed):
        built = ps.Scene()
        atoms = built.add_particles([(0.1, 0, 0), (0, 0.1, 0)])
        built.add_interaction(ps.ParticleForce(potential=trap, stiffness=stiffness))
        built.add_thermostat(ps.Langevin(atoms, temperature=1.0, friction=1.0, seed=seed))
        return built

    # omega dt = 2.8 in the second world: past the limit, and within it by twice the substeps.
    scenes = [trapped(1.0, 1), trapped(2.8**2 / 0.025**2, 2)]
    sim = simulate(scenes, on_failure=way)
    sim.run(12)
    assert sim.incidents and {each.world for each in sim.incidents} == {1}
    assert np.isfinite(sim.world(1).velocity).all()
    alone = simulate(scenes[0])
    alone.run(12)
    np.testing.assert_array_equal(sim.world(0).velocity, alone.velocity)


class Still(ps.Thermostat):
    """One's own, in NumPy: everything is stopped."""

    host = True

    def prepare(self, model, neighbors):
        self.model = model

    def exchange(self, state, dt):
        state.velocity.assign(0.0 * state.velocity.numpy())


class Deaf(ps.Integrator):
    """One's own that moves nothing."""

    def advance(self, dt):
        self.kick(dt)


def test_ones_own():
    built = ps.Scene()
    built.add_particles([(0, 0, 0)], velocity=(1, 0, 0))
    built.add_thermostat(Still())
    sim = simulate(built, substeps=2)
    sim.run(2)
    # Half of the first substep's drift: 0.025 of time.
    np.testing.assert_allclose(sim.position, [(0.025, 0, 0)], rtol=1e-6)
    assert "Still acts on the host" in sim.explain().execution


def test_refused(refused):
    with refused("Langevin: temperature must be at least 0"):
        ps.Langevin(temperature=-1.0, friction=1.0)
    with refused("Langevin: temperature times must rise"):
        ps.Langevin(temperature=((1, 0), (1, 2)), friction=1.0)
    with refused("Langevin: temperature must be a number or"):
        ps.Langevin(temperature=((1, 2), (1, 2, 3)), friction=1.0)
    with refused("Langevin: friction must be at least 0"):
        ps.Langevin(temperature=1.0, friction=-1.0)
    with refused("Langevin: seed must be a whole number"):
        ps.Langevin(temperature=1.0, friction=1.0, seed=0.5)
    with refused("VelocityRescaling: relaxation_time must be above 0"):
        ps.VelocityRescaling(temperature=1.0, relaxation_time=0.0)
    with refused("Langevin: temperature must"):
        simulate(scene(temperature=1e300))
    with refused("integrator must be velocity_verlet or symplectic_euler with Langevin"):
        simulate(scene(), integrator="yoshida4")
    with refused("thermostat must be new to the scene"):
        built = scene()
        built.add_thermostat(built.thermostats[0])
    with pytest.raises(TypeError, match="thermostat must be a Thermostat"):
        scene().add_thermostat(ps.Drag(1.0))
    plain = scene()
    plain.thermostats.clear()
    with refused(re.escape("scenes[1].thermostats must be of the kinds of scenes[0]")):
        simulate([scene(), plain])
    with refused("Deaf: advance must drift by"):
        simulate(scene(), integrator=Deaf).run(1)
