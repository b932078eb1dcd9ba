"""Checks of single values: finite, of the declared type, and of a type that readers know."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from pxr import Usd, UsdGeom

from .clip_files import type_fault
from .fault import Fault

# What Blender 5.0 reads as an attribute, measured type by type. From points it drops, without a
# word, also every primvar whose name comes after one of another type.
READABLE = frozenset(
    "bool uchar int float float2 texCoord2f float3 vector3f normal3f point3f color3f color4f "
    "quatf".split()
)
# USD itself has these in half precision.
HALVES = frozenset({"orientations"})


def value_faults(attribute: Usd.Attribute, value: Any, frame: float | None) -> Iterator[Fault]:
    """A value that is not finite, or in half precision where single is declared."""
    if value is None:
        return
    name, prim = attribute.GetName(), str(attribute.GetPrim().GetPath())
    array = _numbers(value)
    if array is None or array.dtype.kind != "f" or not array.size:
        return
    if array.dtype == np.float16 and name not in HALVES:
        declared = str(attribute.GetTypeName())
        if "half" not in declared:
            yield type_fault(prim, name, frame, "half", declared)
    finite = np.isfinite(array)
    if not finite.all():
        at = tuple(int(k) for k in np.argwhere(~finite)[0])
        value = f"{array[at]} at {at[0]}" if array.ndim else str(array)
        remedy = "look for what made it so; fewer frames or smaller steps until it is gone"
        yield Fault("not finite", prim, name, frame, "be finite", value, remedy)


def _numbers(value: Any) -> np.ndarray | None:
    """A value as an array of numbers, or None for text and paths."""
    if isinstance(value, np.ndarray):
        return value
    if isinstance(value, bool | int | str):
        return None
    try:
        return np.asarray(value, dtype=None if isinstance(value, float) else np.float64)
    except (TypeError, ValueError):
        return None


def primvar_faults(prim: Usd.Prim) -> Iterator[Fault]:
    """Primvars of types that readers drop, and declared types in half precision."""
    for primvar in UsdGeom.PrimvarsAPI(prim).GetPrimvars():
        if not primvar.GetAttr().IsAuthored():
            continue
        kind = str(primvar.GetTypeName()).removesuffix("[]")
        if kind in READABLE or (kind in ("string", "token") and not prim.IsA(UsdGeom.PointBased)):
            continue
        path, name = str(prim.GetPath()), primvar.GetName()
        if "half" in kind or kind == "quath":
            yield type_fault(path, name, None, kind, kind.replace("half", "float"))
            continue
        condition = "have a type that readers know (float, int, float3, color3f)"
        remedy = "write it as one of these: readers drop it, and primvars after it, silently"
        yield Fault("primvar type", path, name, None, condition, kind, remedy)
