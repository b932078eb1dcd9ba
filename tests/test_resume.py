"""Runs ended at any instant: finished frames stay, and a resumed run equals a whole one."""

import errno
import os
import resource
import time
from pathlib import Path

import numpy as np
import pytest
from pxr import Sdf, Usd

import particlesim as ps
from particlesim.output import checkpoint
from particlesim.output.history.writer import read_history
from particlesim.simulation import resume

FORMATS = [".usda", ".usdc", ".npz", ".ply", ".gsd", ".vtkhdf"]
NEEDS = {".gsd": "gsd", ".vtkhdf": "h5py"}


@pytest.fixture(params=FORMATS)
def suffix(request):
    """Every format whose package is there."""
    if request.param in NEEDS:
        pytest.importorskip(NEEDS[request.param])
    return request.param


def small(speed=1.0, **options):
    """Two bouncing balls on a spring: no two frames are the same."""
    scene = ps.Scene(**options)
    scene.add_particles([(0, 1, 0), (1, 1, 0)], velocity=(speed, 0, 0), radius=0.1, group="balls")
    scene.add_interaction(ps.UniformGravity())
    scene.add_interaction(ps.Springs([(0, 1)], stiffness=50.0, rest_length=0.9))
    scene.add_constraint(ps.PlaneBoundary((0, 0, 0), (0, 1, 0), restitution=0.9))
    return scene


def sim(speed=1.0, substeps=4):
    return ps.Simulation(small(speed), ps.Settings(dt=1 / 30, substeps=substeps), device="cpu")


class Ended(Exception):
    """What ends a run in these tests where nothing has to be killed."""


def end_at(frame):
    def progress(done, frames):
        if done == frame:
            raise Ended

    return progress


def frames_of(path):
    """What a recording holds, by the names of its files or frames, as bytes."""
    if path.suffix == ".gsd":
        import gsd.hoomd

        with gsd.hoomd.open(str(path)) as file:
            return {
                str(frame.configuration.step): b"".join(
                    np.ascontiguousarray(each).tobytes()
                    for each in (
                        frame.particles.position, frame.particles.velocity,
                        frame.particles.typeid, *(frame.log[name] for name in sorted(frame.log)),
                    )
                )
                for frame in file
            }  # fmt: skip
    folder = path.with_suffix(".clips" if path.suffix.startswith(".usd") else ".frames")
    return {each.name: each.read_bytes() for each in folder.glob("f.*") if ".tmp" not in each.name}


def assert_same_root(ours, theirs):
    """The file that leads to the frames says the same in two recordings of one name."""
    if ours.suffix.startswith(".usd"):
        texts = [Sdf.Layer.OpenAsAnonymous(str(path)).ExportToString() for path in (ours, theirs)]
        assert texts[0] == texts[1]
    elif ours.suffix == ".npz":
        assert ours.read_bytes() == theirs.read_bytes()
    elif ours.suffix == ".vtkhdf":
        import h5py

        with h5py.File(ours) as a, h5py.File(theirs) as b:
            for name in ("VTKHDF/Points", "VTKHDF/PointData/velocity", "VTKHDF/Steps/Values"):
                np.testing.assert_array_equal(a[name], b[name])


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


# What is refused --------------------------------------------------------------------------------


@pytest.fixture
def ended(tmp_path):
    """A run of 9 frames that was ended after the fifth."""
    path = tmp_path / "out.usda"
    with pytest.raises(Ended):
        sim().run(9, record=path, checkpoint=2, progress=end_at(5))
    return path


def test_a_run_with_other_arguments_is_refused(ended, refused):
    before = frames_of(ended)
    for told, other, options in (
        ("settings.substeps must be .*4, got 5", sim(substeps=5), {}),
        ("start.state must be", sim(speed=1.5), {}),
        (r"record.fields.* must be", sim(), {"fields": ["speed"]}),
        (r"record.every must be", sim(), {"every": 2}),
    ):
        with refused(told):
            other.run(9, record=ended, resume=True, **options)
    moved = sim()
    moved.step()
    with refused("start.frame must be .* 0, got 1"):
        moved.run(9, record=ended, resume=True)
    stiff = small()
    stiff.interactions[1].stiffness[:] = 51.0
    with refused(r"scenes\[0\].interactions\[1\].stiffness must be .*checksum"):
        ps.Simulation(stiff, sim().settings, device="cpu").run(9, record=ended, resume=True)
    more = small()
    more.add_interaction(ps.Drag(1.0))
    with refused("scene.interactions must be .*Drag"):
        ps.Simulation(more, sim().settings, device="cpu").run(9, record=ended, resume=True)
    assert frames_of(ended) == before


def test_a_recording_that_is_not_whole_is_refused(suffix, tmp_path, refused):
    if suffix == ".gsd":
        pytest.skip("one file; what is missing in it is tested below")
    path = tmp_path / f"out{suffix}"
    with pytest.raises(Ended):
        sim().run(9, record=path, checkpoint=2, progress=end_at(5))
    (first, *_) = sorted(path.parent.rglob("f.000001.*"))
    first.unlink()
    with refused("be a recording of this simulation, .*f.000001.* is missing"):
        sim().run(9, record=path, resume=True)


def test_a_gsd_file_without_its_frames_is_refused(tmp_path, refused):
    pytest.importorskip("gsd")
    path = tmp_path / "out.gsd"
    sim().run(3, record=path)
    path.unlink()
    with refused("be a recording of this simulation, .*the file is missing"):
        sim().run(9, record=path, resume=True)
    sim().run(1, record=path, checkpoint=0, overwrite=True)
    with refused("be a recording of this simulation, .*frame 3 cannot be read"):
        sim().run(9, record=path, resume=True)


