"""The command ``particlesim run``, with a stand-in for the engine, and with the engine itself."""

import pytest

from particlesim import cli
from particlesim.commands import shell


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


def test_run_default_frames(engine, scene_file, scene_text):
    assert cli.main(["run", scene_file(scene_text.replace("frames = 3", ""))]) == 0
    assert engine.last.frames == shell.DEFAULT_FRAMES


def test_set_reaches_build_and_settings(engine, scene_file):
    sets = ["count=7", "open=true", "name=water", "substeps=9", "dt=1/60", "skin=0.1"]
    arguments = [word for assignment in sets for word in ("--set", assignment)]
    assert cli.main(["run", scene_file(), *arguments, "--precision", "float64"]) == 0
    sim = engine.last
    assert sim.scene == {"count": 7, "spacing": 0.5, "open": True, "name": "water"}
    assert (sim.settings.substeps, sim.settings.skin, sim.settings.precision) == (9, 0.1, "float64")
    assert sim.settings.dt == pytest.approx(1 / 60)


def test_set_prefers_build_over_settings(engine, scene_file, scene_text):
    text = scene_text.replace("count=2", "iterations=1").replace(
        '"count": count', '"got": iterations'
    )
    assert cli.main(["run", scene_file(text), "--set", "iterations=8"]) == 0
    assert engine.last.scene["got"] == 8 and engine.last.settings.iterations == 1


def test_set_anything_where_build_takes_anything(engine, scene_file, scene_text):
    text = scene_text.replace('name="fluid"', "**more").replace('"name": name', "**more")
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


def test_scene_file_imports_its_neighbors(engine, scene_file, scene_text):
    scene_file("NUMBER = 11", name="tiny_neighbor_module.py")
    text = scene_text.replace("frames = 3", "from tiny_neighbor_module import NUMBER as frames")
    assert cli.main(["run", scene_file(text)]) == 0
    assert engine.last.frames == 11


# The engine itself


def test_run_writes_usd(falling, tmp_path, capsys):
    out = tmp_path / "falling.usda"
    arguments = ["--out", str(out), "--device", "cpu"]
    assert cli.main(["run", falling, *arguments]) == 0
    summary = capsys.readouterr().out
    assert summary.startswith("falling: 2 frames of 1 particles")
    # Round-off of a few sums of numbers near 10.
    assert float(summary.partition("error ")[2].split(";")[0]) < 1e-13
    # The start and two frames.
    assert out.is_file() and len(list((tmp_path / "falling.clips").glob("f.*.usdc"))) == 3


def test_a_run_is_resumed(falling, tmp_path, capsys, particlesim_fails):
    out = str(tmp_path / "falling.npz")
    words = ["run", falling, "--out", out, "--device", "cpu"]
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
    assert "--out" in particlesim_fails(2, "run", falling, "--resume")
    assert "--overwrite" in particlesim_fails(2, *words, "--resume", "--overwrite")


def test_run_says_where_its_time_went(falling, capsys):
    assert cli.main(["run", falling, "--device", "cpu", "--profile"]) == 0
    out = capsys.readouterr().out
    assert "error" in out  # that of a run without it, known to round-off
    assert "2 frames, launch by launch" in out and "UniformGravity" in out


def test_run_refuses_a_device_that_is_not_there(falling, particlesim_fails):
    assert "abacus" in particlesim_fails(2, "run", falling, "--device", "abacus")
