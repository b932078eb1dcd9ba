"""Launching: graph, threads and plain launches agree bit for bit."""

import time
import weakref

import numpy as np
import pytest
import warp as wp

import particlesim as ps
from particlesim.engine.execution import launch
from particlesim.engine.execution.executors import EagerExecutor, GraphExecutor, ThreadExecutor
from particlesim.engine.execution.frame import Frame
from particlesim.engine.execution.launch import CHUNK, Launch, Program, When
from particlesim.engine.execution.threads import Chain, Team

WAYS = [("graph", None), ("threads", 1), ("threads", 2), ("threads", 3), ("auto", 2)]


@ps.law
def weak(r: float, strength: float):
    """Next to nothing."""
    return strength * (1.0 - r)


@pytest.fixture
def melt(liquid):
    """A function that makes a liquid of 6912 atoms, large enough to be cut, and its settings."""

    def build(execution, threads, **knobs):
        scene = liquid(cells=12)
        scene.add_interaction(ps.Drag(0.05))
        scene.add_interaction(ps.Springs([(k, k + 1) for k in range(0, 4000, 2)], 10.0))
        settings = ps.Settings(
            **{"dt": 0.01, "substeps": 2, "execution": execution, "threads": threads, **knobs}
        )
        return ps.Simulation(scene, settings, device="cpu")

    return build


@pytest.mark.parametrize("method", ["symplectic_euler", "velocity_verlet"])
def test_the_same_bits_whichever_way(melt, method):
    results = {}
    for execution, threads in WAYS:
        sim = melt(execution, threads, integrator=method)
        sim.run(6)
        results[execution, threads] = sim.position, sim.velocity, sim.diagnostics().potential
    eager = melt("graph", None, integrator=method)
    eager.executor.chosen = EagerExecutor(eager.executor.frame)
    eager.loop.know_forces()
    for _ in range(6):
        eager.executor.run()
    reference = eager.position, eager.velocity, eager.diagnostics().potential
    for way, found in results.items():
        for a, b in zip(found, reference, strict=True):
            np.testing.assert_array_equal(a, b, err_msg=str(way))


def test_auto_tries_both_and_keeps_one(melt):
    sim = melt("auto", 2)
    assert sim.executor.chosen is None
    assert "as measured" in sim.explain().execution
    sim.run(2 * sim.executor.TRIALS)
    assert sim.executor.chosen.name in ("graph", "threads")
    assert sim.explain().execution == sim.executor.chosen.name
    assert not sim.executor._tried


@pytest.mark.parametrize(("count", "threads"), [(3, 2), (5000, 1)])
def test_auto_needs_no_trial_where_threads_cannot_pay(count, threads):
    scene = ps.Scene()
    scene.add_particles(np.zeros((count, 3)))
    sim = ps.Simulation(scene, ps.Settings(threads=threads), device="cpu")
    assert isinstance(sim.executor.chosen, GraphExecutor)


def test_a_simulation_takes_its_threads_with_it(melt):
    sim = melt("threads", 3)
    sim.step()
    first = sim.executor.chosen.team.workers
    assert len(first) == 2  # beside the calling thread
    sim.close()
    sim.step()  # with threads anew
    second = sim.executor.chosen.team.workers
    last = weakref.ref(sim)
    del sim
    assert last() is None  # without waiting for the garbage collector
    for thread in [*first, *second]:
        thread.join(5)
        assert not thread.is_alive()


@pytest.mark.parametrize(("execution", "threads"), WAYS[:3])
def test_rows_that_grow_within_a_run(execution, threads):
    rng = np.random.default_rng(5)
    x = rng.uniform(-9, 9, (2500, 3))
    scene = ps.Scene()
    scene.add_particles(x, velocity=-x)
    scene.add_interaction(ps.LennardJones(epsilon=1e-3, sigma=0.3, cutoff=2.0))
    # Random points overlap, and some pairs part at nonsensical speeds: not the subject here.
    settings = ps.Settings(
        dt=0.03, substeps=2, execution=execution, threads=threads, watchdog=False
    )
    sim = ps.Simulation(scene, settings, device="cpu")
    before = sim.neighbors.lists[0].capacity
    sim.run(15)
    assert sim.neighbors.lists[0].capacity > before
    # Against rows that were long enough from the start.
    roomy = ps.Simulation(scene, settings.replace(execution="graph"), device="cpu")
    (rows,) = roomy.neighbors.lists
    rows._make_room(np.full(rows.rows, 2000))
    rows.mark_all()
    long = rows.generation
    roomy.run(15)
    assert rows.generation == long
    np.testing.assert_array_equal(sim.position, roomy.position)


def test_rows_that_are_full_for_a_moment_only():
    # Two groups of 300 pass through each other within a frame: rows are full in its middle, and
    # short again at its end, where the host looks.
    rng = np.random.default_rng(0)
    x = rng.uniform(-0.5, 0.5, (600, 3))
    side = np.repeat([-1.0, 1.0], 300)
    x[:, 0] += 6.0 * side
    scene = ps.Scene()
    v = np.stack([-12.0 * side, 0 * side, 0 * side], axis=1)
    scene.add_particles(x, velocity=v)
    scene.add_interaction(ps.PairForce(weak, cutoff=1.0, strength=1e-6))
    settings = ps.Settings(dt=1.0, substeps=100, skin=0.1, execution="graph")
    sim = ps.Simulation(scene, settings, device="cpu")
    before = len(sim.neighbors.lists[0].index)
    sim.step()
    assert before < len(sim.neighbors.lists[0].index)
    np.testing.assert_allclose(sim.position[:, 0], x[:, 0] + v[:, 0], rtol=1e-4)


