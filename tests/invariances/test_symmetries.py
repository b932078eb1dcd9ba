"""Nothing depends on the order of particles, of pairs or of parts, on who looks, or on pauses."""

import itertools

import numpy as np
import pytest

import particlesim as ps
from cases.parts import COUNT, KIN, PLAIN, TUPLES, along_pairs, kinds, particles, scene
from particlesim.scene.part import Interaction

EPS = float(np.finfo(np.float64).eps)
ROUNDING = 1e4 * EPS  # as in test_frames.py
SETTINGS = ps.Settings(dt=0.02, substeps=2, precision="float64", iterations=2)
ORDER = np.random.default_rng(7).permutation(COUNT)
FORCES = [name for name in kinds() if issubclass(kinds()[name], Interaction)]
HOLDING = [name for name in kinds() if name not in FORCES]
# Their kin goes together with all others for those of the same machinery, too.
APART = [name for name in FORCES if name not in KIN]
# What knows a place, a direction or a medium of its own takes up momentum.
EXTERNAL = {"ConstantForce", "Drag", "ParticleForce", "UniformGravity"} | {
    name for name in kinds() if name.endswith("Boundary")
}


def run(described, frames=8, settings=SETTINGS, each_frame=lambda sim: None):
    sim = ps.Simulation(described, settings, device="cpu")
    for _ in range(frames):
        sim.step()
        each_frame(sim)
    return sim


def assert_alike(x, y, rounding=ROUNDING):
    assert np.abs(x - y).max() <= rounding


@pytest.mark.parametrize("name", kinds())
def test_order_of_particles(name, monkeypatch):
    plain = run(scene([name]))
    place = np.argsort(ORDER)
    for argument, rows in TUPLES.items():
        monkeypatch.setitem(PLAIN, argument, place[np.array(rows)])
    other = run(scene([name], order=ORDER))
    assert_alike(other.get("position"), plain.get("position")[ORDER])
    assert_alike(other.get("velocity"), plain.get("velocity")[ORDER], ROUNDING / 0.01)


@pytest.mark.parametrize("name", kinds())
def test_order_within_pairs(name, monkeypatch):
    """i and j exchanged: the same pairs, or longer tuples, named from their other end."""
    plain = run(scene([name]))
    for argument, rows in TUPLES.items():
        other = [1, 0, 3, 2] if argument == "hinges" else slice(None, None, -1)
        monkeypatch.setitem(PLAIN, argument, np.array(rows)[:, other])
    assert_alike(run(scene([name])).get("position"), plain.get("position"))


@pytest.mark.parametrize("pair", itertools.combinations(APART, 2), ids="-".join)
def test_order_of_forces(pair):
    """Forces are added up: their order is a matter of rounding."""
    first, second = (run(scene(names), frames=3) for names in (pair, pair[::-1]))
    assert_alike(first.get("position"), second.get("position"))


@pytest.mark.parametrize("name", kinds())
def test_momentum_and_angular_momentum(name):
    """What acts between particles changes neither, to round-off of a sum of COUNT terms."""
    if name in EXTERNAL:
        pytest.skip("it takes up momentum")
    described = scene([name], changed=along_pairs)
    before = ps.Simulation(described, SETTINGS, device="cpu").diagnostics()
    after = run(described).diagnostics()
    assert np.abs(after.momentum - before.momentum).max() < ROUNDING
    if name in FORCES and name != "HertzianGrains":  # which rub, and do not turn
        assert np.abs(after.angular_momentum - before.angular_momentum).max() < ROUNDING


def test_momentum_of_a_fluid_of_all_viscosities():
    described = scene(["SPH"])
    before = ps.Simulation(described, SETTINGS, device="cpu").diagnostics()
    assert np.abs(run(described).diagnostics().momentum - before.momentum).max() < ROUNDING


@pytest.mark.parametrize("name", FORCES)
def test_twice_is_twice_as_strong(name):
    once = ps.Simulation(scene([name]), SETTINGS, device="cpu")
    twice = ps.Simulation(scene([name, name]), SETTINGS, device="cpu")
    for sim in (once, twice):
        sim.forces(0.01)
    f = once.get("force")
    assert np.abs(f).max() > 0
    assert_alike(twice.get("force"), 2 * f, ROUNDING * max(1.0, np.abs(f).max()))


