"""A scene is run for the first time: something is seen at once, and then what to do next."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from particlesim import cli

ROOT = Path(cli.__file__).parent.parent

# The command line without what the package itself may load.
ALONE = f"""
import sys, types
package = types.ModuleType("particlesim")
package.__path__ = [{str(ROOT / "particlesim")!r}, {str(ROOT)!r}]
sys.modules["particlesim"] = package
from particlesim import cli
"""


def python(code, *arguments, **environment):
    """Run code in a process of its own, to which stderr is a terminal."""
    return subprocess.run(
        [sys.executable, "-c", code, *arguments], capture_output=True, text=True, check=False,
        timeout=300, env={**os.environ, "FORCE_COLOR": "1", "COLUMNS": "160", **environment},
    )  # fmt: skip


@pytest.mark.parametrize("words", [["--help"], ["run", "--help"], ["--version"], ["list"]])
def test_what_needs_no_scene_loads_neither_warp_nor_usd(words):
    done = python(
        ALONE + f"assert cli.main({words}) == 0\n"
        "heavy = {'warp', 'pxr', 'matplotlib'} & set(sys.modules)\n"
        "assert not heavy, heavy\n"
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout


WATCH = """
class Watch:
    def find_spec(self, name, path=None, target=None):
        if name == "warp":
            print("(Warp comes)", file=sys.__stderr__, flush=True)

sys.meta_path.insert(0, Watch())
cli.main(["run", sys.argv[1]])
"""


def test_something_is_shown_before_warp_is_there(scene_file):
    shown = python(ALONE + WATCH, scene_file("pass")).stderr
    assert 0 <= shown.find("tiny.py: loading") < shown.find("(Warp comes)")


def test_a_first_run(falling, tmp_path):
    # With an empty cache, so that all kernels are compiled.
    out = tmp_path / "the fall.usda"
    words = ["run", falling, "--device", "cpu", "--out", str(out)]
    code = f"from particlesim import cli; raise SystemExit(cli.main({words}))"
    done = python(code, WARP_CACHE_PATH=str(tmp_path / "cache"), PYTHONPATH=str(ROOT))
    assert done.returncode == 0, done.stderr
    stages = ["loading", "building", "preparing 1 particles", "falling: compiling", "0/2", "2/2"]
    found = [done.stderr.find(stage) for stage in stages]
    assert -1 not in found and found == sorted(found), done.stderr
    for said in (done.stderr, done.stdout):
        assert "Warp" not in said and "Module" not in said and "CUDA" not in said
    lines = done.stdout.splitlines()
    assert lines[0].startswith("falling: 2 frames of 1 particles") and str(out) in lines[0]
    assert [line.split("particlesim ")[1] for line in lines[1:]] == [
        f"render '{out}' --out '{tmp_path / 'the fall.mp4'}'", f"view '{out}'"
    ]  # fmt: skip


def test_what_to_do_next_is_said_only_to_people_who_have_a_recording(
    engine, scene_file, tmp_path, capsys, monkeypatch
):
    def said(*words):
        assert cli.main(["run", scene_file(), *words]) == 0
        return capsys.readouterr().out.splitlines()

    assert len(said("--out", str(tmp_path / "a.usdc"))) == 1  # into a pipe
    monkeypatch.setenv("FORCE_COLOR", "1")
    assert len(said("--out", str(tmp_path / "b.usdc"))) == 3
    assert len(said("--out", str(tmp_path / "c.npz"))) == 1  # nothing draws it
    assert len(said()) == 1
