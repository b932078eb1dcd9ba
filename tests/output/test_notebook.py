"""A notebook shows a bar, tables, pictures and plots of a run, and nothing else."""

import os
from pathlib import Path

import nbclient
import nbformat
import pytest

import particlesim

ROOT = Path(particlesim.__file__).parent.parent

RUN = """
import particlesim as ps
scene = ps.Scene()
scene.add_particles(ps.sample.box((0, 0, 0), (1, 1, 1), 0.25), radius=0.1)
scene.add_interaction(ps.UniformGravity((0, -9.81, 0)))
scene.add_constraint(ps.PlaneBoundary((0, -1, 0), (0, 1, 0)))
sim = ps.Simulation(scene, ps.Settings(ledger=True), device="cpu")
sim.run(200, progress=True)
"""
TABLES = ("sim.diagnostics()", "sim.explain()", "sim.stability()", "sim.ledger()")
PICTURES = ("sim", "sim.render(width=160, height=90)")
PLOT = """
import matplotlib.pyplot as plt
plt.plot(sim.position[:, 1])
plt.show()
"""


@pytest.fixture
def executed(tmp_path, monkeypatch):
    """A function of cells that gives the outputs of each, in a kernel of their own."""
    pytest.importorskip("matplotlib")
    pytest.importorskip("PIL")

    def execute(*cells):
        notebook = nbformat.v4.new_notebook()
        notebook.cells = [nbformat.v4.new_code_cell(cell) for cell in cells]
        # With an empty cache, so that kernels are compiled.
        folders = {
            name: str(tmp_path / name)
            for name in ("IPYTHONDIR", "JUPYTER_CONFIG_DIR", "JUPYTER_RUNTIME_DIR",
                         "WARP_CACHE_PATH")
        }  # fmt: skip
        for name, folder in folders.items():
            monkeypatch.setenv(name, folder)
        environment = {**os.environ, "PYTHONPATH": str(ROOT)}
        client = nbclient.NotebookClient(notebook, timeout=300, kernel_name="python3")
        client.execute(env=environment)
        return [cell.outputs for cell in notebook.cells]

    return execute


@pytest.mark.slow
def test_a_notebook_with_a_run_tables_pictures_and_a_plot(executed):
    run, *others, plot = executed(RUN, *TABLES, *PICTURES, PLOT)
    (bar,) = run  # one line, however often it was drawn
    assert bar.output_type == "display_data" and "<pre>run " in bar.data["text/html"]
    assert "200/200 frames 64 particles" in bar.data["text/plain"]
    assert "\n" not in bar.data["text/plain"]
    tables, pictures = others[: len(TABLES)], others[len(TABLES) :]
    for (table,), words in zip(
        tables, ("kinetic", "a substep:", "nothing limits it", "unaccounted"), strict=True
    ):
        assert words in table.data["text/plain"] and words in table.data["text/html"]
        assert table.data["text/html"].startswith("<pre ")
    for (picture,) in pictures:
        assert "image/png" in picture.data
    assert any("image/png" in each.get("data", {}) for each in plot)
    said = "".join(each.get("text", "") for cell in (run, *others, plot) for each in cell)
    for word in ("Warp", "Module", "CUDA", "warp"):
        assert word not in said
