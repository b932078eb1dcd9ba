"""Simulation: the loop, what can be read and written, and what is refused."""

import re

import numpy as np
import pytest
import warp as wp

import particlesim as ps
from particlesim.engine.execution import launch
from particlesim.engine.execution.launch import Program
from particlesim.scene.part import ConstraintBase


def drifting(count=3, **options):
    scene = ps.Scene()
    x = np.arange(3 * count).reshape(count, 3)
    scene.add_particles(x, velocity=(1, 0, 0), **options)
    return scene


# The loop ---------------------------------------------------------------------------------------


class Spy(ps.Interaction):
    """A force that does nothing but write down when it is asked."""

    requires = frozenset({"force"})

    def __init__(self, label, calls):
        self.label, self.calls = label, calls

    def prepare(self, model, neighbors):
        self.calls.append(f"{self.label} prepare")

    def attach(self, model, state):
        self.calls.append(f"{self.label} attach")

    def apply(self, state, neighbors, dt):
        self.calls.append(f"{self.label} apply {dt}")


class Holder(ConstraintBase):
    """A constraint that writes down when it is asked."""

    def __init__(self, label, calls):
        self.label, self.calls = label, calls

    def prepare(self, model, neighbors):
        self.calls.append(f"{self.label} prepare")

    def begin(self, state, neighbors, dt):
        self.calls.append(f"{self.label} begin {dt}")

    def project(self, state, neighbors, dt):
        self.calls.append(f"{self.label} project {dt}")

    def finish(self, state, neighbors, dt):
        self.calls.append(f"{self.label} finish {dt}")


@pytest.fixture
def order(monkeypatch):
    """The calls of a substep, with the integrator's launches among them."""
    calls = []
    original = launch.launch

    def spy(kernel, dim, inputs, device):
        calls.append(kernel.key.rpartition("__")[2])
        original(kernel, dim, inputs, device)

    monkeypatch.setattr("particlesim.engine.integrators.launch", spy)
    return calls


def test_a_substep_is_the_loop_of_the_design(order):
    scene = drifting()
    for label in "AB":
        scene.add_interaction(Spy(label, order))
        scene.add_constraint(Holder(label.lower(), order))
    sim = ps.Simulation(scene, ps.Settings(dt=0.5, substeps=2, iterations=2), device="cpu")
    order.clear()
    with launch.record(Program()):
        sim.substep(0.25)
    assert order == [
        "A apply 0.25", "B apply 0.25",
        "advance",
        "a begin 0.25", "b begin 0.25",
        "a project 0.25", "b project 0.25", "a project 0.25", "b project 0.25",
        "follow_corrections",
        "a finish 0.25", "b finish 0.25",
    ]  # fmt: skip


def test_without_constraints_nothing_follows(order):
    scene = drifting()
    scene.add_interaction(Spy("A", order))
    sim = ps.Simulation(scene, ps.Settings(dt=0.5), device="cpu")
    order.clear()
    with launch.record(Program()):
        sim.substep(0.25)
    assert order == ["A apply 0.25", "advance"]


def test_velocity_verlet_has_its_forces_between_the_kicks(order):
    scene = drifting()
    scene.add_interaction(Spy("A", order))
    settings = ps.Settings(dt=0.5, integrator="velocity_verlet")
    sim = ps.Simulation(scene, settings, device="cpu")
    order.clear()
    with launch.record(Program()):
        sim.substep(0.25)
    assert order == ["advance", "A apply 0.25", "kick_only"]


def test_forces_start_from_zero_in_every_substep(precision, device):
    scene = drifting()
    scene.add_interaction(ps.ConstantForce((0, 2, 0)))
    sim = ps.Simulation(scene, ps.Settings(dt=1.0, substeps=16, precision=precision), device=device)
    sim.step()
    np.testing.assert_array_equal(sim.velocity[:, 1], 2.0)
    np.testing.assert_array_equal(sim.get("force"), [(0, 2, 0)] * 3)


