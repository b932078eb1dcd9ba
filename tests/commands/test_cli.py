"""The command line, with a stand-in for the engine, and at the end with the engine itself."""

import os
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest
from typer.testing import CliRunner

from particlesim import cli
from particlesim.commands import run, scene_files, shell
from particlesim.scene import __version__

SCENE = '''
    """A test scene.

    More about it.
    """
    import particlesim as ps

    settings = ps.Settings(dt=0.01, substeps=4)
    frames = 3

    def build(count=2, spacing=0.5, open=False, name="fluid"):
        return {"count": count, "spacing": spacing, "open": open, "name": name}

    def error(sim):
        return 0.125
'''


class Engine:
    """What the command line needs of Simulation; keeps the arguments of the last one."""

    last = None
    failure: BaseException | None = None
    particle_count = 1234

    def __init__(self, scene, settings, device=None, worlds=None):
        Engine.last = self
        self.scene, self.settings, self.device, self.worlds = scene, settings, device, worlds

    def run(self, frames, record, progress, overwrite, fields, history, checkpoint, resume):
        self.checkpoint, self.resume = checkpoint, resume
        self.frames, self.record, self.overwrite = frames, record, overwrite
        self.history = history
        self.fields = tuple(fields)
        for frame in range(1, frames + 1):
            progress(frame, frames)
            if self.failure and frame == 2:
                raise self.failure

    def explain(self):
        return "density [float32] is not here\n[bold]plain[/bold]"


@pytest.fixture
def engine(monkeypatch):
    monkeypatch.setattr("particlesim.simulation.simulation.Simulation", Engine)
    monkeypatch.setattr(Engine, "failure", None)
    monkeypatch.setattr(Engine, "last", None)
    return Engine


@pytest.fixture
def scene_file(tmp_path):
    def write(text=SCENE, name="tiny.py"):
        path = tmp_path / name
        path.write_text(textwrap.dedent(text))
        return str(path)

    return write


@pytest.fixture
def particlesim_fails(capsys):
    """Run the program; expect the exit code and one line on stderr, and return that line."""

    def run(code, *arguments):
        assert cli.main(arguments) == code
        lines = capsys.readouterr().err.splitlines()
        assert len(lines) == 1 and lines[0].startswith("error: "), lines
        return lines[0]

    return run


# Running


def test_run_passes_everything_on(engine, scene_file, tmp_path, capsys):
    out = str(tmp_path / "out.usda")
    arguments = ["--frames", "5", "--out", out, "--device", "cpu", "--worlds", "3"]
    arguments += ["--field", "density", "--field", "pressure", "--checkpoint-every", "7"]
    assert cli.main(["run", scene_file(), *arguments]) == 0
    sim = engine.last
    assert (sim.frames, sim.record, sim.overwrite) == (5, out, False)
    assert sim.fields == ("density", "pressure")
    assert (sim.checkpoint, sim.resume) == (7, False)
    assert (sim.device, sim.worlds, sim.settings.substeps) == ("cpu", 3, 4)
    output = capsys.readouterr()
    assert output.err == ""
    assert output.out.count("\n") == 1
    assert output.out.startswith("tiny: 5 frames of 1,234 particles in ")
    assert "particle-substeps/s" in output.out and out in output.out


def test_run_takes_frames_from_the_scene_and_reports_its_error(engine, scene_file, capsys):
    assert cli.main(["run", scene_file()]) == 0
    assert engine.last.frames == 3 and engine.last.record is None
    assert "error 0.125" in capsys.readouterr().out
    # The known answer holds for the scene's own frames.
    assert cli.main(["run", scene_file(), "--frames", "2"]) == 0
    assert "error" not in capsys.readouterr().out


def test_run_default_frames(engine, scene_file):
    assert cli.main(["run", scene_file(SCENE.replace("frames = 3", ""))]) == 0
    assert engine.last.frames == shell.DEFAULT_FRAMES


