"""What the documentation shows works: examples of docstrings, and the README's code."""

import doctest
import importlib
import pkgutil
import re
from pathlib import Path

import numpy as np
import pytest
import warp as wp

import particlesim as ps

README = (Path(__file__).parent.parent / "README.md").read_text(encoding="utf-8")
MODULES = sorted(
    module.name
    for module in pkgutil.walk_packages(ps.__path__, "particlesim.")
    if ".kernels" not in module.name and ".scenes" not in module.name
)


@pytest.mark.parametrize("name", MODULES)
def test_examples_of_docstrings(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # some write files
    module = importlib.import_module(name)
    monkeypatch.setattr(wp.config, "log_level", wp.LOG_WARNING)
    names = {name: getattr(ps, name) for name in ps.__all__}
    found = doctest.testmod(module, extraglobs={"wp": wp, "np": np, **names})
    assert found.failed == 0


def test_public_classes_have_docstrings():
    for name in ps.__all__:
        thing = getattr(ps, name)
        assert thing.__doc__, name


def blocks():
    """The README's Python blocks."""
    return re.findall(r"```python\n(.*?)```", README, flags=re.DOTALL)


def test_the_ten_lines_of_the_readme(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (code,) = [block for block in blocks() if "import particlesim" in block]
    code = code.replace("frames=120", "frames=1").replace("progress=True", "progress=False")
    exec(code.replace("spacing=0.025", "spacing=0.1"), {})
    assert (tmp_path / "dam_break.usda").exists()


def test_the_blocks_of_the_readme_run_one_after_the_other(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    names = {"__name__": "readme"}
    for number, code in enumerate(blocks()):
        code = code.replace("frames=120", "frames=1").replace("progress=True", "progress=False")
        path = tmp_path / f"block_{number}.py"  # a law needs its source
        path.write_text(code.replace("spacing=0.025", "spacing=0.1"))
        exec(compile(path.read_text(), path, "exec"), names)
        # And what they made of it runs.
        ps.Simulation(names["scene"], ps.Settings(dt=0.01), device="cpu").step()
    assert names["sim"].world_count == 1024


def law_source(name):
    """A law of the README as a file's worth of source."""
    (block,) = [block for block in blocks() if f"def {name}(" in block]
    return re.search(r"(@ps\.law\ndef .*?)\n\n", block, flags=re.DOTALL).group(1)


def readme_law(name, folder):
    """The law itself; Warp reads sources from files, so it gets one."""
    path = folder / f"{name}_law.py"
    path.write_text(f"import warp as wp\nimport particlesim as ps\n\n\n{law_source(name)}\n")
    spec = importlib.util.spec_from_file_location(path.stem, path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return getattr(module, name)


def test_the_force_of_the_readme(tmp_path, device):
    yukawa = readme_law("yukawa", tmp_path)
    scene = ps.Scene()
    ions = scene.add_particles([(0, 0, 0), (1, 0, 0)], charge=[1.0, -2.0])
    scene.add_interaction(ps.PairPotential(yukawa, ions, cutoff=5.0, screening=0.7))
    sim = ps.Simulation(scene, ps.Settings(precision="float64"), device=device)
    sim.forces(0.1)
    # u = q q exp(-r/s)/r, so F = -u' = q q exp(-r/s) (1/r^2 + 1/(s r)) at r = 1.
    expected = -2.0 * np.exp(-1 / 0.7) * (1 + 1 / 0.7)
    np.testing.assert_allclose(sim.get("force")[1, 0], expected, rtol=1e-12)


def test_the_constraint_of_the_readme(tmp_path, device):
    volume = readme_law("volume", tmp_path)
    scene = ps.Scene()
    corners = scene.add_particles([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)])
    scene.add_constraint(
        ps.Constraint(volume, particles=[list(corners)], rest=0.25, compliance=1e-9)
    )
    settings = ps.Settings(dt=0.01, substeps=20, precision="float64")
    sim = ps.Simulation(scene, settings, device=device)
    sim.step()
    a, b, c, d = sim.position
    assert np.dot(np.cross(b - a, c - a), d - a) / 6 == pytest.approx(0.25, rel=1e-3)


def test_the_boundary_of_the_readme(tmp_path, device):
    torus = readme_law("torus", tmp_path)
    scene = ps.Scene()
    scene.add_particles([(1.05, 0.4, 0)], radius=0.05)  # above the tube, where it is not steep
    scene.add_interaction(ps.UniformGravity((0, -10, 0)))
    scene.add_constraint(ps.Boundary(torus, friction=0.3, ring=1.0, tube=0.2))
    sim = ps.Simulation(scene, ps.Settings(precision="float64"), device=device)
    sim.run(60)
    x, y, z = sim.position[0]
    # At rest on the tube, its radius away, up to the way g dt^2 of a substep.
    assert np.hypot(np.hypot(x, z) - 1.0, y) == pytest.approx(0.25, abs=10 / 600**2)


@pytest.mark.parametrize("mark", ["run command", "test command"])
def test_the_readme_has_its_commands(mark):
    command = re.search(rf"<!-- {mark} -->\n```\w*\n(.*?)\n```", README)
    assert command and "\n" not in command.group(1)