def test_a_scene_can_be_simulated_many_times(liquid, device):
    scene = liquid(cells=4)
    settings = ps.Settings(dt=0.01)
    first = ps.Simulation(scene, settings, device=device)
    first.run(3)
    second = ps.Simulation(scene, settings, device=device)
    second.run(3)
    np.testing.assert_array_equal(first.position, second.position)


@pytest.mark.parametrize("count", [0, 1, 2])
def test_hardly_any_particles(count, device):
    scene = drifting(count)
    sim = ps.Simulation(scene, ps.Settings(dt=0.5), device=device)
    sim.run(2)
    np.testing.assert_array_equal(sim.position, scene.position + np.array([1, 0, 0]))
    assert sim.time == 1.0
    assert sim.diagnostics().mass[0] == count


def test_no_groups_at_all(device):
    sim = ps.Simulation(ps.Scene(), device=device)
    sim.step()
    assert sim.position.shape == (0, 3)
    assert str(sim.explain())


def test_dt_zero_changes_nothing(liquid, device):
    sim = ps.Simulation(liquid(), ps.Settings(dt=0.0), device=device)
    before = sim.position
    sim.run(3)
    np.testing.assert_array_equal(sim.position, before)
    assert sim.time == 0.0


def test_one_substep(device):
    scene = drifting()
    sim = ps.Simulation(scene, ps.Settings(dt=0.5, substeps=1), device=device)
    sim.step()
    np.testing.assert_array_equal(sim.position[:, 0], scene.position[:, 0] + 0.5)


# Diagnostics ------------------------------------------------------------------------------------


def test_diagnostics_are_the_sums(precision, device):
    rng = np.random.default_rng(0)
    scene = ps.Scene()
    x, v, m = rng.normal(size=(700, 3)), rng.normal(size=(700, 3)), rng.uniform(1, 2, 700)
    x, v, m = (a.astype(np.float32).astype(float) for a in (x, v, m))
    scene.add_particles(x, velocity=v, mass=m)
    scene.add_particles([(5, 5, 5)], velocity=(1, 1, 1), mass=100, pinned=True)
    sim = ps.Simulation(scene, ps.Settings(precision=precision), device=device)
    found = sim.diagnostics()
    # Sums of 700 terms in float64.
    assert found.mass[0] == pytest.approx(m.sum() + 100, rel=1e-13)
    np.testing.assert_allclose(found.momentum[0], m @ v, atol=1e-12)
    np.testing.assert_allclose(found.angular_momentum[0], m @ np.cross(x, v), atol=1e-12)
    assert found.kinetic[0] == pytest.approx(0.5 * m @ (v**2).sum(axis=1), rel=1e-13)
    assert found.potential[0] == 0
    assert found.energy[0] == found.kinetic[0]


def test_looking_does_not_disturb(liquid, device):
    # Diagnostics bring lists up to date themselves, and may find a row full; the run must go on
    # as if nobody had looked.
    def run(look):
        rng = np.random.default_rng(5)
        x = rng.uniform(-9, 9, (700, 3))
        scene = ps.Scene()
        scene.add_particles(x, velocity=-x)
        scene.add_interaction(ps.PairPotential(spread, cutoff=2.0, reach=2.0))
        sim = ps.Simulation(scene, ps.Settings(dt=0.02, substeps=2), device=device)
        start = sim.neighbors.lists[0].capacity
        for _ in range(30):
            if look:
                sim.diagnostics()
            sim.step()
        assert sim.neighbors.lists[0].capacity > start
        return sim.position

    np.testing.assert_array_equal(run(True), run(False))


@ps.law
def spread(r: float, reach: float):
    return 0.01 * (r - reach) * (r - reach)


# Reading and writing ----------------------------------------------------------------------------


def test_what_is_read_is_a_copy(device):
    sim = ps.Simulation(drifting(), device=device)
    x = sim.position
    x[:] = 0
    assert sim.position[-1, 2] == 8


