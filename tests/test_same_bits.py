"""The same bits as an earlier commit: what was moved about or made faster changed no result.

    PARTICLESIM_BEFORE=<commit> pytest -m slow tests/test_same_bits.py

compares with that commit, by default with the one before this.
"""

import io
import json
import os
import subprocess
import sys
import tarfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
BEFORE = os.environ.get("PARTICLESIM_BEFORE", "HEAD~1")
# Run by itself, over a checkout of any age: the folders that are mapped into the package are found
# beside it, whether it looks for them itself or not.
SCRIPT = """
import hashlib, importlib.util, json, pathlib, sys
root = pathlib.Path(sys.argv[1])
class Mapped:
    def find_spec(name, path=None, target=None):
        if name in ("particlesim.kernels", "particlesim.scenes"):
            folder = root / name.rpartition(".")[2]
            return importlib.util.spec_from_file_location(
                name, folder / "__init__.py", submodule_search_locations=[str(folder)])
sys.meta_path.insert(0, Mapped)
sys.path.insert(0, str(root))
import particlesim as ps
assert pathlib.Path(ps.__file__).is_relative_to(root)
found = {"names": sorted(ps.__all__), "scenes": {}}
for path in sorted((root / "scenes").glob("[a-z]*.py")):
    module = importlib.import_module(f"particlesim.scenes.{path.stem}")
    for precision in ("float32", "float64"):
        settings = module.settings.replace(precision=precision)
        sim = ps.Simulation(module.build(), settings, device="cpu")
        for _ in range(10):
            sim.step()
        bits = sim.position.tobytes() + sim.velocity.tobytes()
        found["scenes"][f"{path.stem}, {precision}"] = hashlib.sha256(bits).hexdigest()
        sim.close()
print(json.dumps(found))
"""


def looked_at(root):
    """Public names of a checkout, and hashes of its ready scenes after ten frames."""
    command = [sys.executable, "-c", SCRIPT, str(root)]
    done = subprocess.run(command, capture_output=True, text=True, check=True, cwd=root)
    return json.loads(done.stdout.splitlines()[-1])


@pytest.mark.slow
def test_nothing_has_changed(tmp_path):
    archive = subprocess.run(["git", "archive", BEFORE], capture_output=True, cwd=ROOT)
    if archive.returncode:
        pytest.skip(f"there is no {BEFORE} to compare with")
    with tarfile.open(fileobj=io.BytesIO(archive.stdout)) as files:
        files.extractall(tmp_path, filter="data")
    before, now = looked_at(tmp_path), looked_at(ROOT)
    assert set(before["names"]) <= set(now["names"])
    same = {name: now["scenes"].get(name) for name in before["scenes"]}
    assert same == before["scenes"]
