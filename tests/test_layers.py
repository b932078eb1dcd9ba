"""The rooms: imports go one way, without circles, and kernels know nothing but Warp.

``lint-imports`` holds the layers of the package; it sees neither circles of files nor the folders
that are mapped into the package, which are looked at here. Imports that are only for types, or
inside functions, count.
"""

import ast
import graphlib
import itertools
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PACKAGE = "particlesim"
MAPPED = ("kernels", "scenes")  # folders of the root that are packages of the package


def dotted(path):
    """The name by which a file is imported."""
    parts = list(path.relative_to(ROOT).with_suffix("").parts)
    if parts[0] in MAPPED:
        parts.insert(0, PACKAGE)
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


FILES = {
    dotted(path): path for folder in (PACKAGE, *MAPPED) for path in (ROOT / folder).rglob("*.py")
}


def imported(name):
    """What a module imports, anywhere in it: modules of the package, or names of others."""
    path = FILES[name]
    package = name.split(".") if path.name == "__init__.py" else name.split(".")[:-1]
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) - node.level + 1] if node.level else []
            module = ".".join([*base, *filter(None, [node.module])])
            for alias in node.names:
                inner = f"{module}.{alias.name}"
                yield inner if inner in FILES else module


def room(name):
    """The room that a module lies in; the package itself is none."""
    return name.split(".")[1] if "." in name else ""


def test_no_circles():
    graph = {name: set(imported(name)) & FILES.keys() - {name} for name in FILES}
    try:
        graphlib.TopologicalSorter(graph).prepare()
    except graphlib.CycleError as error:
        pytest.fail(" imports ".join(reversed(error.args[1])))


def test_kernels_import_warp_and_themselves():
    known = {"warp", "numpy", f"{PACKAGE}.kernels"}
    standard = {
        "__future__", "abc", "ast", "collections", "contextlib", "contextvars", "ctypes",
        "dataclasses", "functools", "hashlib", "inspect", "itertools", "linecache", "math",
        "pathlib", "re", "textwrap", "threading", "types", "typing", "warnings",
    }  # fmt: skip
    for name in FILES:
        if room(name) == "kernels":
            for other in imported(name):
                own = ".".join(other.split(".")[:2]) if other.startswith(PACKAGE) else ""
                top = own or other.split(".")[0]
                assert top in known | standard, f"{name} imports {other}"


def test_scenes_import_the_public_package_only():
    for name in FILES:
        if room(name) == "scenes":
            inner = {each for each in imported(name) if each.startswith(f"{PACKAGE}.")}
            assert not inner, f"{name} imports {inner}"


def test_only_the_command_line_reaches_scenes_and_the_whole():
    """A room that imports the package itself would import what lies above it."""
    for name in FILES:
        if room(name) not in ("", "scenes"):
            reached = {each for each in imported(name) if each == PACKAGE or room(each) == "scenes"}
            assert not reached, f"{name} imports {reached}"


def test_rooms_are_few_and_small():
    inside = {path.name for path in (ROOT / PACKAGE).iterdir() if path.suffix == ".py"}
    assert len(inside) <= 3, inside
    for folder in {path.parent for path in FILES.values()}:
        modules = list(folder.glob("*.py"))
        most = 60 if folder.name == "scenes" else 15  # a catalogue in alphabetical order, and rooms
        assert len(modules) <= most, f"{folder} holds {len(modules)} files"
    for path in itertools.chain(FILES.values(), (ROOT / "tests").rglob("*.py")):
        text = path.read_text(encoding="utf-8")
        assert text.count("\n") <= 300, f"{path} has {text.count(chr(10))} lines"
        for node in ast.walk(ast.parse(text)):
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
                length = node.end_lineno - node.lineno + 1
                assert length <= 60, f"{path}: {node.name} has {length} lines"


def test_every_package_is_installed():
    """The folders are mapped, so that no tool finds packages by itself."""
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    packages = {name for name, path in FILES.items() if path.name == "__init__.py"}
    assert set(settings["tool"]["setuptools"]["packages"]) == packages
