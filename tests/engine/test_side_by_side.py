"""Simulations side by side know nothing of each other."""

import threading

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
