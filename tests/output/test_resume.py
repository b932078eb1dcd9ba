"""Runs ended at any instant: finished frames stay, and a resumed run equals a whole one."""

import os
import time
from pathlib import Path

import numpy as np
import pytest
from pxr import Usd

import particlesim as ps
from particlesim.output import checkpoint
from particlesim.output.history.writer import read_history
from particlesim.simulation import resume

from .runs import Ended, assert_same_root, end_at, frames_of, sim

# Ended and resumed in one process ---------------------------------------------------------------


def test_a_resumed_run_equals_a_whole_one(suffix, tmp_path):
    (tmp_path / "whole").mkdir()
    (tmp_path / "part").mkdir()
    whole, part = tmp_path / "whole" / f"out{suffix}", tmp_path / "part" / f"out{suffix}"
    reference = sim()
    reference.run(12, record=whole, every=2)
    options = {"record": part, "every": 2, "checkpoint": 3}
    for stop in (1, 5, 6, 11):  # before the first checkpoint, between, on one, near the end
        with pytest.raises(Ended):
            sim().run(12, resume=stop > 1, progress=end_at(stop), **options)
    resumed, seen = sim(), []
    resumed.run(12, resume=True, progress=lambda k, n: seen.append(k), **options)
    assert seen == [10, 11, 12]  # from the checkpoint of frame 9
    assert resumed.position.tobytes() == reference.position.tobytes()
    assert frames_of(part) == frames_of(whole) and len(frames_of(whole)) == 7
    assert_same_root(part, whole)


def test_colours_and_sizes_of_the_first_frame_stay(tmp_path):
    # The range of colours, the width of particles without a size, and the camera are chosen at the
    # first frame, which a resumed run does not see.
    def dust():
        scene = ps.Scene()
        scene.add_particles(np.eye(3), velocity=-np.eye(3), group="dust")
        return ps.Simulation(scene, ps.Settings(dt=0.1), device="cpu")

    options = {"color_by": "position", "instancer": True, "checkpoint": 2}
    for name in ("whole", "part"):
        (tmp_path / name).mkdir()
    dust().run(6, record=tmp_path / "whole" / "out.usda", **options)
    path = tmp_path / "part" / "out.usda"
    with pytest.raises(Ended):
        dust().run(6, record=path, progress=end_at(5), **options)
    dust().run(6, record=path, resume=True, **options)
    assert frames_of(path) == frames_of(tmp_path / "whole" / "out.usda")
    assert_same_root(path, tmp_path / "whole" / "out.usda")


def test_a_history_is_resumed_with_the_frames(tmp_path):
    sim().run(9, record=tmp_path / "whole.npz", history=tmp_path / "whole.csv")
    options = {"record": tmp_path / "part.npz", "history": tmp_path / "part.csv", "checkpoint": 4}
    with pytest.raises(Ended):
        sim().run(9, progress=end_at(6), **options)
    sim().run(9, resume=True, **options)
    assert read_history(tmp_path / "part.csv").frame.tolist() == list(range(10))
    assert (tmp_path / "part.csv").read_bytes() == (tmp_path / "whole.csv").read_bytes()


def test_a_run_that_is_done_is_left_as_it_is(suffix, tmp_path):
    path = tmp_path / f"out{suffix}"
    done = sim()
    done.run(4, record=path)
    before = {each: each.stat().st_mtime_ns for each in sorted(tmp_path.rglob("*.*"))}
    again = sim()
    again.run(4, record=path, resume=True, progress=end_at(1))
    assert again.frame == 4 and again.position.tobytes() == done.position.tobytes()
    assert before == {each: each.stat().st_mtime_ns for each in sorted(tmp_path.rglob("*.*"))}


