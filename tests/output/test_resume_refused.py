"""What cannot be resumed is refused, and a full disk costs no finished frame."""

import errno
import os
import resource
from pathlib import Path

import numpy as np
import pytest

import particlesim as ps
from particlesim.simulation import resume

from .runs import Ended, end_at, frames_of, sim, small

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