def test_set_reaches_build_and_settings(engine, scene_file):
    sets = ["count=7", "open=true", "name=water", "substeps=9", "dt=1/60", "skin=0.1"]
    arguments = [word for assignment in sets for word in ("--set", assignment)]
    assert cli.main(["run", scene_file(), *arguments, "--precision", "float64"]) == 0
    sim = engine.last
    assert sim.scene == {"count": 7, "spacing": 0.5, "open": True, "name": "water"}
    assert (sim.settings.substeps, sim.settings.skin, sim.settings.precision) == (9, 0.1, "float64")
    assert sim.settings.dt == pytest.approx(1 / 60)


def test_set_prefers_build_over_settings(engine, scene_file):
    text = SCENE.replace("count=2", "iterations=1").replace('"count": count', '"got": iterations')
    assert cli.main(["run", scene_file(text), "--set", "iterations=8"]) == 0
    assert engine.last.scene["got"] == 8 and engine.last.settings.iterations == 1


def test_set_anything_where_build_takes_anything(engine, scene_file):
    text = SCENE.replace('name="fluid"', "**more").replace('"name": name', "**more")
    assert cli.main(["run", scene_file(text), "--set", "extra=1", "--set", "dt=0.5"]) == 0
    assert engine.last.scene["extra"] == 1 and engine.last.settings.dt == 0.5


def test_overwrite(engine, scene_file, tmp_path, particlesim_fails):
    out = tmp_path / "out.usda"
    out.write_text("something")
    line = particlesim_fails(2, "run", scene_file(), "--out", str(out))
    assert str(out) in line and "--overwrite" in line and engine.last is None
    assert cli.main(["run", scene_file(), "--out", str(out), "--overwrite"]) == 0
    assert engine.last.overwrite is True


def test_run_on_a_terminal_shows_a_bar(engine, scene_file, capsys, monkeypatch):
    monkeypatch.setenv("FORCE_COLOR", "1")
    monkeypatch.setenv("COLUMNS", "160")
    assert cli.main(["run", scene_file()]) == 0
    bar = capsys.readouterr().err
    assert "tiny" in bar and "1,234 particles" in bar and "particle-substeps/s" in bar


def test_scene_file_imports_its_neighbors(engine, scene_file):
    scene_file("NUMBER = 11", name="tiny_neighbor_module.py")
    text = SCENE.replace("frames = 3", "from tiny_neighbor_module import NUMBER as frames")
    assert cli.main(["run", scene_file(text)]) == 0
    assert engine.last.frames == 11


# Values


@pytest.mark.parametrize(
    "text, value",
    [
        ("1", 1), ("-2.5e-3", -2.5e-3), ("True", True), ("false", False), ("None", None),
        ("(1, 2, 3)", (1, 2, 3)), ("1/4", 0.25), ("water", "water"), ("'1'", "1"), ("", ""),
        ("1/0", "1/0"), ("a=b", "a=b"), ("__import__('os')", "__import__('os')"),
    ],
)  # fmt: skip
def test_parse_value(text, value):
    parsed = scene_files.parse_options([f"name={text}"])["name"]
    assert parsed == value and type(parsed) is type(value)


@pytest.mark.parametrize("assignment", ["name", "=1", "two words=1", "1=1", ""])
def test_parse_options_refuses(assignment):
    with pytest.raises(ValueError, match="--set must be NAME=VALUE, got"):
        scene_files.parse_options([assignment])


# Errors


@pytest.mark.parametrize(
    "arguments, message",
    [
        (["--set", "cuont=3"], "(count, spacing, open, name) or a setting (dt, substeps,"),
        (["--set", "cuont=3"], "got 'cuont'; did you mean 'count'."),
        (["--set", "count=many"], "--set count must be a number, got 'many'"),
        (["--set", "open=maybe"], "--set open must be true or false, got 'maybe'"),
        (["--set", "count"], "--set must be NAME=VALUE, got 'count'"),
        (["--set", "dt=1", "--set", "dt=2"], "got 'dt' twice"),
        (["--substeps", "3", "--set", "substeps=2"], "got 'substeps' twice"),
        (["--set", "dt=-1"], "Settings: dt must be at least 0"),
        (["--precision", "float16"], "Settings: precision must be one of float32, float64"),
        (["--frames", "0"], "--frames"),
        (["--frames", "many"], "--frames"),
        (["--worlds", "0"], "--worlds"),
        (["--wrlds", "2"], "--wrlds"),
    ],
)
def test_bad_arguments(engine, scene_file, particlesim_fails, arguments, message):
    assert message in particlesim_fails(2, "run", scene_file(), *arguments)
    assert engine.last is None


