"""The command ``particlesim tradeoff``."""

import json
import sys

import pytest

from particlesim import cli
from particlesim.commands.scene_files import parse_vary

SCENE = """
import particlesim as ps

settings = ps.Settings(dt=0.1, precision="float64")
frames = 4

def build(height: float):
    scene = ps.Scene()
    scene.add_particles([(0, height, 0)])
    scene.add_interaction(ps.UniformGravity((0, -10, 0)))
    return scene

def error(sim):
    return sim.scenes[0].position[0, 1] - 5 * sim.time**2 - sim.position[0, 1]
"""


@pytest.fixture
def command(tmp_path, capsys):
    """Runs the command on a scene; returns the exit code, stdout and stderr."""
    path = tmp_path / "falling.py"
    path.write_text(SCENE)

    def run(*arguments):
        words = ["tradeoff", str(path), "--device", "cpu", "--repeats", "1", *arguments]
        code = cli.main(words)
        output = capsys.readouterr()
        return code, output.out, output.err

    return run


def test_the_command(command, tmp_path):
    pytest.importorskip("matplotlib")
    picture, file = tmp_path / "x.png", tmp_path / "x.json"
    code, out, err = command(
        "--vary", "substeps=1,2,4", "--vary", "height=1.0,2.0", "--plot", str(picture),
        "--save", str(file),
    )  # fmt: skip
    assert (code, err) == (0, "")
    assert out.startswith("falling: 0.4 s on cpu, 1 run")
    assert "order of convergence of substeps: 1.00" in out
    assert picture.exists() and len(json.loads(file.read_text())["rows"]) == 6
    code, _, err = command("--vary", "substeps=1", "--save", str(file))
    assert code == 2 and "--save must be a new file" in err
    assert command("--vary", "height=1.0", "--save", str(file), "--overwrite")[0] == 0


def test_the_command_with_a_reference(command):
    code, out, _ = command(
        "--vary", "substeps=1,2", "--set", "height=3", "--frames", "2", "--error", "converged",
        "--reference", "substeps=64",
    )  # fmt: skip
    assert code == 0 and "rms distance from a reference of 64 substeps" in out


def test_the_command_over_time(command):
    code, out, err = command(
        "--vary", "substeps=1,2", "--set", "height=3", "--observe", "velocity", "--over", "rms",
        "--reference", "substeps=64",
    )  # fmt: skip
    assert (code, err) == (0, "") and "rms difference of velocity from a reference" in out
    assert "root mean square over all frames" in out
    code, out, _ = command("--vary", "height=1.0", "--over", "max")
    assert code == 0 and "against the known answer, the largest of all frames" in out


def test_the_command_observes_what_the_scene_names(command, tmp_path):
    own = "\n\ndef depth(sim):\n    return -sim.position[0, 1]\n"
    (tmp_path / "falling.py").write_text(SCENE + own)
    code, out, _ = command(
        "--vary", "substeps=1,2", "--set", "height=3", "--observe", "depth", "--frames", "2",
        "--reference", "substeps=64",
    )  # fmt: skip
    assert code == 0 and "rms difference of depth from a reference" in out


def test_the_command_with_seeds(command, tmp_path):
    text = SCENE.replace("build(height: float)", "build(height: float = 1.0, seed: int = 0)")
    (tmp_path / "falling.py").write_text(text)
    code, out, _ = command("--vary", "substeps=1,2", "--seeds", "3")
    assert code == 0 and "3 seeds" in out


@pytest.mark.parametrize(
    "arguments, message",
    [
        ([], "--vary must be given"),
        (["--vary", "height=1", "--over", "last"], "--over must be one of final, max, rms, mean"),
        (["--vary", "height=1", "--observe", "speed"], "--observe must be one of"),
        (["--vary", "height=1", "--seeds", "3"], "seeds must be of a build with an option seed"),
        (["--vary", "substeps"], "--vary must be NAME=VALUE,VALUE,..., got 'substeps'"),
        (["--vary", "substeps=1,,2"], "--vary must be NAME=VALUE"),
        (["--vary", "substeps=1", "--vary", "substeps=2"], "got 'substeps' twice"),
        (["--vary", "substps=1", "--vary", "height=1"], "did you mean 'substeps'"),
        (
            ["--vary", "substeps=0", "--vary", "height=1"],
            "Settings: substeps must be a whole number",
        ),
        (["--vary", "substeps=1"], "height must be set; give --set height=VALUE"),
        (["--vary", "height=1", "--error", "entropy"], "--error must be one of known"),
        (["--vary", "height=1", "--plot", "x.bmp"], "--plot must end in .png"),
        (["--vary", "height=1", "--save", "x.txt"], "--save must end in .json, .csv"),
        (["--vary", "height=1", "--repeats", "0"], "--repeats"),
        (["--vary", "height=1", "--set", "mass=1"], "--set must name an option"),
    ],
)
def test_bad_commands(command, arguments, message):
    code, out, err = command(*arguments)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert err.startswith("error: ") and message in err


def test_the_command_without_matplotlib(command, monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    code, _, err = command("--vary", "height=1", "--plot", str(tmp_path / "x.png"))
    assert code == 2 and err.count("\n") == 1 and "pip install 'particlesim[plot]'" in err


def test_warnings_of_the_command_are_one_line(command, tmp_path):
    (tmp_path / "falling.py").write_text(SCENE.replace("return sim.", "return float('nan') * sim."))
    code, _, err = command("--vary", "height=1.0")
    assert code == 0 and err.startswith("warning: tradeoff: error must be finite")
    assert err.count("\n") == 1


def test_values_to_vary():
    vary = parse_vary(
        ["substeps=1,2, 5", "dt=1/60,0.1", "precision=float32", "wind=(0, 1, 0),(2,)"]
    )
    assert vary == {
        "substeps": [1, 2, 5], "dt": [1 / 60, 0.1], "precision": ["float32"],
        "wind": [(0, 1, 0), (2,)],
    }  # fmt: skip
