"""Two writers of one output: the second is refused, and told who the first is."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from particlesim import cli
from particlesim.output.lock import Lock, OutputBusy, lock_path
from particlesim.output.recorders import open_recorder

from .runs import FORMATS, NEEDS, frames_of, sim

SCENE = """
import particlesim as ps
settings = ps.Settings(dt=0.1)
def build():
    raise RuntimeError("built")
"""


@pytest.fixture(scope="module")
def twins():
    program = [sys.executable, str(Path(__file__).parent / "twins.py")]
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
    started = [subprocess.Popen(program, **pipes) for _ in range(2)]
    for each in started:
        while (line := each.stdout.readline().strip()) != "ready":
            assert line, "a twin has ended"
    yield started
    for each in started:
        each.stdin.close()
        each.wait(timeout=20)


def together(twins, path, frames, **options):
    """Both write at once; expect that one does, and that the other names it."""
    for each in twins:
        order = {"path": str(path), "frames": frames, "options": options}
        each.stdin.write(json.dumps(order) + "\n")
    for each in twins:
        each.stdin.flush()
    answers = [json.loads(each.stdout.readline()) for each in twins]
    (winner,) = [each for each in answers if not each["error"]]
    (loser,) = [each for each in answers if each["error"]]
    assert loser["error"].startswith("OutputBusy: Simulation.run: record must be written by one")
    assert f"which process {winner['pid']} on " in loser["error"]
    assert not lock_path(path).exists()
    return frames_of(path)


def often(twins, folder, suffix, tries):
    """Anew, resumed and overwritten, in turn."""
    if suffix in NEEDS:
        pytest.importorskip(NEEDS[suffix])
    for k in range(tries):
        options = [{}, {"resume": True}, {"overwrite": True}][k % 3]
        frames = 8 if k % 3 == 1 else 4  # what is resumed goes on
        found = together(twins, folder / f"out{k // 3}{suffix}", frames, **options)
        assert len(found) == frames + 1


def test_of_two_that_start_together_one_writes(twins, tmp_path):
    often(twins, tmp_path, ".usda", 3)


@pytest.mark.slow
@pytest.mark.parametrize("kind", FORMATS)
def test_of_two_that_start_together_one_writes_every_time(twins, tmp_path, kind):
    often(twins, tmp_path, kind, 21)


def test_every_way_of_writing_is_refused(suffix, tmp_path, refused):
    path = tmp_path / f"out{suffix}"
    told = f"by one run at a time, got .*out{suffix}', which process {os.getpid()} on .* is writing"
    sim().run(2, record=path)
    before = frames_of(path)
    with Lock("Test", path):
        for options in ({}, {"overwrite": True}, {"resume": True}, {"checkpoint": 0}):
            with refused(told, OutputBusy):
                sim().run(4, record=path, **options)
        with refused(told, OutputBusy), open_recorder(sim(), path, overwrite=True) as recorder:
            recorder.write()
        with refused("history must be written by one run", OutputBusy):
            sim().run(1, history=tmp_path / "out.csv")
    assert frames_of(path) == before
    with open_recorder(sim(), path, overwrite=True) as first:
        first.write()
        with refused(told, OutputBusy):
            sim().run(4, record=path, overwrite=True)
    sim().run(2, record=path, overwrite=True, history=tmp_path / "out.csv")
    assert not lock_path(path).exists()


def test_from_the_command_line(tmp_path, capsys):
    scene, out = tmp_path / "scene.py", tmp_path / "out.usda"
    scene.write_text(SCENE)
    words = ["run", str(scene), "--out", str(out)]
    with Lock("Test", out):
        for more in ([], ["--overwrite"], ["--resume"], ["--history", str(tmp_path / "out.csv")]):
            assert cli.main([*words, *more]) == 2
            *_, line = capsys.readouterr().err.splitlines()
            assert line.startswith("error: run: --out must be written by one run at a time")
            assert f"which process {os.getpid()} on " in line
    assert cli.main(words) == 1 and "built" in capsys.readouterr().err


def test_a_lock_of_the_dead_does_not_hold(tmp_path):
    path = tmp_path / "out.usda"
    program = (
        "import os, pathlib, sys\nfrom particlesim.output import files, lock\n"
        f"held = lock.Lock('Test', pathlib.Path({str(path)!r}))\n"
        f"with files.whole('Test', pathlib.Path({str(path)!r})) as part:\n"
        "    part.write_text('half')\n    os.kill(os.getpid(), 9)\n"
    )
    assert subprocess.run([sys.executable, "-c", program], check=False).returncode == -9
    assert lock_path(path).read_text().startswith("process ")
    (half,) = tmp_path.glob("*.tmp.usda")
    with Lock("Test", path):
        assert not half.exists()
    assert os.listdir(tmp_path) == []


def test_a_place_without_room_for_a_lock(tmp_path, refused):
    with refused("record must be in an existing folder", FileNotFoundError):
        sim().run(1, record=tmp_path / "none" / "out.usda")
    with refused("must be writable, got .*choose another folder", OSError):
        sim().run(1, history=Path("/proc/self/out.csv"))
