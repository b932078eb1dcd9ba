"""Scene files: finding and loading them, and setting their options from text.

A scene is a module that defines ``build(**options) -> Scene``, ``settings`` and, if its answer is
known, ``error(sim) -> float``; ``frames``, if it is there, is how many frames it wants. It is named
by the name of a ready scene or by the path of a file.
"""

from __future__ import annotations

import ast
import contextlib
import importlib
import importlib.util
import inspect
import os
import pkgutil
import sys
from collections.abc import Callable, Sequence
from fractions import Fraction
from pathlib import Path
from types import ModuleType
from typing import Any

from ..output.progress import label

NO_NUMBERS = (str, bytes, tuple, list, dict, set, type(None))  # kinds of literals


def ready_scenes() -> dict[str, Path]:
    """Names of the ready scenes, in order, and their files."""
    package = importlib.import_module("particlesim.scenes")
    names = sorted(
        module.name
        for module in pkgutil.iter_modules(package.__path__)
        if not module.ispkg and not module.name.startswith("_")
    )
    return {name: Path(package.__path__[0]) / f"{name}.py" for name in names}


def load_scene(name: str) -> ModuleType:
    """The module of a ready scene or of a scene file.

    Args:
        name: A ready scene's name, or a path: ends in ``.py`` or has a folder in it.

    Raises:
        ValueError: No such scene, or a module without ``build`` and ``settings``.
    """
    from ..scene.settings import Settings

    if name.endswith(".py") or os.path.basename(name) != name:
        module = _load_file(Path(name))
    elif name in ready_scenes():
        module = importlib.import_module(f"particlesim.scenes.{name}")
    else:
        raise ValueError(
            f"SCENE must be a ready scene or the path of a .py file, got {name!r}; "
            f"the ready scenes are {', '.join(ready_scenes())}."
        )
    if not callable(getattr(module, "build", None)):
        raise ValueError(f"{name}: build must be a function that returns a Scene; define it.")
    if not isinstance(getattr(module, "settings", None), Settings):
        raise ValueError(f"{name}: settings must be a particlesim.Settings; define it.")
    return module


def _load_file(path: Path) -> ModuleType:
    if not path.is_file():
        raise ValueError(f"SCENE must be a file that exists, got {str(path)!r}; check the path.")
    specification = importlib.util.spec_from_file_location(f"scene_{path.stem}", path)
    if specification is None or specification.loader is None:
        raise ValueError(f"SCENE must be a Python file, got {str(path)!r}; name it .py.")
    module = importlib.util.module_from_spec(specification)
    # Laws and dataclasses look their module up by name, and a scene may import its neighbours.
    sys.modules[specification.name] = module
    sys.path.append(str(path.parent.resolve()))
    specification.loader.exec_module(module)
    return module


def load_function(text: str, option: str) -> Callable[..., Any]:
    """The function that ``module:function`` or ``file.py:function`` names.

    Raises:
        ValueError: There is none.
    """
    place, colon, name = text.rpartition(":")
    if not colon or not place or not name.isidentifier():
        raise ValueError(
            f"{option} must be MODULE:FUNCTION or FILE.py:FUNCTION, got {text!r}; name one."
        )
    module = _load_file(Path(place)) if place.endswith(".py") else importlib.import_module(place)
    function = getattr(module, name, None)
    if not callable(function):
        raise ValueError(f"{option} must name a function of {place}, got {name!r}; define it.")
    return function


def parse_options(assignments: Sequence[str]) -> dict[str, Any]:
    """``["name=value", ...]`` as a dict.

    A value is a Python literal, ``true``, ``false`` or a fraction like ``1/60``, else a string.

    Raises:
        ValueError: No ``=``, no name, or a name given twice.
    """
    options: dict[str, Any] = {}
    for assignment in assignments:
        name, equals, text = assignment.partition("=")
        name = name.strip().replace("-", "_")
        if not equals or not name.isidentifier():
            raise ValueError(f"--set must be NAME=VALUE, got {assignment!r}; write --set name=1.")
        if name in options:
            raise ValueError(f"--set must name an option once, got {name!r} twice; drop one.")
        options[name] = _parse_value(text.strip())
    return options


def _parse_value(text: str) -> Any:
    # As text, "false" would count as true in a condition.
    if text in ("true", "false"):
        return text == "true"
    with contextlib.suppress(ValueError, SyntaxError, MemoryError, RecursionError):
        return ast.literal_eval(text)
    with contextlib.suppress(ValueError, ZeroDivisionError):
        return float(Fraction(text))
    return text


def parse_vary(assignments: Sequence[str]) -> dict[str, list[Any]]:
    """``["substeps=1,2,5", ...]`` as a dict of lists; a value is what it is in ``--set``.

    Raises:
        ValueError: No ``=``, no name, no value, or a name given twice.
    """
    vary: dict[str, list[Any]] = {}
    for assignment in assignments:
        name, equals, text = assignment.partition("=")
        name = name.strip().replace("-", "_")
        words = [word.strip() for word in _split_list(text)]
        if not equals or not name.isidentifier() or not all(words):
            raise ValueError(
                f"--vary must be NAME=VALUE,VALUE,..., got {assignment!r}; "
                "write --vary substeps=1,2,5."
            )
        if name in vary:
            raise ValueError(f"--vary must name a knob once, got {name!r} twice; join the lists.")
        vary[name] = [_parse_value(word) for word in words]
    return vary


def _split_list(text: str) -> list[str]:
    """Split at the commas that are outside brackets."""
    words, depth = [""], 0
    for sign in text:
        depth += (sign in "([{") - (sign in ")]}")
        if sign == "," and depth == 0:
            words.append("")
        else:
            words[-1] += sign
    return words


def split_options(
    module: ModuleType, options: dict[str, Any]
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Divide options into those of the scene's ``build`` and those that are knobs of its settings.

    A name that is both goes to ``build``.

    Raises:
        ValueError: A name that is neither, no number where ``build`` has one, or an option that
            ``build`` needs and nobody set.
    """
    from ..accuracy.study import options_of, split

    scene = label(module)
    chosen, knobs = split(module.build, scene, options, "--set", no_numbers=NO_NUMBERS)
    for name, default in options_of(module.build).items():
        if default is inspect.Parameter.empty and name not in chosen:
            raise ValueError(f"{scene}: {name} must be set; give --set {name}=VALUE.")
    return chosen, knobs
