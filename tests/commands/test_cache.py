"""A folder that Warp cannot keep its kernels in: one line, with the variable to set."""

import os
import shutil
import subprocess
import sys

import pytest


def failing(words, **environment):
    """What the program says in an environment without another cache."""
    kept = {k: v for k, v in os.environ.items() if k not in ("WARP_CACHE_PATH", "XDG_CACHE_HOME")}
    program = [sys.executable, "-m", "particlesim.cli", *words]
    done = subprocess.run(program, env={**kept, **environment}, capture_output=True, text=True)
    assert done.returncode in (1, 2)
    (line,) = done.stderr.splitlines()
    assert line.startswith("error: Warp: kernel cache must be in a folder that can be written, got")
    assert line.endswith("; set WARP_CACHE_PATH to another.")
    return done.returncode


@pytest.mark.parametrize("command", ["run", "explain"])
def test_a_home_that_cannot_be_written(falling, command):
    assert failing([command, falling, "--device", "cpu"], HOME=os.devnull) == 2


def test_a_cache_that_is_full_or_read_only(falling, tmp_path):
    import warp

    folder = tmp_path / "cache"
    (folder / warp.__version__).mkdir(parents=True)
    mount = ["mount", "-t", "tmpfs", "-o", "size=1m", "tmpfs", str(folder)]
    if not shutil.which("mount") or subprocess.run(mount, capture_output=True).returncode:
        pytest.skip("needs the right to mount")
    try:
        (folder / warp.__version__).mkdir()
        subprocess.run(["mount", "-o", "remount,ro", str(folder)], check=True)
        failing(["run", falling, "--device", "cpu"], WARP_CACHE_PATH=str(folder))
    finally:
        subprocess.run(["umount", "-l", str(folder)], check=True)
