"""Parts of one's own act in every substep, whatever they are written with, or are refused."""

import numpy as np
import pytest
import warp as wp

import particlesim as ps
from cases.own_parts import (
    DT,
    EXECUTIONS,
    FRAMES,
    ON_HOST,
    RECORDED,
    SUBSTEPS,
    Own,
    kept_when_first_needed,
    launched,
    of_its_state,
    push,
    simulate,
)
from particlesim.engine.observers import Observer


@pytest.mark.parametrize("execution", EXECUTIONS)
@pytest.mark.parametrize("precision", ["float32", "float64"])
@pytest.mark.parametrize("integrator", ["symplectic_euler", "velocity_verlet"])
@pytest.mark.parametrize("way", RECORDED + ON_HOST, ids=lambda way: way.__name__)
def test_a_force_of_ones_own_acts_in_every_substep(way, integrator, precision, execution):
    attributes = {"calls": 0, "rng": np.random.default_rng(0)}
    sim = simulate(Own(way, **attributes), execution, integrator=integrator, precision=precision)
    sim.run(FRAMES)
    # n substeps of h under a unit force: v = n h; by Euler x = h^2 n (n + 1) / 2, by Verlet v^2/2.
    n, h = SUBSTEPS * FRAMES, DT / SUBSTEPS
    x = h * h * n * (n + 1) / 2 if integrator == "symplectic_euler" else (n * h) ** 2 / 2
    # A sum of n terms of at most x: n roundings of each of v and x.
    tolerance = 2 * n * np.finfo(precision).eps
    np.testing.assert_allclose(sim.velocity[:, 0], n * h, rtol=tolerance)
    np.testing.assert_allclose(sim.position[:, 0], x, rtol=tolerance)
    told = f"Own acts on the host ({'it' if way in ON_HOST[3:6] else 'apply uses'}"
    assert (told in sim.explain().execution) == (way in ON_HOST)


def test_the_closed_form_of_ten_frames():
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0)])
    scene.add_interaction(Own(launched))
    sim = ps.Simulation(scene, ps.Settings(dt=0.1), device="cpu")  # ten substeps, of 0.01
    sim.run(10)
    assert sim.position[0, 0] == pytest.approx(0.505, rel=1e-5)
    assert sim.velocity[0, 0] == pytest.approx(1.0, rel=1e-5)


def test_what_it_asks_of_warp_is_explained_and_not_cut():
    sim = simulate(Own(launched), "threads", count=5000)
    sim.run(FRAMES)
    np.testing.assert_allclose(sim.velocity[:, 0], SUBSTEPS * FRAMES * DT / SUBSTEPS, rtol=1e-5)
    assert ("Own", "push32", 5000) in sim.explain().launches
    assert sim.explain().execution == "threads"


def test_state_of_ones_own_counts_the_substeps_and_nothing_else():
    sim = simulate(Own(of_its_state, calls=0))
    sim.run(3)
    sim.stability()
    sim.explain()
    assert sim.interactions[0].calls == 3 * SUBSTEPS


@pytest.mark.parametrize("asked", [False, True])
def test_what_is_kept_when_it_is_first_needed_is_filled_once(asked):
    sim = simulate(Own(kept_when_first_needed))
    if asked:
        sim.stability()
    for _ in range(3):
        sim.step()
    np.testing.assert_allclose(sim.velocity[:, 0], 3 * DT, rtol=1e-6)
    assert "it changes its late" in sim.explain().execution


def test_what_is_said_to_act_on_the_host_does():
    calls = []
    part = Own(lambda part, state: calls.append(push(state)))
    part.host = True
    sim = simulate(part)
    for _ in range(3):
        sim.step()
    assert len(calls) == 3 * SUBSTEPS
    assert "Own.host is set" in sim.explain().execution
    assert sim.velocity[0, 0] == pytest.approx(3 * DT, rel=1e-5)


def test_an_apply_that_does_nothing_is_refused_at_the_first_step():
    sim = simulate(Own(lambda part, state: None))
    with pytest.raises(ValueError, match=r"Own: apply must launch something.*ps\.launch or wp\.l"):
        sim.step()
    view = {}

    def kept_view(part, state):  # neither recorded nor found
        view.setdefault(id(part), state.count)

    with pytest.raises(ValueError, match="host = True"):
        simulate(Own(kept_view)).step()


def test_a_constraint_that_does_nothing_is_refused():
    class Nothing(Floor):
        def project(self, state, neighbors, dt): ...

    with pytest.raises(ValueError, match="Nothing: project must launch something"):
        simulate(Nothing(False)).step()


def test_parts_without_members_are_not_refused():
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0)])
    nobody = scene.add_particles(np.zeros((0, 3)), group="nobody")
    for _ in range(2):  # which share one pass
        scene.add_interaction(ps.LennardJones(nobody, cutoff=1.0))
    scene.add_interaction(ps.UniformGravity((0, -1, 0), nobody))
    scene.add_interaction(Own(lambda part, state: None, group=nobody))
    scene.add_constraint(ps.Contact(nobody))
    scene.add_constraint(ps.Contact())  # of a point
    scene.add_constraint(ps.PlaneBoundary((0, 0, 0), (0, 1, 0), group=nobody))
    ps.Simulation(scene, device="cpu").step()


class Floor(ps.ConstraintBase):
    """x >= 0.5, in one of two ways."""

    def __init__(self, on_host):
        self.on_host = on_host

    def prepare(self, model, neighbors): ...

    def project(self, state, neighbors, dt):
        if self.on_host:
            x, moved = state.position.numpy(), state.correction.numpy()
            up = np.maximum(0.5 - x[:, 0], 0)
            x[:, 0] += up
            moved[:, 0] += up
        else:
            wp.launch(lift, state.count, [state.position, state.correction], device="cpu")


@wp.kernel
def lift(x: wp.array(dtype=wp.vec3), moved: wp.array(dtype=wp.vec3)):
    i = wp.tid()
    up = wp.vec3(wp.max(0.5 - x[i][0], 0.0), 0.0, 0.0)
    x[i] = x[i] + up
    moved[i] = moved[i] + up


@pytest.mark.parametrize("execution", EXECUTIONS)
@pytest.mark.parametrize("on_host", [False, True])
def test_a_constraint_of_ones_own(on_host, execution):
    sim = simulate(Floor(on_host), execution)
    sim.set("position", (1.0, 0.0, 0.0))
    sim.set("velocity", (-10.0, 0.0, 0.0))
    sim.run(3)
    np.testing.assert_allclose(sim.position[:, 0], 0.5, rtol=1e-6)
    assert ("acts on the host" in sim.explain().execution) == on_host


def test_observers_and_integrators_of_ones_own():
    class Count(Observer):
        name, seen = "count", 0

        def end(self, dt):
            self.seen += 1

    class Euler(ps.Integrator):
        def advance(self, dt):
            self.move(dt, dt)
            push(self.state)  # of no effect, and recorded

    sim = simulate(Own(launched), "graph", integrator=Euler)
    sim.loop.observers.all.append(counter := Count())
    sim.run(3)
    assert counter.seen == 3 * SUBSTEPS
    assert "count acts on the host (it changes its seen)" in sim.explain().execution
    assert ("loop", "push32", 2) in sim.explain().launches
