"""The command line: its words, its errors, and the commands that only tell."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

from particlesim import cli
from particlesim.commands import run, scene_files
from particlesim.scene import __version__

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
    ],
)
def test_bad_scene_files(engine, scene_file, particlesim_fails, text, message):
    assert message in particlesim_fails(2, "run", scene_file(text))


@pytest.mark.parametrize(
    "old, new, message",
    [
        ("return {", "return missing, {", "NameError: name 'missing' is not defined"),
        ("count=2", "count", "count must be set; give --set count=VALUE"),
    ],
)
def test_bad_builds(engine, scene_file, scene_text, particlesim_fails, old, new, message):
    assert message in particlesim_fails(2, "run", scene_file(scene_text.replace(old, new)))


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
    monkeypatch.setattr(engine, "failure", failure)
    assert message in particlesim_fails(1, "run", scene_file())


def test_engine_failure_before_the_first_frame(engine, scene_file, particlesim_fails, monkeypatch):
    def fail(*arguments, **options):
        raise RuntimeError("out of device memory")

    monkeypatch.setattr(engine, "__init__", fail)
    assert "out of device memory" in particlesim_fails(1, "explain", scene_file())


def test_interrupted_run(engine, scene_file, particlesim_fails, monkeypatch):
    monkeypatch.setattr(engine, "failure", KeyboardInterrupt())
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
