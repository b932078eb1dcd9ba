"""A disk that runs full in the middle of a run: the frames before are a recording, with its end."""

import os
import shutil
import subprocess

import numpy as np
import pytest

from particlesim.output.lock import Lock, lock_path

from .runs import Ended, assert_same_root, end_at, frames_of, sim


@pytest.fixture
def disk(tmp_path):
    """A folder with a disk of its own, of 400 kB."""
    folder = tmp_path / "disk"
    folder.mkdir()
    words = ["mount", "-t", "tmpfs", "-o", "size=400k", "tmpfs", str(folder)]
    if not shutil.which("mount") or subprocess.run(words, capture_output=True).returncode:
        pytest.skip("needs the right to mount")
    yield folder
    subprocess.run(["umount", "-l", str(folder)], check=True)


# With larger or smaller pieces left at the end.
@pytest.mark.parametrize("ballast", [0, 2_000, 5_000])
def test_what_was_written_is_a_recording(suffix, disk, tmp_path, refused, ballast):
    path = disk / f"out{suffix}"
    (disk / "ballast").write_bytes(bytes(ballast))
    with refused("writable, got .*(No space|no room|Unable|File write failed).*kept", OSError):
        sim().run(2000, record=path, checkpoint=10)
    assert not lock_path(path).exists() and not list(disk.rglob("*.tmp*"))
    count = len(frames_of(path))
    assert 3 < count < 2000
    whole = tmp_path / f"out{suffix}"
    with pytest.raises(Ended):  # one that ended there, with the same plan
        sim().run(2000, record=whole, progress=end_at(count - 1))
    assert frames_of(path) == frames_of(whole)
    assert_same_root(path, whole)
    if suffix == ".npz":
        assert np.load(path)["last"] == count - 1
    (disk / "ballast").unlink()


@pytest.mark.parametrize("system", ["linux", "another"])
def test_room_is_held_and_given_back(disk, system, monkeypatch):
    if system == "another":
        monkeypatch.delattr(os, "posix_fallocate")
    used = lambda: shutil.disk_usage(disk).used  # noqa: E731
    with Lock("Test", disk / "out.usda") as lock:
        lock.reserve(50_000)
        assert used() > 100_000
        lock.reserve(60_000)  # there is room for that
        assert used() < 120_000
        with pytest.raises(OSError, match=r"Test: .*out\.usda' must be writable, got .*No space"):
            lock.reserve(300_000)
        lock.free()
        assert used() < 20_000 and lock.path.read_bytes().startswith(b"process ")