def test_a_run_that_is_done_can_be_made_longer(suffix, tmp_path):
    sim().run(4, record=tmp_path / f"out{suffix}")
    sim().run(7, record=tmp_path / f"out{suffix}", resume=True)
    sim().run(7, record=tmp_path / f"long{suffix}")
    assert frames_of(tmp_path / f"out{suffix}") == frames_of(tmp_path / f"long{suffix}")
    if suffix == ".usda":
        assert Usd.Stage.Open(str(tmp_path / "out.usda")).GetEndTimeCode() == 7


def test_where_nothing_is_to_be_resumed_the_run_starts(tmp_path):
    sim().run(3, record=tmp_path / "out.npz", resume=True)
    sim().run(3, record=tmp_path / "plain.npz")
    assert frames_of(tmp_path / "out.npz") == frames_of(tmp_path / "plain.npz")


def test_a_start_that_was_cut_short_is_made_again(tmp_path):
    # Killed while an old recording was being overwritten: only the arguments are on disk, and
    # frames of whatever went before.
    path = tmp_path / "out.usda"
    sim(speed=2.0).run(9, record=path)
    resume.Checkpoints(sim(), path, None, {"fields": ()}).start(overwrite=True)
    sim().run(3, record=path, resume=True)
    sim().run(3, record=tmp_path / "other.usda")
    assert frames_of(path) == frames_of(tmp_path / "other.usda")


# When checkpoints come --------------------------------------------------------------------------


def test_checkpoints_by_number(tmp_path, monkeypatch):
    at, write = [], checkpoint.write
    monkeypatch.setattr(
        checkpoint, "write", lambda made, path: (at.append(made.header["frame"]), write(made, path))
    )
    sim().run(8, record=tmp_path / "out.npz", checkpoint=3)
    assert at == [0, 0, 3, 6, 8]  # the arguments; the first frame; every third; the end


@pytest.mark.skipif(not Path("/proc/self/fd").is_dir(), reason="says which file is open")
def test_the_disk_has_the_frames_that_a_checkpoint_claims(suffix, tmp_path, monkeypatch):
    path, synced, claimed, fsync = tmp_path / f"out{suffix}", [], [], os.fsync
    write = checkpoint.write

    def sync(opened):
        fsync(opened)
        synced.append(Path(os.readlink(f"/proc/self/fd/{opened}")))

    def claim(made, target):
        if made.arrays:
            names = {each.name for each in synced}
            claimed.append((made.header["frame"], set(frames_of(path)) - names))
            assert tmp_path in synced and (path in synced or suffix == ".ply")
            if made.header["frame"]:  # the first is made before anything else
                assert history in synced
                synced[:] = [each for each in synced if each != history]  # anew each time
            if suffix == ".gsd":
                synced.clear()  # the one file, each time
        write(made, target)

    monkeypatch.setattr(os, "fsync", sync)
    monkeypatch.setattr(checkpoint, "write", claim)
    history = tmp_path / "history.csv"
    sim().run(7, record=path, history=history, checkpoint=3)
    assert [frame for frame, _ in claimed] == [0, 3, 6, 7]
    if suffix != ".gsd":  # one file
        assert not any(missing for _, missing in claimed)


def test_checkpoints_by_the_clock_take_their_share(tmp_path, monkeypatch):
    cost, share, write, written = 0.02, 0.1, checkpoint.write, []

    def slow(made, path):
        written.append(time.perf_counter())
        time.sleep(cost)
        write(made, path)

    monkeypatch.setattr(checkpoint, "write", slow)
    monkeypatch.setattr(resume, "INTERVAL", 0.0)
    monkeypatch.setattr(resume, "SHARE", share)
    started = time.perf_counter()

    def progress(done, frames):
        if time.perf_counter() - started > 1.0:
            raise Ended

    with pytest.raises(Ended):
        sim().run(10**6, record=tmp_path / "out.npz", progress=progress)
    # The arguments first; then the first of the state, and the next not before cost / share.
    between = np.diff(written[1:])
    assert len(between) and between.min() > cost / share
