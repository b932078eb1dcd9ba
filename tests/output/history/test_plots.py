"""Pictures of histories."""

import sys

import numpy as np
import pytest

import particlesim as ps
from particlesim import cli
from particlesim.output.history.plots import PANELS, chosen, figure, plot_history
from particlesim.output.history.writer import read_history

from .oscillations import fluid, oscillation, run

# Pictures


def test_a_plot_shows_the_diagnostics(tmp_path):
    pytest.importorskip("matplotlib")
    path = tmp_path / "out.csv"
    found = run(oscillation(worlds=2), path, 5)
    record = read_history(path)
    drawn = figure(record, list(chosen(record, ["energy", "momentum"]).values()))
    energies, momenta = drawn.axes
    lines = [line.get_ydata() for line in energies.get_lines()]
    expected = [
        [getattr(each, name)[w] for each in found]
        for name in ("kinetic", "potential", "energy")
        for w in range(2)
    ]
    np.testing.assert_array_equal(lines, expected)
    np.testing.assert_allclose(energies.get_lines()[0].get_xdata(), 0.1 * np.arange(6), rtol=1e-15)
    # The momentum of a spring is zero, but for rounding.
    changes = [line.get_ydata() for line in momenta.get_lines()]
    expected = [[e.momentum[w, k] - found[0].momentum[w, k] for e in found]
                for k in range(3) for w in range(2)]  # fmt: skip
    np.testing.assert_array_equal(changes, expected)


def test_all_panels_of_a_fluid(tmp_path):
    pytest.importorskip("matplotlib")
    sim = ps.Simulation(fluid(), device="cpu")
    observe = {"moved": ps.mean_square_displacement}
    sim.run(2, history=tmp_path / "out.csv", observe=observe)
    # All but those of boxes, which an open scene does not have.
    panels = [name for name in PANELS if name not in ("pressure", "stress", "volume")]
    assert plot_history(tmp_path / "out.csv", tmp_path / "out.png") == panels
    for suffix in (".svg", ".pdf"):
        plot_history(tmp_path / "out.csv", tmp_path / f"out{suffix}", ["density"])
    for suffix, start in ((".png", b"\x89PNG"), (".svg", b"<?xml"), (".pdf", b"%PDF")):
        assert (tmp_path / f"out{suffix}").read_bytes().startswith(start)


def test_plots_that_cannot_be_drawn(tmp_path, refused):
    pytest.importorskip("matplotlib")
    path = tmp_path / "out.csv"
    oscillation().run(2, history=path)
    with refused("be one of energy, drift"):
        plot_history(path, tmp_path / "out.png", ["entropy"])
    with refused("something that the run recorded"):
        plot_history(path, tmp_path / "out.png", ["density"])
    with refused("end in .png"):
        plot_history(path, tmp_path / "out.bmp")
    path.write_text(path.read_text().splitlines(keepends=True)[0])
    with refused("have a frame"):
        plot_history(path, tmp_path / "out.png")
    assert [file.name for file in tmp_path.iterdir()] == ["out.csv"]
    (tmp_path / "out.png").write_text("mine")
    with pytest.raises(FileExistsError):
        plot_history(path, tmp_path / "out.png")


def test_the_command_line(tmp_path, monkeypatch, capsys):
    pytest.importorskip("matplotlib")
    monkeypatch.chdir(tmp_path)
    words = ["run", "spring_lattice", "--frames", "2", "--history", "out.csv", "--device", "cpu"]
    assert cli.main(words) == 0
    assert len(read_history("out.csv").frame) == 3
    assert cli.main(["plot", "out.csv", "--what", "energy,drift"]) == 0
    assert "energy, drift of out.csv drawn in out.png" in capsys.readouterr().out
    assert (tmp_path / "out.png").exists()
    (tmp_path / "out.png").write_text("a picture of something else")
    assert cli.main(["plot", "out.csv"]) == 2
    assert "--out must be a new file, got 'out.png'" in capsys.readouterr().err
    assert (tmp_path / "out.png").read_text() == "a picture of something else"
    assert cli.main(["plot", "out.csv", "--overwrite"]) == 0
    assert cli.main(words) == 2
    assert cli.main(["plot", "none.csv", "--out", "b.png"]) == 2
    errors = capsys.readouterr().err
    assert errors.count("error: ") == errors.count("\n") == 2


def test_a_plot_without_matplotlib(tmp_path, monkeypatch):
    oscillation().run(1, history=tmp_path / "out.csv")
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    with pytest.raises(ImportError, match=r"pip install 'particlesim\[plot\]'"):
        plot_history(tmp_path / "out.csv", tmp_path / "out.png")