@pytest.mark.parametrize(
    "arguments, message",
    [
        (["fly"], "fly"),
        (["run"], "SCENE"),
        (["run", "no_such_scene"], "got 'no_such_scene'; the ready scenes are"),
        (["run", "no_such_file.py"], "must be a file that exists, got 'no_such_file.py'"),
        (["explain", "folder/scene"], "must be a file that exists, got 'folder/scene'"),
    ],
)
def test_bad_commands(particlesim_fails, arguments, message):
    assert message in particlesim_fails(2, *arguments)


@pytest.mark.parametrize(
    "text, message",
    [
        ("x = 1", "build must be a function"),
        ("def build(): pass", "settings must be a particlesim.Settings"),
        ("def build(:", "SyntaxError: invalid syntax (tiny.py, line 1)"),
        ("import particlesim_no_such_module", "ModuleNotFoundError"),
        (
            SCENE.replace("return {", "return missing, {"),
            "NameError: name 'missing' is not defined",
        ),
        (SCENE.replace("count=2", "count"), "count must be set; give --set count=VALUE"),
    ],
)
def test_bad_scene_files(engine, scene_file, particlesim_fails, text, message):
    assert message in particlesim_fails(2, "run", scene_file(text))


def test_error_names_the_line_of_the_scene(engine, scene_file, particlesim_fails):
    line = particlesim_fails(2, "run", scene_file("import math\n\nmath.missing\n"))
    assert "(tiny.py, line 3)" in line


@pytest.mark.parametrize(
    "failure, message",
    [
        (RuntimeError("Simulation: particle 3 of world 0\nis NaN at t = 0.1"), "is NaN at t = 0.1"),
        (OSError(28, "No space left on device", "out.clips"), "out.clips: No space left on device"),
        (ZeroDivisionError("division by zero"), "ZeroDivisionError: division by zero"),
        (MemoryError(), "MemoryError"),
    ],
)
def test_failed_run(engine, scene_file, particlesim_fails, monkeypatch, failure, message):
    monkeypatch.setattr(Engine, "failure", failure)
    assert message in particlesim_fails(1, "run", scene_file())


def test_engine_failure_before_the_first_frame(engine, scene_file, particlesim_fails, monkeypatch):
    def fail(*arguments, **options):
        raise RuntimeError("out of device memory")

    monkeypatch.setattr(Engine, "__init__", fail)
    assert "out of device memory" in particlesim_fails(1, "explain", scene_file())


def test_interrupted_run(engine, scene_file, particlesim_fails, monkeypatch):
    monkeypatch.setattr(Engine, "failure", KeyboardInterrupt())
    assert "interrupted after 2 of 3 frames" in particlesim_fails(130, "run", scene_file())


def test_one_line_on_the_stream_itself(scene_file, capfd):
    # Warp's C code prints to the file descriptor, whatever Python's stderr is.
    assert cli.main(["explain", scene_file("1 / 0")]) == 2
    assert capfd.readouterr().err.count("\n") == 1


def test_debug_shows_the_traceback(engine, scene_file, capsys):
    assert cli.main(["run", scene_file("1 / 0"), "--debug"]) == 2
    lines = capsys.readouterr().err.splitlines()
    assert lines[0].startswith("Traceback") and lines[-1].startswith("error: ZeroDivisionError")


# The other commands


def test_version(capsys):
    assert cli.main(["--version"]) == 0
    assert capsys.readouterr().out == f"particlesim {__version__}\n"


@pytest.mark.parametrize("arguments", [[], ["--help"]])
def test_help_lists_the_commands(arguments):
    result = CliRunner().invoke(cli.app, arguments)
    assert result.exit_code == 0
    assert all(command in result.output for command in ("list", "run", "explain"))
    assert "--debug" not in CliRunner().invoke(cli.app, ["run", "--help"]).output


def test_explain_prints_the_report_as_it_is(engine, scene_file):
    result = CliRunner().invoke(cli.app, ["explain", scene_file(), "--substeps", "2"])
    assert result.exit_code == 0
    assert result.output == "density [float32] is not here\n[bold]plain[/bold]\n"
    assert engine.last.settings.substeps == 2