def test_a_long_frame_is_replayed_substep_by_substep(liquid):
    scene = liquid(cells=3)
    settings = ps.Settings(dt=0.1, substeps=1000)
    long = ps.Simulation(scene, settings, device="cpu")
    assert len(long.executor.chosen.graphs) == 3
    long.step()
    short = ps.Simulation(scene, settings.replace(dt=0.01, substeps=100), device="cpu")
    assert len(short.executor.chosen.graphs) == 1
    short.run(10)
    np.testing.assert_array_equal(long.position, short.position)


# Programs ---------------------------------------------------------------------------------------


@wp.kernel
def add_one(first: int, values: wp.array(dtype=float)):
    i = first + wp.tid()
    values[i] = values[i] + 1.0


@wp.kernel
def twice(first: int, values: wp.array(dtype=float)):
    i = first + wp.tid()
    values[i] = 2.0 * values[i]


def test_a_launch_is_cut_into_chunks_that_cover_it():
    for count in (1, CHUNK, 3 * CHUNK + 5):
        values = wp.zeros(count, dtype=float, device="cpu")
        operation = Launch(add_one, count, [values], values.device)
        commands = operation.record(8)
        assert len(commands) == max(1, min(8, count // CHUNK))
        for command in commands:
            command.launch()
        assert (values.numpy() == 1).all()


def test_launches_of_nothing_are_left_out():
    values = wp.zeros(1, dtype=float, device="cpu")
    with launch.record(Program()) as program:
        launch.launch(add_one, 0, [values], values.device)
    assert not program.operations


def test_a_program_runs_what_is_recorded_when_it_is_told():
    values = wp.zeros(5, dtype=float, device="cpu")
    flag = wp.zeros(1, dtype=int, device="cpu")
    with launch.record(Program()) as program:
        launch.launch(add_one, 5, [values], values.device)
        with launch.when(flag):
            launch.launch(add_one, 5, [values], values.device)
        launch.call(flag.zero_)
    assert not values.numpy().any()
    assert isinstance(program.operations[1], When)
    assert len(list(program.launches())) == 2
    frame = Frame(repeat=3, substep=program)
    for executor in (
        EagerExecutor(frame), GraphExecutor(frame, values.device), ThreadExecutor(frame, 2)
    ):  # fmt: skip
        values.zero_()
        flag.fill_(1)  # the conditional part runs in the first of three rounds
        executor.run()
        assert (values.numpy() == 4).all(), executor.name
        executor.close()


def test_a_condition_is_read_when_its_turn_comes():
    values = wp.zeros(2, dtype=float, device="cpu")
    flag = wp.ones(1, dtype=int, device="cpu")
    with launch.when(flag):
        launch.launch(add_one, 2, [values], values.device)
    flag.zero_()
    with launch.when(flag):
        launch.launch(add_one, 2, [values], values.device)
    assert (values.numpy() == 1).all()


@pytest.mark.parametrize("threads", [1, 2, 5])  # five: more than this machine may have cores
def test_a_team_runs_every_chunk_once_and_every_stage_in_its_turn(threads):
    values = wp.zeros(8 * CHUNK, dtype=float, device="cpu")
    cut, double = (
        Launch(kernel, len(values), [values], values.device) for kernel in (add_one, twice)
    )
    chain = Chain([cut.record(8), double.record(5), cut.record()])
    team = Team(threads)
    assert chain.table[:, 1].tolist() == [8, 5, 1]
    for run in range(1, 301):
        team.run(chain)
        # x -> 2 (x + 1) + 1; started from zero again before it leaves the whole numbers of float32.
        assert (values.numpy() == 3 * (2.0 ** (1 + (run - 1) % 20) - 1)).all()
        if run % 20 == 0:
            values.zero_()
        if run % 100 == 0:  # the workers fall asleep in between
            time.sleep(0.02)
    team.close()
    for worker in team.workers:
        worker.join(5)
        assert not worker.is_alive()


def test_owners_are_remembered():
    values = wp.zeros(1, dtype=float, device="cpu")
    with launch.record(Program()) as program:
        launch.launch(add_one, 1, [values], values.device)
        with launch.owner("Gravity"):
            launch.launch(add_one, 1, [values], values.device)
    assert [operation.owner for operation in program.operations] == ["loop", "Gravity"]


# Nothing is allocated ---------------------------------------------------------------------------


@pytest.mark.parametrize(("execution", "threads"), WAYS[:3])
@pytest.mark.parametrize("method", ["symplectic_euler", "velocity_verlet"])
def test_nothing_is_allocated_and_nothing_compiled_once_it_runs(
    execution, threads, method, melt, monkeypatch
):
    sim = melt(execution, threads, integrator=method)
    sim.run(2)

    def forbidden(*args, **kwargs):
        raise AssertionError("allocated within a frame")

    # Every new array, of whatever making, passes here.
    monkeypatch.setattr(wp._src.types.array, "_init_new", forbidden)
    monkeypatch.setattr(wp._src.context.Module, "load", forbidden)
    sim.run(3)


def test_a_substep_does_not_wait_for_the_host(melt, monkeypatch):
    sim = melt("graph", None)
    reads = []
    numpy = wp._src.types.array.numpy
    monkeypatch.setattr(
        wp._src.types.array, "numpy", lambda self: reads.append(self) or numpy(self)
    )
    sim.step()
    reads.clear()
    for _ in range(4):
        sim.step()
    # Once a frame: was a row full. The watchdog's flag is looked at in place, on the CPU.
    assert len(reads) == 4
