"""Writing beside the simulation."""

import threading
import time

import numpy as np
import pytest

import particlesim as ps
from particlesim.output.recorders.background import DEPTH, BackgroundWriter

from .scenes import worlds

# Beside the simulation --------------------------------------------------------------------------


def test_jobs_keep_their_order_and_wait_their_turn():
    done, waiting = [], threading.Event()
    writer = BackgroundWriter()
    writer.put(lambda: (waiting.wait(10), done.append(0)))
    handed_out = []

    def hand_out():
        for k in range(1, 6):
            writer.put(lambda k=k: done.append(k))
            handed_out.append(k)

    other = threading.Thread(target=hand_out)
    other.start()
    time.sleep(0.1)
    assert len(handed_out) == DEPTH - 1 and not done  # the rest waits: memory is bounded
    waiting.set()
    other.join()
    writer.close()
    assert done == list(range(6))


def test_what_a_job_raises_comes_out_once_and_ends_the_writing():
    done = []
    writer = BackgroundWriter()

    def fail():
        raise OSError("disk full")

    writer.put(fail)
    time.sleep(0.05)
    with pytest.raises(OSError, match="disk full"):
        writer.put(lambda: done.append("lost"))
    writer.put(lambda: done.append("behind a gap"))
    writer.close()
    assert not done
    with pytest.raises(OSError, match="disk full"), BackgroundWriter() as writer:
        writer.put(fail)
    with pytest.raises(KeyboardInterrupt), BackgroundWriter() as writer:
        writer.put(fail)
        raise KeyboardInterrupt


def test_the_next_frame_computes_while_the_last_one_is_written(tmp_path, monkeypatch):
    from particlesim.output.recorders.npz import NpzRecorder

    sim, rest = ps.Simulation(worlds(), ps.Settings(dt=0.1), device="cpu"), 0.04
    step, save = sim.step, NpzRecorder._save
    monkeypatch.setattr(sim, "step", lambda: (time.sleep(rest), step()))
    monkeypatch.setattr(
        NpzRecorder, "_save", lambda *arguments: (time.sleep(rest), save(*arguments))
    )
    started = time.perf_counter()
    sim.run(10, record=tmp_path / "out.npz", checkpoint=0)
    spent = time.perf_counter() - started
    # 10 steps and 11 writes: one after the other 21 rests, side by side about 11.
    assert 10 * rest < spent < 17 * rest


def test_an_interrupted_run_keeps_what_was_captured(tmp_path, monkeypatch):
    from particlesim.output.recorders.npz import NpzRecorder

    save = NpzRecorder._save
    monkeypatch.setattr(
        NpzRecorder, "_save", lambda *arguments: (time.sleep(0.02), save(*arguments))
    )

    def interrupt(done, frames):
        if done == 4:
            raise KeyboardInterrupt

    sim = ps.Simulation(worlds(), ps.Settings(dt=0.1), device="cpu")
    with pytest.raises(KeyboardInterrupt):
        sim.run(10, record=tmp_path / "out.npz", progress=interrupt)
    assert len(list((tmp_path / "out.frames").glob("f.*.npz"))) == 5
    assert np.load(tmp_path / "out.npz")["last"] == 4


def test_a_failed_simulation_keeps_its_frames(tmp_path):
    sim = ps.Simulation(worlds(), ps.Settings(dt=0.1), device="cpu")

    def spoil(done, frames):
        if done == 3:
            sim.state.velocity.fill_(float("nan"))

    with pytest.raises(ps.SimulationError):
        sim.run(10, record=tmp_path / "out.usda", progress=spoil)
    assert len(list((tmp_path / "out.clips").glob("f.*.usdc"))) == 4
