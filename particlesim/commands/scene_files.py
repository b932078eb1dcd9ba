"""Scene files: finding and loading them, and setting their options from text.

A scene is a module that defines ``build(**options) -> Scene``, ``settings`` and, if its answer is
known, ``error(sim) -> float``; ``frames``, if it is there, is how many frames it wants. It is named
by the name of a ready scene or by the path of a file.
"""

from __future__ import annotations

import ast
import contextlib
import dataclasses
import importlib
import importlib.util
import inspect
import os
import pkgutil
import sys
from collections.abc import Sequence
from fractions import Fraction
from pathlib import Path
from types import ModuleType
from typing import Any


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
    import particlesim

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
    if not isinstance(getattr(module, "settings", None), particlesim.Settings):
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


def label(module: ModuleType) -> str:
    return module.__name__.rpartition(".")[2].removeprefix("scene_")


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


def split_options(
    module: ModuleType, options: dict[str, Any]
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Divide options into those of the scene's ``build`` and those that are knobs of its settings.

    A name that is both goes to ``build``.

    Raises:
        ValueError: A name that is neither, text where ``build`` has a number, or an option that
            ``build`` needs and nobody set.
    """
    from .. import validate

    parameters = inspect.signature(module.build).parameters
    kinds = {parameter.kind for parameter in parameters.values()}
    named = {
        name: parameter
        for name, parameter in parameters.items()
        if parameter.kind in (parameter.POSITIONAL_OR_KEYWORD, parameter.KEYWORD_ONLY)
    }
    known_knobs = [field.name for field in dataclasses.fields(module.settings)]
    build_options: dict[str, Any] = {}
    knobs: dict[str, Any] = {}
    for name, value in options.items():
        if name in named:
            _check_kind(name, value, named[name].default)
            build_options[name] = value
        elif name in known_knobs:
            knobs[name] = value
        elif inspect.Parameter.VAR_KEYWORD in kinds:
            build_options[name] = value
        else:
            raise ValueError(
                f"--set must name an option of {label(module)} ({', '.join(named) or 'none'}) "
                f"or a setting ({', '.join(known_knobs)}), got {name!r}; "
                f"{validate.suggest(name, [*named, *known_knobs])}."
            )
    for name, parameter in named.items():
        if parameter.default is parameter.empty and name not in build_options:
            raise ValueError(f"{label(module)}: {name} must be set; give --set {name}=VALUE.")
    return build_options, knobs


def _check_kind(name: str, value: Any, default: Any) -> None:
    """Refuse text for an option that is a number by default, before it fails somewhere inside."""
    if isinstance(default, int | float) and not isinstance(value, int | float):
        kind = "true or false" if isinstance(default, bool) else "a number"
        raise ValueError(f"--set {name} must be {kind}, got {value!r}; its default is {default!r}.")
