"""A plain checkout, not installed, can be imported by whoever stands in it."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]
SCRIPT = """
import pathlib
import particlesim as ps
import particlesim.kernels.precision
import particlesim.scenes.pendulum as scene
here = pathlib.Path.cwd()
for module in (ps, particlesim.kernels, particlesim.kernels.precision, scene):
    assert pathlib.Path(module.__file__).is_relative_to(here), module.__file__
print(len(scene.build().position))
"""


def test_a_script_in_a_fresh_checkout(tmp_path):
    for folder in ("particlesim", "kernels", "scenes"):
        shutil.copytree(ROOT / folder, tmp_path / folder)
    (tmp_path / "script.py").write_text(SCRIPT)
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    for command in (["-c", SCRIPT], ["script.py"]):
        done = subprocess.run(
            [sys.executable, *command], cwd=tmp_path, env=environment, capture_output=True,
            text=True,
        )  # fmt: skip
        assert done.returncode == 0, done.stderr
        assert done.stdout.splitlines()[-1] == "2"


def test_importing_loads_nothing_that_is_not_used():
    """Warp, USD and pictures come with the first name that needs them."""
    script = """
import sys
import particlesim as ps
heavy = {"warp", "numpy", "pxr", "matplotlib", "PIL", "rich"}
assert not heavy & sys.modules.keys(), heavy & sys.modules.keys()
ps.Simulation
assert not {"pxr", "matplotlib", "PIL"} & sys.modules.keys()
"""
    subprocess.run([sys.executable, "-c", script], check=True, cwd=ROOT)