def test_writing(precision, device):
    sim = ps.Simulation(drifting(), ps.Settings(dt=1.0, precision=precision), device=device)
    sim.step()
    sim.position = np.ones((3, 3))
    sim.velocity = (0, 2, 0)
    sim.step()
    np.testing.assert_allclose(sim.position, [(1, 3, 1)] * 3, rtol=1e-6)
    for wrong in (np.ones((2, 3)), np.nan, "there"):
        with pytest.raises(ValueError, match=r"Simulation\.set: position"):
            sim.position = wrong
    np.testing.assert_allclose(sim.position, [(1, 3, 1)] * 3, rtol=1e-6)


def test_a_new_mass_is_felt(device):
    scene = drifting()
    scene.add_particles([(9, 9, 9)], pinned=True)
    scene.add_interaction(ps.ConstantForce((0, 6, 0)))
    scene.add_interaction(ps.UniformGravity((0, 0, 1)))
    sim = ps.Simulation(scene, ps.Settings(dt=1.0, substeps=1), device=device)
    sim.set("mass", [1, 2, 3, 4])
    sim.step()
    np.testing.assert_allclose(sim.velocity[:, 1], [6, 3, 2, 0], rtol=1e-6)
    with pytest.raises(ValueError, match=r"Simulation\.set: mass must be above 0"):
        sim.set("mass", [1, 0, 1, 1])
    np.testing.assert_array_equal(sim.get("mass"), [1, 2, 3, 4])


@pytest.mark.parametrize("method", ["symplectic_euler", "velocity_verlet"])
def test_after_writing_forces_and_neighbours_are_those_of_the_new_place(method, device):
    def build(x):
        scene = ps.Scene()
        scene.add_particles(x)
        scene.add_interaction(ps.LennardJones(cutoff=2.5))
        settings = ps.Settings(dt=0.01, substeps=2, precision="float64", integrator=method)
        return ps.Simulation(scene, settings, device=device)

    rng = np.random.default_rng(0)
    x = ps.sample.lattice("sc", (4, 4, 4), 1.1) + rng.uniform(-0.05, 0.05, (64, 3))
    fresh = build(x)
    moved = build(x[::-1] + 50.0)
    moved.step()
    moved.position, moved.velocity = x, 0.0
    for sim in (fresh, moved):
        sim.step()
    np.testing.assert_array_equal(moved.position, fresh.position)


def test_arrays_that_are_not_there(refused):
    sim = ps.Simulation(drifting(), device="cpu")
    for read in (lambda: sim.get("density"), lambda: sim.state.density, lambda: sim.state["dense"]):
        with refused("State: name must be one of position", kind=AttributeError):
            read()
    assert not hasattr(sim.state, "density")


@pytest.mark.parametrize("method", ["symplectic_euler", "velocity_verlet"])
def test_reset_repeats_the_run(method, liquid, device):
    sim = ps.Simulation(
        liquid(cells=6), ps.Settings(dt=0.05, substeps=10, integrator=method), device=device
    )
    sim.run(5)
    first, t = sim.position, sim.time
    sim.reset()
    assert sim.time == 0
    np.testing.assert_array_equal(sim.position, sim.model.wrapped(sim.scenes[0].position)
                                  .astype(np.float32))  # fmt: skip
    sim.run(5)
    assert sim.time == t
    np.testing.assert_array_equal(sim.position, first)


# Errors -----------------------------------------------------------------------------------------


@ps.law
def blow_up(position: wp.vec3, time: float, when: float):
    push = wp.vec3(0.0, 0.0, 0.0)
    if time > when and position[0] > 5.0:
        push = wp.vec3(1.0, 0.0, 0.0) / (time - time)
    return push


