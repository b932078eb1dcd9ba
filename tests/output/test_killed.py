"""Runs killed at random instants, and runs whose disk is full: nothing finished is lost."""

import json
import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from pxr import Usd, UsdGeom

from particlesim.simulation import resume

from .kill_nursery import swing
from .runs import NEEDS, frames_of


class Nursery:
    """Children to be killed, from a warm process (see kill_nursery)."""

    def __init__(self):
        self.process = subprocess.Popen(
            [sys.executable, str(Path(__file__).parent / "kill_nursery.py")],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
        )  # fmt: skip
        while self._answer() != "ready":
            pass

    def _answer(self):
        line = self.process.stdout.readline()
        assert line, "the nursery has ended"
        return line.strip()

    def run(self, path, frames, kill_after=None, limit=None, **options):
        """Run a child; with a time, kill -9 it then. Returns its exit status."""
        order = {"path": str(path), "frames": frames, "limit": limit, "options": options}
        self.process.stdin.write(json.dumps(order) + "\n")
        self.process.stdin.flush()
        pid = int(self._answer())
        if kill_after is not None:
            time.sleep(kill_after)
            # It is waited for only after this, so that the number is still its own.
            if Path(f"/proc/{pid}").exists():
                os.kill(pid, signal.SIGKILL)
        return int(self._answer())

    def close(self):
        self.process.stdin.close()
        self.process.wait(timeout=20)


@pytest.fixture(scope="module")
def nursery():
    if not hasattr(os, "fork"):
        pytest.skip("needs fork")
    nursery = Nursery()
    yield nursery
    nursery.close()


# In the middle of a frame, and where what leads to the frames is moved to a larger place.
@pytest.mark.parametrize("limit", [40_000, 60_000, 110_000])
def test_a_gsd_file_that_cannot_grow(tmp_path, nursery, limit, capfd):
    gsd = pytest.importorskip("gsd.hoomd")
    whole, path = tmp_path / "whole.gsd", tmp_path / "out.gsd"
    assert nursery.run(whole, 40, checkpoint=0) == 0
    assert nursery.run(path, 40, limit=limit, checkpoint=3) == 1
    reference, found = frames_of(whole), frames_of(path)
    with gsd.open(str(path)) as file:
        assert 5 < len(file) == len(found) < 40
    assert all(content == reference[name] for name, content in found.items())
    assert path.stat().st_size <= limit
    assert nursery.run(path, 40, resume=True, checkpoint=3) == 0
    assert frames_of(path) == reference


def assert_readable(path, reference, count):
    """Whatever is there of a killed run is whole, and what the whole run has; returns how much."""
    if path.suffix == ".gsd":
        return assert_readable_gsd(path, reference)
    found = frames_of(path)
    assert sorted(found) == sorted(reference)[: len(found)]  # no gap
    for name, content in found.items():
        assert content == reference[name], name
    if path.suffix == ".usda" and path.exists():
        stage = Usd.Stage.Open(str(path))
        clouds = [UsdGeom.Points(prim) for prim in stage.Traverse() if prim.IsA(UsdGeom.Points)]
        for frame in range(len(found)):
            points = [np.asarray(cloud.GetPointsAttr().Get(frame)) for cloud in clouds]
            assert sum(map(len, points)) == count and all(np.isfinite(x).all() for x in points)
    if path.suffix == ".vtkhdf" and path.exists():
        import h5py

        with h5py.File(path) as file:
            shown = int(file["VTKHDF/Steps"].attrs["NSteps"])
            points = file["VTKHDF/Points"][:]
        assert shown <= len(found) and len(points) == shown * count
    if path.suffix == ".npz" and path.exists():
        np.load(path)
    return len(found)


def assert_readable_gsd(path, reference):
    """All frames but, it may be, the last one, which was being written."""
    import gsd.hoomd

    if not path.exists():
        return 0
    with gsd.hoomd.open(str(path)) as file:
        count = len(file)
    finished = [str(k) for k in range(max(0, count - 1))]
    found = frames_of(path)
    assert all(found[step] == reference[step] for step in finished)
    return len(finished)


def kill_and_resume(nursery, folder, suffix, kills, seed):
    """Kill runs at random instants until it is done; check frames and results every time."""
    rng, frames, options = random.Random(seed), 30, {"checkpoint": 3}
    whole = folder / f"whole{suffix}"
    assert nursery.run(whole, frames, **options) == 0
    started = time.perf_counter()
    assert nursery.run(whole, frames, overwrite=True, **options) == 0
    lasts = time.perf_counter() - started
    reference, count = frames_of(whole), swing().particle_count
    with np.load(resume.checkpoint_path(whole)) as file:
        end = {name: file[name].tobytes() for name in file.files if name != "header"}
    done = {"kills": 0, "runs": 0, "kept": []}
    while done["kills"] < kills:
        path = folder / f"run{done['runs']}{suffix}"
        going_on = False
        while done["kills"] < kills:
            status = nursery.run(
                path, frames, kill_after=rng.uniform(0, 1.1 * lasts), resume=going_on, **options
            )
            going_on = True
            if status == 0:
                break
            assert status == -signal.SIGKILL
            done["kills"] += 1
            done["kept"].append(assert_readable(path, reference, count))
            if rng.random() < 0.5:  # else the resumed run is killed too
                break
        assert nursery.run(path, frames, resume=True, **options) == 0
        assert frames_of(path) == reference
        assert_readable(path, reference, count)
        with np.load(resume.checkpoint_path(path)) as file:
            assert end == {name: file[name].tobytes() for name in file.files if name != "header"}
        done["runs"] += 1
    return done


def test_killed_at_random_instants(nursery, tmp_path):
    done = kill_and_resume(nursery, tmp_path, ".usda", kills=5, seed=1)
    assert done["kills"] == 5


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "kills"), [(".usda", 100), (".npz", 25), (".ply", 25), (".gsd", 100), (".vtkhdf", 25)]
)
def test_killed_very_often(nursery, tmp_path, kind, kills, capsys):
    if kind in NEEDS:
        pytest.importorskip(NEEDS[kind])
    done = kill_and_resume(nursery, tmp_path, kind, kills, seed=2)
    assert done["kills"] == kills
    with capsys.disabled():
        kept = done["kept"]
        print(
            f"\n{kind}: {done['kills']} kills in {done['runs']} runs; frames on disk at the kill: "
            f"{min(kept)} to {max(kept)}, {sum(k == 0 for k in kept)} before the first"
        )
