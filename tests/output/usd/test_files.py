"""Files of a USD recording: replaced only if asked, and whole whatever ends their writer."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
import warp as wp
from pxr import Sdf, Tf, Usd

from particlesim.output.usd.description import StageInfo
from particlesim.output.usd.writing.writer import UsdWriter

from .recordings import (
    complaints,
    folder_content,
    group,
    motion,
    opened,
    points_at,
    record,
)


def test_warp_arrays_are_taken(tmp_path):
    path = tmp_path / "out.usda"
    position, velocity = motion(1)
    with UsdWriter(path, StageInfo(points=[group()])) as recorder:
        arrays = (wp.array(a[0], dtype=wp.vec3, device="cpu") for a in (position, velocity))
        recorder.write(0, *arrays)
    np.testing.assert_array_equal(points_at(opened(path), "/World/env_0000/water", 0), position[0])


def test_existing_output_is_refused_and_kept(tmp_path):
    path, info = tmp_path / "out.usda", StageInfo(points=[group()], frames=5)
    position, _ = record(path, info, frames=5)
    with pytest.raises(
        FileExistsError, match=r"^UsdRecorder: path must be a new file, .*overwrite=True\.$"
    ):
        UsdWriter(path, info)
    with pytest.raises(FileExistsError, match="share its frames"):
        UsdWriter(tmp_path / "out.usdc", info, overwrite=True)
    # Nothing is lost either while a new recording has no frame yet.
    UsdWriter(path, info, overwrite=True).close()
    np.testing.assert_array_equal(points_at(opened(path), "/World/env_0000/water", 4), position[4])


def test_overwriting_leaves_no_stale_frame(tmp_path):
    path, info = tmp_path / "out.usda", StageInfo(points=[group()], frames=5)
    record(path, info, frames=5)
    (tmp_path / "out.clips" / "notes.txt").write_text("not ours")
    (tmp_path / "out.clips" / "f.000005.tmp.usdc").write_text("half a frame")
    record(path, info, frames=2, overwrite=True)
    assert opened(path).GetEndTimeCode() == 1
    assert folder_content(tmp_path / "out.clips") == {
        "f.000000.usdc",
        "f.000001.usdc",
        "manifest.usda",
        "notes.txt",
    }


def test_unusable_paths_are_refused(tmp_path):
    info = StageInfo(points=[group()])
    with pytest.raises(
        FileNotFoundError, match=r"^UsdRecorder: path must be in an existing folder"
    ):
        UsdWriter(tmp_path / "missing" / "out.usda", info)
    with pytest.raises(ValueError, match=r"^UsdRecorder: path must end in \.usda, \.usd, \.usdc"):
        UsdWriter(tmp_path / "out.abc", info)


def test_interrupted_recording_can_be_read(tmp_path):
    path = tmp_path / "out.usda"
    position, velocity = motion(3)
    recorder = UsdWriter(path, StageInfo(points=[group()], frames=10))
    for frame in range(3):
        recorder.write(frame, position[frame], velocity[frame])
        # The planned end reaches past the files, which are there as soon as write returns.
        stage = opened(path)
        assert stage.GetEndTimeCode() == 9
        for written in range(frame + 1):
            found = points_at(stage, "/World/env_0000/water", written)
            np.testing.assert_array_equal(found, position[written])
        del stage  # or the next one would be this one, from USD's cache


def test_an_exception_leaves_the_frames_so_far(tmp_path):
    path = tmp_path / "out.usda"
    position, velocity = motion(2)
    with (
        pytest.raises(KeyboardInterrupt),
        UsdWriter(path, StageInfo(points=[group()], frames=10)) as recorder,
    ):
        recorder.write(0, position[0], velocity[0])
        recorder.write(1, position[1], velocity[1])
        raise KeyboardInterrupt
    assert opened(path).GetEndTimeCode() == 1


@pytest.mark.skipif(os.name == "nt", reason="there is no kill -9 on Windows")
def test_killed_recording_can_be_read(tmp_path):
    script = """
import sys
import numpy as np
from particlesim.output.usd.writing.writer import UsdWriter
from particlesim.output.usd.description import PointsPrim, StageInfo

count = 50_000
drops = PointsPrim(0, "drops", slice(0, count), np.arange(count), 0.1, (1, 1, 1))
recorder = UsdWriter(sys.argv[1], StageInfo(points=[drops], frames=10_000))
for frame in range(10_000):
    recorder.write(frame, np.full((count, 3), frame), np.zeros((count, 3)))
"""
    path, clips = tmp_path / "out.usda", tmp_path / "out.clips"
    root = Path(__file__).parents[3]
    process = subprocess.Popen([sys.executable, "-c", script, str(path)], cwd=root)
    deadline = time.monotonic() + 60
    while not (clips / "f.000005.usdc").exists():
        assert process.poll() is None, "the recording ended by itself"
        assert time.monotonic() < deadline
        time.sleep(0.001)
    process.send_signal(signal.SIGKILL)
    process.wait()
    frames = sorted(int(f.name.split(".")[1]) for f in clips.glob("f.??????.usdc"))
    assert frames == list(range(len(frames)))
    stage = Usd.Stage.Open(str(path))
    assert complaints(stage) == []
    for frame in frames:
        np.testing.assert_array_equal(points_at(stage, "/World/env_0000/drops", frame), frame)


def test_more_frames_than_planned(tmp_path):
    path = tmp_path / "out.usda"
    position, velocity = motion(8)
    recorder = UsdWriter(path, StageInfo(points=[group()], frames=2))
    for frame in range(8):
        recorder.write(frame, position[frame], velocity[frame])
    # Readable already before the end is known.
    found = points_at(opened(path), "/World/env_0000/water", 7)
    np.testing.assert_array_equal(found, position[7])
    recorder.close()
    recorder.close()
    assert Sdf.Layer.OpenAsAnonymous(str(path)).endTimeCode == 7


def test_memory_does_not_grow_with_frames(tmp_path):
    position, velocity = motion(1)
    with UsdWriter(tmp_path / "out.usda", StageInfo(points=[group()], frames=50)) as recorder:
        recorder.write(0, position[0], velocity[0])
        layers = len(Sdf.Layer.GetLoadedLayers())
        for frame in range(1, 50):
            recorder.write(frame, position[0], velocity[0])
        assert len(Sdf.Layer.GetLoadedLayers()) == layers
        assert recorder._clip.ListAllTimeSamples() == [49]


@pytest.mark.parametrize(
    ("owner", "name", "error"),
    [
        (os, "replace", OSError(28, "No space left on device")),
        (Sdf.Layer, "Export", Tf.ErrorException()),
    ],
)
def test_a_write_that_fails_loses_no_frame(tmp_path, monkeypatch, owner, name, error):
    path = tmp_path / "out.usda"
    position, velocity = motion(2)

    def fail(*_):
        raise error

    with UsdWriter(path, StageInfo(points=[group()], frames=2)) as recorder:
        recorder.write(0, position[0], velocity[0])
        before = folder_content(tmp_path)
        monkeypatch.setattr(owner, name, fail)
        with pytest.raises(OSError, match=r"^UsdRecorder: .*f\.000001\.usdc' must be writable"):
            recorder.write(1, position[1], velocity[1])
        assert folder_content(tmp_path) == before
        monkeypatch.undo()
        recorder.write(1, position[1], velocity[1])
    np.testing.assert_array_equal(points_at(opened(path), "/World/env_0000/water", 1), position[1])