def test_an_output_without_a_checkpoint_is_refused(tmp_path, refused):
    path = tmp_path / "out.npz"
    sim().run(2, record=path, checkpoint=0)
    assert not resume.checkpoint_path(path).exists()
    with refused("checkpoint.npz' beside it", FileExistsError):
        sim().run(4, record=path, resume=True)
    sim().save(resume.checkpoint_path(path))  # of somebody else
    with refused("the checkpoint of a recorded run"):
        sim().run(4, record=path, resume=True)
    with refused("'out.npz' exists", FileExistsError):
        sim().run(4, record=path)


def test_nothing_is_overwritten_unasked(suffix, tmp_path, refused):
    path = tmp_path / f"out{suffix}"
    sim().run(2, record=path)
    before = {each: each.read_bytes() for each in tmp_path.rglob("*.*") if each.is_file()}
    with refused("exists", FileExistsError):
        sim().run(3, record=path)
    assert before == {each: each.read_bytes() for each in tmp_path.rglob("*.*") if each.is_file()}
    sim(speed=3.0).run(1, record=path, overwrite=True)
    assert len(frames_of(path)) == 2
    for each in (path, path.with_suffix(".frames"), path.with_suffix(".clips")):
        if each.is_file():
            each.unlink()
        elif each.is_dir():
            for inner in each.iterdir():
                inner.unlink()
            each.rmdir()
    with refused("'out.checkpoint.npz' exists", FileExistsError):
        sim().run(3, record=path)


def test_arguments_that_do_not_fit(tmp_path, refused):
    with refused("record must be given where resume is"):
        sim().run(1, resume=True)
    with refused("resume must come without overwrite"):
        sim().run(1, record=tmp_path / "out.npz", resume=True, overwrite=True)
    with refused("checkpoint must be above 0"):
        sim().run(1, record=tmp_path / "out.npz", resume=True, checkpoint=0)
    with refused("checkpoint must be a whole number"):
        sim().run(1, record=tmp_path / "out.npz", checkpoint=1.5)
    with pytest.raises(ValueError, match="says only"):
        ended = tmp_path / "out.usda"
        resume.Checkpoints(sim(), ended, None, {}).start(overwrite=False)
        ps.Simulation.load(resume.checkpoint_path(ended), small(), device="cpu")


# Disks ------------------------------------------------------------------------------------------


def test_a_full_disk_costs_no_finished_frame(suffix, tmp_path, monkeypatch, refused):
    if suffix == ".gsd":
        pytest.skip("grows in place; see the test with a limit")
    path, count, replace = tmp_path / f"out{suffix}", [0], os.replace

    def full(source, target, *arguments, **options):
        if Path(target).name.startswith("f.") and not count[0] < 5:
            raise OSError(errno.ENOSPC, "No space left on device")
        count[0] += Path(target).name.startswith("f.")
        return replace(source, target, *arguments, **options)

    stopped = sim()
    with monkeypatch.context() as patch:
        patch.setattr(os, "replace", full)
        with refused("writable, got .*No space left on device.*kept", OSError):
            stopped.run(50, record=path, checkpoint=2)
    # Two frames may be on their way when the third finds out.
    assert stopped.frame <= 7
    assert sorted(frames_of(path)) == [f"f.{k:06d}{Path(n).suffix}" for k, n in
                                       enumerate(sorted(frames_of(path)))]  # fmt: skip
    assert len(frames_of(path)) == 5
    assert not [each for each in path.parent.rglob("*.tmp*")]
    sim().run(8, record=path, resume=True)
    sim().run(8, record=tmp_path / f"whole{suffix}")
    assert frames_of(path) == frames_of(tmp_path / f"whole{suffix}")


@pytest.mark.skipif(not Path("/proc/self").is_dir(), reason="a folder that nobody can write to")
def test_a_folder_that_cannot_be_written(suffix, refused):
    run = sim()
    with refused("must be writable, got .*choose another folder", OSError):
        run.run(3, record=f"/proc/self/out{suffix}")
    with refused("must be writable, got .*choose another folder", OSError):
        run.run(3, record=f"/proc/self/out{suffix}", checkpoint=0)


def test_memory_does_not_grow(suffix, tmp_path):
    # A frame of 5000 particles is 180 kB or more; 100 frames that stayed would be 18 MB.
    scene = ps.Scene()
    scene.add_particles(np.random.default_rng(0).normal(size=(5000, 3)), velocity=(1, 2, 3))
    run = ps.Simulation(scene, ps.Settings(dt=0.01, substeps=1), device="cpu")
    sizes = []

    def measure(done, frames):
        if done % 50 == 0:
            pages = int(Path("/proc/self/statm").read_text().split()[1])
            sizes.append(pages * resource.getpagesize())

    run.run(150, record=tmp_path / f"out{suffix}", checkpoint=50, progress=measure)
    assert sizes[2] - sizes[0] < 9e6


# When checkpoints come --------------------------------------------------------------------------


def test_checkpoints_by_number(tmp_path, monkeypatch):
    at, write = [], checkpoint.write
    monkeypatch.setattr(
        checkpoint, "write", lambda made, path: (at.append(made.header["frame"]), write(made, path))
    )
    sim().run(8, record=tmp_path / "out.npz", checkpoint=3)
    assert at == [0, 0, 3, 6, 8]  # the arguments; the first frame; every third; the end


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
