"""Simulation: the loop, and starts that are hardly any."""

import numpy as np
import pytest

import particlesim as ps
from cases.simulation import Holder, drifting
from particlesim.engine.execution import launch
from particlesim.engine.execution.launch import Program

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


@pytest.fixture
def order(monkeypatch):
    """The calls of a substep, with the integrator's launches among them."""
    calls = []
    original = launch.launch

    def spy(kernel, *rest):
        calls.append(kernel.key.rpartition("__")[2])
        original(kernel, *rest)

    monkeypatch.setattr("particlesim.engine.integrators.integrator.launch", spy)
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


def test_what_is_added_afterwards_is_told_once(device):
    scene = drifting()
    sim = ps.Simulation(scene, device=device)
    sim.step()
    scene.add_interaction(ps.UniformGravity())
    with pytest.warns(ps.SimulationWarning, match="make a new Simulation") as told:
        sim.run(3)
    assert len(told) == 1
