"""Outputs are refused before any work where something would be lost, and appear whole."""

import subprocess
import sys

import pytest

from particlesim.output import files


@pytest.mark.parametrize(
    ("name", "kind", "match"),
    [
        ("out.txt", ValueError, "out must end in .csv, .jsonl, got"),
        ("none/out.csv", FileNotFoundError, "in an existing folder, got .*; make .*none"),
        ("folder.csv", IsADirectoryError, "be a file, got the folder"),
        ("old.csv", FileExistsError, "be a new file, got .* where 'old.csv' exists; .*ask me"),
        ("new.csv", FileExistsError, "be a new file, got .*new.csv' where 'beside' exists"),
    ],
)
def test_what_would_be_lost_is_refused(tmp_path, refused, name, kind, match):
    (tmp_path / "folder.csv").mkdir()
    (tmp_path / "old.csv").write_text("mine")
    (tmp_path / "beside").write_text("mine")

    def check(overwrite):
        return files.check_new(
            "Owner", tmp_path / name, overwrite, suffixes=(".csv", ".jsonl"),
            beside=[tmp_path / "beside"], argument="out", consent="ask me",
        )  # fmt: skip

    with refused(match, kind):
        check(overwrite=False)
    if kind is FileExistsError:
        assert check(overwrite=True) == tmp_path / name


def test_suffixes_in_either_case(tmp_path):
    path = tmp_path / "OUT.CSV"
    assert files.check_new("Owner", str(path), False, suffixes=(".csv",)) == path
    assert files.check_new("Owner", tmp_path / "anything", False).name == "anything"


@pytest.mark.parametrize("error", [OSError("disk full"), KeyError("other"), KeyboardInterrupt()])
def test_files_are_whole_or_as_they_were(tmp_path, error):
    target = tmp_path / "out.csv"
    target.write_text("old")
    told = "Owner: .*out.csv' must be writable, got disk full; .* Kept"
    match = told if isinstance(error, OSError) else None
    with pytest.raises(type(error), match=match), files.whole("Owner", target, "Kept.") as part:
        part.write_text("half")
        raise error
    assert [each.read_text() for each in tmp_path.iterdir()] == ["old"]
    with files.whole("Owner", target) as part:
        part.write_text("new")
    assert [each.read_text() for each in tmp_path.iterdir()] == ["new"]


def test_the_first_error_is_the_one_to_see():
    class Bad(files.Closing):
        def close(self):
            raise OSError("second")

    with pytest.raises(KeyError, match="first"), Bad():
        raise KeyError("first")
    with pytest.raises(OSError, match="second"), Bad():
        pass


def test_formats_are_loaded_when_a_file_is_opened():
    """Without ``particlesim/__init__``, whose lazy names are tested with the package."""
    code = """
import importlib, sys, types
import particlesim
package = types.ModuleType("particlesim")
package.__path__ = particlesim.__path__
for name in [name for name in sys.modules if name.split(".")[0] in ("particlesim", "pxr")]:
    if not name.startswith("particlesim.kernels"):
        del sys.modules[name]
sys.modules["particlesim"] = package
for name in ("simulation.simulation", "simulation.run", "output.recorders"):
    importlib.import_module(f"particlesim.{name}")
assert not {"pxr", "gsd", "h5py", "matplotlib"} & set(sys.modules)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
