"""The command ``particlesim stress``, with a stand-in for the sweep."""

import pytest

import particlesim as ps
from particlesim import cli
from particlesim.accuracy.stress.sweep import Result, Stress


@pytest.fixture
def stress(falling, monkeypatch, capsys):
    """Runs the command over results that are given; returns the exit code, stdout and stderr."""

    def run(*results, words=()):
        def sweep(build, settings, *, progress, frames, **options):
            for k, result in enumerate(results):
                progress(k, len(results), str(result))
                if isinstance(result, BaseException):
                    raise result
            return Stress(results, settings, frames, 0.2)

        monkeypatch.setattr("particlesim.accuracy.stress.sweep.stress", sweep)
        code = cli.main(["stress", falling, *words])
        said = capsys.readouterr()
        return code, said.out, said.err

    return run


def test_the_exit_code_says_whether_anything_failed(stress):
    held = Result("dt = 0", "held", None, None, "")
    code, out, err = stress(held, words=["--set", "height=3", "--frames", "2"])
    assert (code, err) == (0, "") and out.endswith("1 held, 0 refused, 0 recovered, 0 failed\n")
    code, out, _ = stress(held, Result("skin = 0", "failed", 1.0, 1.0, ""))
    assert code == 1 and "skin = 0" in out


def test_an_interrupted_sweep(stress):
    held = Result("dt = 0", "held", None, None, "")
    code, out, err = stress(held, held, KeyboardInterrupt())
    assert (code, out, err) == (130, "", "error: interrupted after 2 of 3 cases\n")


def test_a_scene_that_cannot_be_run(stress):
    code, out, err = stress(ps.SimulationError("Simulation: particle 0 is NaN"))
    assert (code, out, err) == (1, "", "error: Simulation: particle 0 is NaN\n")
    assert stress(words=["--set", "hight=3"])[0] == 2
