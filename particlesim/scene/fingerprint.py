"""Fingerprints: what of a scene gives the arrays of its simulation their meaning.

Particles, groups, attributes, the periodic box, and of every part that acts its kind, its
particles, its tuples and the shapes of its parameters, and of every law what it says. Values are
left out: positions and velocities come with the arrays, and a stiffness may change from one part of
a run to the next.
:func:`values` has them, for runs that are to go on to the same bits.
"""

from __future__ import annotations

import dataclasses
import inspect
import re
import zlib
from collections.abc import Callable, Iterable, Iterator, Sequence
from inspect import isfunction
from types import CodeType
from typing import Any

import numpy as np
import warp as wp

from .group import Group, select
from .law import Key, Law, law
from .part import Part
from .scene import Scene

ABSENT = "nothing"


def fingerprint(scenes: Sequence[Scene], laws: dict[str, str] | None = None) -> dict[str, Any]:
    """What must agree, as plain lists, dicts, texts and numbers (JSON).

    Worlds that are alike are described once: world w is ``kinds[worlds[w]]``. Their laws are the
    same: as :func:`laws_of` had them when a simulation read them, None: as they are now.
    """
    kinds: list[dict[str, Any]] = []
    of_scene: dict[int, int] = {}
    for scene in scenes:
        if id(scene) not in of_scene:
            described = _scene(scene)
            if described not in kinds:
                kinds.append(described)
            of_scene[id(scene)] = kinds.index(described)
    return {
        "kinds": kinds,
        "worlds": [of_scene[id(scene)] for scene in scenes],
        "laws": laws_of(scenes[0]) if laws is None else laws,
    }


def laws_of(scene: Scene) -> dict[str, str]:
    """By place, what the laws of a scene say with all that they name; not the package's own."""
    found = {}
    for what in ("interactions", "constraints"):
        for k, part in enumerate(getattr(scene, what)):
            for key in _keys(part.kind()):
                if key.module.partition(".")[0] != __name__.partition(".")[0]:
                    where = f"{what}[{k}].law {key.signature.partition('(')[0]}"
                    found[where] = f"source with what it names, checksum {key.content}"
    return found


def _keys(kind: Any) -> Iterator[Key]:
    """The laws of a kind."""
    if isinstance(kind, tuple | list):
        for each in kind:
            yield from _keys(each)
    elif isinstance(kind, Key):
        yield kind
    elif isfunction(kind):
        yield law(kind).key


def difference(saved: dict[str, Any], given: dict[str, Any]) -> tuple[str, Any, Any] | None:
    """The first place where two fingerprints differ, and what each has there; None: nowhere.

    Those of older checkpoints do not know their laws.
    """
    if len(saved["worlds"]) != len(given["worlds"]):
        return "worlds", len(saved["worlds"]), len(given["worlds"])
    seen = set()
    for w, (ours, theirs) in enumerate(zip(saved["worlds"], given["worlds"], strict=True)):
        if (ours, theirs) not in seen:
            seen.add((ours, theirs))
            where = "scene" if len(given["kinds"]) == len(saved["kinds"]) == 1 else f"scenes[{w}]"
            found = first_change(where, saved["kinds"][ours], given["kinds"][theirs])
            if found:
                return found
    return first_change("scene", saved.get("laws", given["laws"]), given["laws"])


def values(scenes: Sequence[Scene]) -> list[dict[str, Any]]:
    """Every number and law of the scenes, as JSON; arrays by their checksums. Same bits, same runs.

    Copies of one scene are described once.
    """
    distinct = {id(scene): scene for scene in scenes}
    return [
        {
            "particles": {name: _content(scene.column(name)) for name in sorted(scene.attributes)},
            "interactions": [_contents(part) for part in scene.interactions],
            "constraints": [_contents(part) for part in scene.constraints],
            **_thermostats(scene, _contents),
        }
        for scene in distinct.values()
    ]


def _contents(part: Any) -> dict[str, Any]:
    """The public attributes of an interaction, a constraint or a part of one."""
    found = {name: _content(each) for name, each in vars(part).items() if not name.startswith("_")}
    return {"kind": type(part).__name__, **dict(sorted(found.items()))}


def _content(value: Any) -> Any:
    if isinstance(value, Group):
        return value.name
    if isinstance(value, Law):
        value = value.func
    if callable(value) and hasattr(value, "__code__"):
        return f"{value.__name__}, checksum {zlib.crc32(_source(value)):08x}"
    if isinstance(value, dict):
        return {str(name): _content(each) for name, each in value.items()}
    if isinstance(value, tuple | list):
        return [_content(each) for each in value]
    if isinstance(value, Part) or dataclasses.is_dataclass(value):
        return value.__name__ if isinstance(value, type) else _contents(value)
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float):
        return value if np.isfinite(value) else repr(value)
    if isinstance(value, np.ndarray) and value.dtype != object:
        digest = zlib.crc32(np.ascontiguousarray(value).tobytes())
        return f"array of shape {value.shape}, checksum {digest:08x}"
    return _plain(value)