@pytest.mark.parametrize("execution", ["graph", "threads"])
@pytest.mark.parametrize("method", ["symplectic_euler", "velocity_verlet"])
def test_what_is_not_finite_is_named_and_taken_back(method, execution, precision, device):
    scene = drifting()
    scene.add_interaction(ps.ParticleForce(blow_up, when=0.25))
    settings = ps.Settings(dt=0.1, execution=execution, precision=precision, integrator=method)
    sim = ps.Simulation(scene, settings, device=device)
    sim.run(2)
    good = sim.position, sim.velocity
    for _ in range(2):  # and again, from the same good frame
        with pytest.raises(ps.SimulationError) as caught:
            sim.step()
        assert re.search(
            r"Simulation: .* must stay finite, got x = .*(inf|nan).* of particle 2 in world 0 "
            r"between t = 0.2 and 0.3; use more substeps",
            str(caught.value).replace("\n", " "),
        )
        np.testing.assert_array_equal(sim.position, good[0])
        np.testing.assert_array_equal(sim.velocity, good[1])
        assert sim.time == pytest.approx(0.2)
    sim.position = np.zeros((3, 3))
    sim.step()
    np.testing.assert_allclose(sim.position[:, 0], 0.1, rtol=1e-5)


def test_large_but_finite_is_finite(device):
    # Squares of these overflow float32, the numbers themselves do not.
    scene = ps.Scene()
    scene.add_particles([(1e25, 0, 0)], velocity=(0, 1e30, 0))
    sim = ps.Simulation(scene, ps.Settings(dt=1e-3), device=device)
    sim.step()
    assert sim.position[0, 1] == pytest.approx(1e27, rel=1e-6)


@pytest.mark.parametrize("device", ["cuda:7", "nonsense", "CPU", 5, ""])
def test_a_device_that_is_not_there(device, refused, capfd):
    wp.init()
    capfd.readouterr()
    with refused("Simulation: device must be one of cpu"):
        ps.Simulation(drifting(), device=device)
    assert capfd.readouterr() == ("", "")


@pytest.mark.skipif(wp.is_cuda_available(), reason="there is CUDA")
def test_cuda_where_there_is_none(refused):
    with refused("device must be one of cpu, got 'cuda'"):
        ps.Simulation(drifting(), device="cuda")
    assert ps.Simulation(drifting()).device.is_cpu


def test_a_device_as_such():
    assert ps.Simulation(drifting(), device=wp.get_device("cpu")).device.is_cpu


@pytest.mark.parametrize("scene", [None, 3, "dam_break", [None], (s for s in [])])
def test_what_is_no_scene(scene, refused):
    with refused("Simulation: scene must be a Scene or a list", kind=TypeError):
        ps.Simulation(scene)


def test_other_bad_input(refused):
    scene = drifting()
    with refused("scene must hold at least one Scene"):
        ps.Simulation([])
    with refused("settings must be a Settings", kind=TypeError):
        ps.Simulation(scene, {"dt": 0.1})
    for worlds in (0, -1, 1.5, "two"):
        with refused("worlds must be a whole number of at least 1"):
            ps.Simulation(scene, worlds=worlds)
    with refused("worlds must be left out with a list"):
        ps.Simulation([scene], worlds=2)
    sim = ps.Simulation(scene, device="cpu")
    for frames in (-1, 1.5, None):
        with refused("Simulation.run: frames"):
            sim.run(frames)
    with refused("Simulation.world: index must be from 0 to 0"):
        sim.world(1)
    for worlds in ([1], 1):
        with refused("Simulation.reset: worlds must be from 0 to 0, got 1"):
            sim.reset(worlds)
    for worlds in ([-1], ["a"], 0.5):
        with refused("Simulation.reset: worlds must be a whole number"):
            sim.reset(worlds)


def test_constraints_with_velocity_verlet(refused):
    scene = drifting()
    scene.add_constraint(Holder("a", []))
    with refused("Settings: integrator must be symplectic_euler in a scene with constraints"):
        ps.Simulation(scene, ps.Settings(integrator="velocity_verlet"), device="cpu")
