"""Simulations side by side know nothing of each other."""

import threading
import time

import numpy as np
import pytest
import warp as wp

import particlesim as ps
from particlesim.engine.execution import launch
from particlesim.engine.execution.launch import Program


@wp.kernel
def add_one(first: int, values: wp.array(dtype=float)):
    i = first + wp.tid()
    values[i] = values[i] + 1.0


def test_what_another_thread_launches_is_not_recorded():
    values = wp.zeros(3, dtype=float, device="cpu")
    start, done = threading.Event(), threading.Event()

    def other():
        start.wait()
        launch.launch(add_one, 3, [values], values.device)
        done.set()

    thread = threading.Thread(target=other)
    thread.start()
    with launch.record(Program()) as program, launch.owner("Gravity"):
        start.set()
        done.wait()
        assert values.numpy().tolist() == [1.0] * 3
    thread.join()
    assert not program.operations


def make(liquid, seed, execution):
    scene = liquid(cells=6)  # enough for rows that grow, and are recorded anew
    scene.add_interaction(ps.Drag(0.1 * seed))
    settings = ps.Settings(dt=0.004, substeps=2, execution=execution, threads=2)
    return ps.Simulation(scene, settings, device="cpu")


def motion(sim, frames=6):
    """Every frame is measured, and recorded anew."""
    found = []
    for _ in range(frames):
        sim.step()
        found += [sim.diagnostics().energy, sim.stability().dt, sim.position, sim.velocity]
        sim.close()
    return found


@pytest.mark.parametrize("execution", ["graph", "threads"])
@pytest.mark.slow
def test_two_threads_give_the_bits_of_one_after_the_other(liquid, execution):
    alone = [motion(make(liquid, seed, execution)) for seed in (1, 2)]
    sims = [make(liquid, seed, execution) for seed in (1, 2)]
    together = [None, None]

    def run(k):
        together[k] = motion(sims[k])

    threads = [threading.Thread(target=run, args=(k,)) for k in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for found, right in zip(together, alone, strict=True):
        for a, b in zip(found, right, strict=True):
            np.testing.assert_array_equal(a, b)


def test_two_simulations_of_one_scene_read_their_own():
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0), (1, 0, 0)], pinned=[True, False])
    scene.add_interaction(ps.UniformGravity((9.81, 0, 0)))
    rod = scene.add_constraint(ps.Distance([(0, 1)], break_force=100.0))
    calm, wild = (ps.Simulation(scene, device="cpu") for _ in range(2))
    wild.set("velocity", (300.0, 0, 0), slice(1, 2))
    for _ in range(2):
        wild.step()
        calm.step()
    assert calm.force(rod)[0] == pytest.approx(9.81, rel=1e-2)
    assert [sim.broken(rod).tolist() for sim in (calm, wild)] == [[False], [True]]
    assert calm.diagnostics().kinetic[0] < 1e-6 < wild.diagnostics().kinetic[0]


@pytest.mark.filterwarnings("ignore::particlesim.SimulationWarning")
def test_retries_leave_no_threads_behind():
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0), (1.5, 0, 0)])
    scene.add_interaction(ps.Springs([(0, 1)], stiffness=1.0, rest_length=1.0))
    # omega = sqrt(2): one substep of 4 is beyond 2 / omega = 1.4, from four of them on it is not.
    settings = ps.Settings(dt=4.0, substeps=1, execution="threads", threads=3, on_failure="retry")
    sim = ps.Simulation(scene, settings, device="cpu")
    sim.step()
    before = threading.active_count()
    for retry in range(20):
        sim.reset()
        while len(sim.incidents) == retry:
            sim.step()
    until = time.monotonic() + 5.0
    while threading.active_count() > before and time.monotonic() < until:
        time.sleep(0.01)  # who was sent home is on the way
    assert threading.active_count() == before


@pytest.mark.parametrize("iterations", [1, 4])
def test_a_projection_whose_rows_were_full_is_made_again(iterations):
    """Of grains far apart that are put into one heap: more partners than rows were made for."""
    x = np.random.default_rng(0).normal(size=(300, 3)).astype(np.float32) * np.float32(0.02)
    found = []
    for told in (True, False):
        scene = ps.Scene()
        scene.add_particles(np.linspace((0, 0, 0), (300, 0, 0), 300), radius=0.1)
        scene.add_constraint(ps.Contact())
        sim = ps.Simulation(scene, device="cpu")
        if told:
            sim.set("position", x)  # which makes the rows long enough
        else:
            sim.state.position.assign(x)
        before = sim.neighbors.generation
        sim.project(iterations)
        # Rows of who touches are as long as what touched before in any case.
        assert told or sim.neighbors.generation > before
        found.append(sim.position)
    np.testing.assert_array_equal(*found)


INF = np.inf


@pytest.mark.parametrize("velocity", [(1, 0, 0), (0, 1, 0), (1, 2, 3)])
@pytest.mark.parametrize(
    ("lower", "upper"),
    [((-INF, 0, -INF), (INF, INF, INF)), ((0, -INF, 0), (1, INF, 1)), ((-INF,) * 3, (INF,) * 3)],
)
@pytest.mark.filterwarnings("error::RuntimeWarning")
def test_an_open_box_that_moves_says_nothing_of_infinity(lower, upper, velocity):
    scene = ps.Scene()
    scene.add_particles([(0.5, 0.5, 0.5)], radius=0.1)
    scene.add_constraint(ps.BoxBoundary(lower, upper, velocity=velocity))
    sim = ps.Simulation(scene, device="cpu")
    sim.run(2)
    sim.stability()
    place, _ = sim.constraints[0].pose(1.0)
    sided = np.isfinite(lower) | np.isfinite(upper)  # along the others it moves in itself
    np.testing.assert_array_equal(place, np.where(sided, velocity, 0.0))