@pytest.mark.parametrize("name", kinds())
def test_two_halves_are_the_whole(name, tmp_path):
    """Stopped, saved and loaded in the middle: the same bits."""
    described = scene([name])
    whole = run(described)
    half = run(described, frames=4)
    half.save(tmp_path / "half.npz")
    loaded = ps.Simulation.load(tmp_path / "half.npz", described, device="cpu")
    for _ in range(4):
        loaded.step()
    np.testing.assert_array_equal(loaded.get("position"), whole.get("position"))
    np.testing.assert_array_equal(loaded.get("velocity"), whole.get("velocity"))


@pytest.mark.parametrize("name", kinds())
def test_a_world_of_a_batch(name):
    """Beside other worlds: the same bits."""
    alone = run(scene([name]))
    batch = run([scene([name]) for _ in range(3)])
    for w in range(3):
        np.testing.assert_array_equal(batch.world(w).get("position"), alone.get("position"))


@pytest.mark.parametrize("name", kinds())
def test_looking_changes_nothing(name, tmp_path):
    """Everything that only reads, after every frame: the same bits, and the same state."""
    plain = run(scene([name]))

    def look(sim):
        before = {each: array.numpy().copy() for each, array in sim.state.arrays.items()}
        sim.diagnostics()
        sim.stability()
        str(sim.explain())
        sim.save(tmp_path / "look.npz", overwrite=True)
        assert before.keys() == sim.state.arrays.keys()
        for each, array in sim.state.arrays.items():
            np.testing.assert_array_equal(array.numpy(), before[each], err_msg=each)

    watched = run(scene([name]), each_frame=look)
    np.testing.assert_array_equal(watched.get("position"), plain.get("position"))
    np.testing.assert_array_equal(watched.get("velocity"), plain.get("velocity"))


DAMPED = ("DFSPH", "Drag", "ElasticSolid", "SPH", "Springs", "ConstraintForce", "HertzianGrains")
REVERSIBLE = [name for name in FORCES if name not in DAMPED]


@pytest.mark.parametrize("name", REVERSIBLE)
def test_back_in_time(name):
    """Velocity Verlet retraces its steps when velocities are turned round, to round-off."""
    settings = SETTINGS.replace(integrator="velocity_verlet")
    sim = run(scene([name]), settings=settings)
    sim.velocity = -sim.velocity
    for _ in range(8):
        sim.step()
    x, v, _, _ = particles()
    assert_alike(sim.get("position"), x, 10 * ROUNDING)
    assert_alike(sim.get("velocity"), -v, 10 * ROUNDING)


# Contacts and boundaries keep no multiplier: what they have pushed away too far stays there, so
# their place in the order is felt.
BILATERAL = [name for name in HOLDING if name not in EXTERNAL | {"Contact"}]


@pytest.mark.parametrize("pair", itertools.combinations(BILATERAL, 2), ids="-".join)
def test_order_of_constraints(pair):
    """With many sweeps both orders come to one answer, up to what is left of the residual."""
    settings = SETTINGS.replace(iterations=200)
    first, second = (
        run(scene(names), frames=1, settings=settings).get("position")
        for names in (pair, pair[::-1])
    )
    assert np.abs(first - second).max() < 0.02 * np.abs(first - particles()[0]).max()


LATE = {("SPH", "BoxBoundary"), ("SPH", "Boundary"), ("SPH", "PlaneBoundary")}  # as others


@pytest.mark.parametrize(
    "pair",
    [
        pytest.param(each, marks=[pytest.mark.slow] * (each in LATE), id="-".join(each))
        for each in itertools.product(APART, HOLDING)
    ],
)
def test_forces_and_constraints_have_lists_of_their_own(pair):
    """It does not matter which of a force and a constraint was added first: the same bits."""
    first, second = (run(scene(names), frames=2) for names in (pair, pair[::-1]))
    np.testing.assert_array_equal(first.get("position"), second.get("position"))
