"""Histories survive a crash and are resumed; other files are refused."""

import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

import particlesim as ps
from particlesim.output.history.writer import History, read_history

from .oscillations import fluid, oscillation

# Files


def test_a_last_line_that_is_cut_off_is_left_out(tmp_path):
    path = tmp_path / "out.csv"
    oscillation(worlds=2).run(3, history=path)
    whole, content = read_history(path), path.read_bytes()
    lines = content.splitlines(keepends=True)
    for cut in range(len(lines[-1]) + len(lines[-2])):
        path.write_bytes(content[: len(content) - cut])
        record = read_history(path)
        frames = 4 if cut == 0 else 3
        assert len(record.frame) == frames
        np.testing.assert_array_equal(record["energy"], whole["energy"][:frames])


def test_resuming_drops_what_comes_again(tmp_path):
    straight, broken = tmp_path / "straight.csv", tmp_path / "broken.csv"
    oscillation(worlds=2).run(6, history=straight)
    sim = oscillation(worlds=2)
    sim.run(5, history=broken)
    with open(broken, "ab") as file:
        file.write(b"5,0.5,0,0.1")  # killed within a line
    sim = oscillation(worlds=2)
    for _ in range(3):
        sim.step()
    with History(sim, broken, resume=True) as history:
        history.write()
        while sim.frame < 6:
            sim.step()
            history.write()
    assert broken.read_bytes() == straight.read_bytes()
    assert sorted(file.name for file in tmp_path.iterdir()) == ["broken.csv", "straight.csv"]


def test_a_resumed_run_has_the_history_of_one_that_was_not_broken(tmp_path):
    def go(folder, **options):
        folder.mkdir(exist_ok=True)
        sim = ps.Simulation(fluid(), device="cpu")
        files = {"record": folder / "out.usda", "history": folder / "out.csv"}
        sim.run(7, **files, checkpoint=3, **options)

    def stop(frame, frames):
        if frame == 5:
            raise KeyboardInterrupt

    go(tmp_path / "straight")
    with pytest.raises(KeyboardInterrupt):
        go(tmp_path / "broken", progress=stop)
    assert len(read_history(tmp_path / "broken" / "out.csv").frame) == 6
    go(tmp_path / "broken", resume=True)
    straight, broken = (
        (tmp_path / name / "out.csv").read_bytes() for name in ("straight", "broken")
    )
    assert straight == broken


def test_resuming_another_simulation_is_refused(tmp_path, refused):
    path = tmp_path / "out.csv"
    oscillation(worlds=2).run(1, history=path)
    before = path.read_bytes()
    with refused("hold 1 worlds"):
        History(oscillation(), path, resume=True)
    with (
        refused("hold mass"),
        History(ps.Simulation([fluid(), fluid()], device="cpu"), path, resume=True) as history,
    ):
        history.write()
    assert path.read_bytes()[:100] == before[:100]


def test_killed_at_any_moment_every_finished_line_reads(tmp_path):
    path = tmp_path / "out.csv"
    code = (
        f"import sys; sys.path.insert(0, {os.path.dirname(__file__)!r})\n"
        "from oscillations import oscillation\n"
        f"oscillation(worlds=20).run(10**6, history={str(path)!r})"
    )
    process = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.DEVNULL)
    try:
        while not path.exists() or path.stat().st_size < 50_000:
            assert process.poll() is None
            time.sleep(0.01)
    finally:
        process.send_signal(signal.SIGKILL)
        process.wait()
    record = read_history(path)
    assert record.world_count == 20
    np.testing.assert_array_equal(record.frame, np.arange(len(record.frame)))
    assert len(record.frame) >= 1 and np.isfinite(record["energy"]).all()


def test_files_that_cannot_be_written(tmp_path, refused):
    sim = oscillation()
    with refused("end in .csv, .jsonl"):
        sim.run(1, history=tmp_path / "out.npz")
    with pytest.raises(FileNotFoundError, match="existing folder"):
        sim.run(1, history=tmp_path / "none" / "out.csv")
    (tmp_path / "out.csv").write_text("mine")
    with pytest.raises(FileExistsError, match="new file"):
        sim.run(1, history=tmp_path / "out.csv")
    assert (tmp_path / "out.csv").read_text() == "mine" and sim.frame == 0
    sim.run(1, history=tmp_path / "out.csv", overwrite=True)
    assert len(read_history(tmp_path / "out.csv").frame) == 2


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="needs a device that is full")
def test_a_full_disk_is_a_clear_error(tmp_path):
    (tmp_path / "out.csv").symlink_to("/dev/full")
    with pytest.raises(OSError, match="No space left"):
        oscillation().run(1, history=tmp_path / "out.csv", overwrite=True)


@pytest.mark.parametrize("content", ["a,b\n1,2\n", "frame,time,world\nx,y,z\n", "{}\n"])
@pytest.mark.parametrize("suffix", [".csv", ".jsonl"])
def test_files_that_are_no_histories(tmp_path, refused, content, suffix):
    path = tmp_path / f"out{suffix}"
    path.write_text(content)
    if (suffix, content) == (".csv", "{}\n"):
        assert len(read_history(path).frame) == 0  # a heading without lines
        return
    with refused("be a history"):
        read_history(path)
