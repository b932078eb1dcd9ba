"""Case files: where they are, what they are called, and how they are loaded."""

from __future__ import annotations

import ast
import importlib.util
import inspect
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ... import validate
from .case import Case

OWNER = "bench"
ROOT = Path(__file__).parents[3]  # of a checkout


def cases_in(folder: Path | None) -> dict[str, Path]:
    """The case files of a folder by name, in order.

    Args:
        folder: None: ``tests/benchmarks`` of the checkout that this package lies in, or else of
            the present folder.

    Raises:
        ValueError: No such folder, as where the package is installed without its sources.
    """
    places = [root / "tests" / "benchmarks" for root in (ROOT, Path())]
    chosen = folder or next((each for each in places if each.is_dir()), places[-1])
    found = {path.stem: path for path in sorted(chosen.glob("*.py")) if _makes_case(path)}
    if not found:
        raise validate.fail(
            OWNER, "--folder", "hold case files, each with a function case", str(chosen),
            "name the tests/benchmarks of a checkout; an installed package has none",
        )  # fmt: skip
    return found


def title_of(path: Path) -> str:
    """The first line of what a case file says of itself; it is not imported."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    return (ast.get_docstring(tree) or "").partition("\n")[0]


def load_case(path: Path, options: Mapping[str, Any]) -> Case:
    """The case that a file makes of these options.

    Raises:
        ValueError: The file makes none, or its ``case`` does not know an option.
    """
    name = f"case_{path.stem}"
    specification = importlib.util.spec_from_file_location(name, path)
    assert specification is not None and specification.loader is not None
    module = importlib.util.module_from_spec(specification)
    sys.modules[name] = module  # laws look their module up by name
    folder = str(path.parent.resolve())
    if folder not in sys.path:
        sys.path.append(folder)  # where peers and other cases are
    specification.loader.exec_module(module)
    validate.known(path.stem, options, list(inspect.signature(module.case).parameters), "option")
    made = module.case(**options)
    if not isinstance(made, Case):
        raise validate.fail(path.stem, "case", "return a Case", made, "see accuracy/bench/case.py")
    return made


def _makes_case(path: Path) -> bool:
    tree = ast.parse(path.read_text(encoding="utf-8"))
    return any(isinstance(node, ast.FunctionDef) and node.name == "case" for node in tree.body)