def _source(function: Any) -> bytes:
    """The text of a function; its code where there is no text."""
    try:
        return inspect.getsource(function).encode()
    except (OSError, TypeError):
        return function.__code__.co_code + repr(function.__code__.co_consts).encode()


def first_change(where: str, saved: Any, given: Any) -> tuple[str, Any, Any] | None:
    """The first place where two descriptions differ, and what each has there; None: nowhere."""
    if isinstance(saved, dict) and isinstance(given, dict):
        pairs: Iterable = (
            (f"{where}.{name}", saved.get(name, ABSENT), given.get(name, ABSENT))
            for name in {**saved, **given}
        )
    elif isinstance(saved, list) and isinstance(given, list) and len(saved) == len(given):
        pairs = ((f"{where}[{k}]", a, b) for k, (a, b) in enumerate(zip(saved, given, strict=True)))
    else:
        return None if saved == given else (where, _names(saved), _names(given))
    return next((found for each in pairs if (found := first_change(*each))), None)


def _names(value: Any) -> Any:
    """Lists of interactions or constraints by their names."""
    if isinstance(value, list):
        return [each.get("name", "...") if isinstance(each, dict) else each for each in value]
    return value


def _scene(scene: Scene) -> dict[str, Any]:
    box = scene.periodic
    return {
        "particle_count": scene.particle_count,
        "groups": [[group.name, len(group)] for group in scene.groups],
        "attributes": {
            name: "numbers" if width is None else f"vectors of {width}"
            for name, width in sorted(scene.attributes.items())
        },
        "periodic": None if box is None else [box[0].tolist(), box[1].tolist(), list(box[2])],
        "interactions": [_part(scene, part) for part in scene.interactions],
        "constraints": [_part(scene, part) for part in scene.constraints],
        **_thermostats(scene, lambda part: _part(scene, part)),
    }


def _thermostats(scene: Scene, described: Callable[[Part], Any]) -> dict[str, Any]:
    """Where there are any: descriptions from before there were know nothing of them."""
    found = [described(part) for part in scene.thermostats]
    return {"thermostats": found} if found else {}


def _part(scene: Scene, part: Part) -> dict[str, Any]:
    """An interaction or constraint by its kind and its public attributes."""
    found: dict[str, Any] = {"name": part.name, "kind": _plain(part.kind())}
    for name, value in sorted(vars(part).items()):
        if name.startswith("_"):
            continue
        if name == "group":
            found["particles"] = _array(select(scene, value, part.name))
        elif name == "parameters":
            found["parameters"] = {key: _array(np.asarray(each)) for key, each in value.items()}
        elif isinstance(value, np.ndarray):
            found[name] = _array(value)
        elif isinstance(value, Part):
            found[name] = _part(scene, value)
    return found


def _array(values: np.ndarray) -> str:
    """Floats by their shape; indices by what they are."""
    if np.issubdtype(values.dtype, np.floating) or values.ndim == 0:
        return f"values of shape {values.shape}"
    digest = zlib.crc32(np.ascontiguousarray(values, dtype=np.int64).tobytes())
    return f"indices of shape {values.shape}, checksum {digest:08x}"


def _plain(value: Any) -> Any:
    """A kind without anything that only this process knows: modules, addresses, objects."""
    if value is None or isinstance(value, bool | int | float):
        return value
    if isinstance(value, str):
        return re.sub(r" at 0x[0-9a-f]+", "", value)
    if isinstance(value, tuple | list):
        return [_plain(each) for each in value]
    if isinstance(value, type):
        return value.__name__
    if isinstance(value, Key):
        return [value.signature, *(_plain(each) for each in value.closure)]
    if isinstance(value, Law):
        value = value.func
    if isinstance(value, wp.Function):
        return value.key
    code = getattr(value, "__code__", None)
    if isinstance(code, CodeType):
        return _signature(value.__name__, code)
    if dataclasses.is_dataclass(value):
        fields = [getattr(value, field.name) for field in dataclasses.fields(value)]
        return [type(value).__name__, *(_plain(each) for each in fields)]
    return type(value).__name__


def _signature(name: str, code: CodeType) -> str:
    return f"{name}({', '.join(code.co_varnames[: code.co_argcount])})"
