"""The command ``particlesim measure``."""

from particlesim import cli


def test_a_number_with_its_error(falling, capsys):
    arguments = ["measure", falling, "--observe", "kinetic", "--device", "cpu", "--error", "1e-2"]
    assert cli.main(arguments) == 0
    out, err = capsys.readouterr()
    # m g^2 t^2 / 2 after 0.2 s: 1.925.
    assert out.startswith("kinetic, final of falling on cpu: 1.92")
    assert "enough: ps.Settings(dt=0.1, substeps=" in out
    assert err.startswith("time: 2 frames, ")


def test_functions_of_the_scene_and_of_files_are_observed(falling, tmp_path, capsys):
    command = ["measure", falling, "--device", "cpu", "--frames", "3", "--error", "1e-2"]
    assert cli.main([*command, "--observe", "error"]) == 0
    assert "error, final of falling" in capsys.readouterr().out
    path = tmp_path / "look.py"
    path.write_text("def height(sim):\n    return sim.position[:, 1]\n")
    assert cli.main([*command, "--observe", f"{path}:height", "--set", "height=4"]) == 0
    out = capsys.readouterr().out
    assert "height, final of falling on cpu: 3.5" in out  # 4 - 4.905 0.3^2 = 3.56
    assert "build(height=4)" in out


def test_what_cannot_be_observed_is_one_line(falling, particlesim_fails):
    command = ("measure", falling, "--device", "cpu", "--observe")
    assert "observe must be one of energy" in particlesim_fails(2, *command, "weight")
    assert "MODULE:FUNCTION" in particlesim_fails(2, *command, "math:")
    assert "must name a function of math" in particlesim_fails(2, *command, "math:height")