def test_list_names_and_describes(scene_file, monkeypatch):
    scenes = {"tiny": Path(scene_file()), "plain": Path(scene_file("x = 1", "plain.py"))}
    monkeypatch.setattr(run, "ready_scenes", lambda: scenes)
    result = CliRunner().invoke(cli.app, ["list"])
    assert result.exit_code == 0
    assert result.output == "tiny   A test scene.  (known answer)\nplain\n"


def test_ready_scenes_are_the_files_of_the_package():
    scenes = scene_files.ready_scenes()
    folder = Path(cli.__file__).parent.parent / "scenes"
    assert list(scenes) == sorted(
        path.stem for path in folder.glob("*.py") if not path.stem.startswith("_")
    )
    assert all(path.is_file() for path in scenes.values())


# The engine itself

FALLING = '''
    """A particle that falls freely: after t it is 4.905 t^2 lower."""
    import particlesim as ps

    settings = ps.Settings(dt=0.1, substeps=2, precision="float64")
    frames = 2

    def build(height=10.0):
        scene = ps.Scene()
        scene.add_particles([(0, height, 0)], mass=1.0, radius=0.1)
        scene.add_interaction(ps.UniformGravity((0, -9.81, 0)))
        return scene

    def error(sim):
        # Symplectic Euler with n steps of h falls g h^2 n (n + 1) / 2.
        return float(abs(sim.position[0, 1] - 10.0 + 9.81 * 0.05**2 * 4 * 5 / 2))
'''


def test_run_writes_usd(scene_file, tmp_path, capsys):
    out = tmp_path / "falling.usda"
    arguments = ["--out", str(out), "--device", "cpu"]
    assert cli.main(["run", scene_file(FALLING, "falling.py"), *arguments]) == 0
    summary = capsys.readouterr().out
    assert summary.startswith("falling: 2 frames of 1 particles")
    # Round-off of a few sums of numbers near 10.
    assert float(summary.partition("error ")[2].split(";")[0]) < 1e-13
    # The start and two frames.
    assert out.is_file() and len(list((tmp_path / "falling.clips").glob("f.*.usdc"))) == 3


def test_a_run_is_resumed(scene_file, tmp_path, capsys, particlesim_fails):
    path, out = scene_file(FALLING, "falling.py"), str(tmp_path / "falling.npz")
    words = ["run", path, "--out", out, "--device", "cpu"]
    assert cli.main([*words, "--frames", "1", "--resume"]) == 0
    told = capsys.readouterr()
    assert told.err == f"note: nothing to resume at {out}; starting it\n" and "1 frames" in told.out
    assert "go on with --resume" in particlesim_fails(2, *words, "--frames", "3")
    assert cli.main([*words, "--frames", "3", "--resume"]) == 0
    assert capsys.readouterr().out.startswith("falling: 2 frames of 1 particles")
    assert cli.main([*words, "--frames", "3", "--resume"]) == 0
    assert f"all 3 frames are in {out}, nothing was left" in capsys.readouterr().out
    line = particlesim_fails(2, *words, "--set", "height=11", "--resume")
    assert "start.state must be" in line or "position must be" in line
    assert "--out" in particlesim_fails(2, "run", path, "--resume")
    assert "--overwrite" in particlesim_fails(2, *words, "--resume", "--overwrite")


def test_a_reader_that_has_enough_ends_the_program_quietly():
    # As in "particlesim list | head -1", whatever of it comes first.
    reading, writing = os.pipe()
    os.close(reading)
    program = [sys.executable, "-c", "from particlesim import cli; raise SystemExit(cli.main())"]
    done = subprocess.run(
        [*program, "list"], stdout=writing, stderr=subprocess.PIPE, text=True, check=False,
        timeout=100,
    )  # fmt: skip
    os.close(writing)
    assert (done.returncode, done.stderr) == (0, "")


def test_run_refuses_a_device_that_is_not_there(scene_file, particlesim_fails):
    path = scene_file(FALLING, "falling.py")
    assert "abacus" in particlesim_fails(2, "run", path, "--device", "abacus")
