"""The command ``particlesim tune``."""

import subprocess
import sys


def test_command(tmp_path):
    scene = tmp_path / "swing.py"
    scene.write_text(
        "import particlesim as ps\n"
        "settings, frames = ps.Settings(dt=0.1), 4\n"
        "def build(stiffness: float = 100.0):\n"
        "    scene = ps.Scene()\n"
        "    scene.add_particles([(0, 0, 0)], pinned=True)\n"
        "    scene.add_particles([(1.2, 0, 0)])\n"
        "    scene.add_interaction(ps.Springs([(0, 1)], stiffness, 1.0))\n"
        "    return scene\n"
    )
    command = [sys.executable, "-m", "particlesim.cli", "tune", str(scene), "--device", "cpu"]
    done = subprocess.run(
        [*command, "--error", "1e-3", "--set", "stiffness=50", "--vary", "precision=float64"],
        capture_output=True, text=True, timeout=120, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "ps.Settings(dt=0.1, substeps=" in done.stdout and "float64" in done.stdout
    assert "build(stiffness=50)" in done.stdout
    assert "substeps=" in done.stderr  # the trials
    done = subprocess.run(
        [*command, "--by", "guess"], capture_output=True, text=True, timeout=120, check=False
    )
    assert done.returncode == 2 and done.stderr.count("\n") == 1
    done = subprocess.run(
        [*command, "--budget", "1 ms", "--observe", "velocity", "--over", "final"],
        capture_output=True, text=True, timeout=120, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert (
        "a run of" in done.stdout and "of velocity" in done.stdout and "at the end" in done.stdout
    )
