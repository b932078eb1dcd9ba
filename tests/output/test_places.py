"""What cannot be written is told before anything is made of the scene."""

import sys

import pytest

from particlesim import cli
from particlesim.output.recorders import recorder_class

from .runs import sim

LOADED = "raise RuntimeError('loaded')\n"
PLACES = [
    ("none/out.usda", "in an existing folder, got .*; make .*none"),
    ("out.abc", "end in one of .usda, .*, got "),
    ("/proc/self/out.npz", "be writable, got .*choose another folder"),
    ("out.gsd", r"gsd must be installed, got none; pip install 'particlesim\[gsd\]'"),
    ("out.vtkhdf", r"h5py must be installed, got none; pip install 'particlesim\[vtkhdf\]'"),
]


@pytest.fixture
def bare(monkeypatch):
    """As if nothing optional were installed."""
    for module in ("gsd", "gsd.hoomd", "h5py"):
        monkeypatch.setitem(sys.modules, module, None)


@pytest.mark.parametrize(("name", "told"), PLACES)
@pytest.mark.parametrize("options", [{}, {"overwrite": True}, {"resume": True}, {"checkpoint": 0}])
def test_from_python(tmp_path, bare, refused, name, told, options):
    run = sim()
    with refused(told, (ValueError, OSError, ImportError)):
        run.run(3, record=tmp_path / name, **options)
    assert run.frame == 0 and list(tmp_path.iterdir()) == []
    if name != "out.abc":
        return
    with refused(r"end in .csv, .jsonl", ValueError):
        run.run(3, record=tmp_path / "out.npz", history=tmp_path / name, **options)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(("name", "told"), PLACES)
@pytest.mark.parametrize("options", [[], ["--overwrite"], ["--resume"]])
def test_from_the_command_line(tmp_path, bare, capsys, name, told, options):
    scene, out = tmp_path / "scene.py", str(tmp_path / name)
    scene.write_text(LOADED)
    assert cli.main(["run", str(scene), "--out", out, *options]) == 2
    *_, line = capsys.readouterr().err.splitlines()
    assert line.startswith("error: ")
    with pytest.raises(ValueError, match=told):
        raise ValueError(line)
    assert [each.name for each in tmp_path.iterdir()] == ["scene.py"]


def test_histories_from_the_command_line(tmp_path, capsys):
    scene = tmp_path / "scene.py"
    scene.write_text(LOADED)
    for name, told in (("none/a.csv", "be in an existing"), ("a.txt", "end in .csv, .jsonl")):
        assert cli.main(["run", str(scene), "--history", str(tmp_path / name)]) == 2
        assert f"run: --history must {told}" in capsys.readouterr().err
    old = tmp_path / "old.csv"
    old.write_text("mine")
    assert cli.main(["run", str(scene), "--history", str(old)]) == 2
    assert "--history must be a new file" in capsys.readouterr().err
    assert cli.main(["run", str(scene), "--history", str(old), "--overwrite"]) == 1
    assert "loaded" in capsys.readouterr().err and old.read_text() == "mine"


def test_fields_are_named_by_who_writes_them(suffix, tmp_path, refused):
    path = tmp_path / f"out{suffix}"
    with refused(f"^{recorder_class(path).__name__}: field must be .*, got 'image'"):
        sim().run(1, record=path, fields=["image"])
    assert list(tmp_path.iterdir()) == []
    sim().run(1, record=path, fields="speed")
    assert path.with_suffix(".checkpoint.npz").exists()
