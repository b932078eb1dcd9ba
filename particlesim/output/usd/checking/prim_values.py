"""Checks of what prims hold: numbers and types, and lengths, indices and extents of arrays."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from pxr import Usd, UsdGeom

from .fault import Fault, type_fault

# What Blender 5.0 reads as an attribute, measured type by type. From points it drops, without a
# word, also every primvar whose name comes after one of another type.
READABLE = frozenset(
    "bool uchar int float float2 texCoord2f float3 vector3f normal3f point3f color3f color4f "
    "quatf".split()
)
# USD itself has these in half precision.
HALVES = frozenset({"orientations"})
# Four roundings of single precision: extents are points plus and minus a half width.
ROUNDING = 4 * 2.0**-23
ALONG = ("velocities", "accelerations", "ids", "orientations", "scales", "angularVelocities",
         "orientationsf")  # fmt: skip
# Which array says what each face or curve takes of the points, and how many are the least.
COUNTS = {UsdGeom.Mesh: ("faceVertexCounts", 3), UsdGeom.BasisCurves: ("curveVertexCounts", 2)}


def gprim_faults(prim: Usd.Prim, values: Mapping[str, Any], frame: float | None) -> Iterator[Fault]:
    """What is wrong with a prim's arrays at a frame; ``values`` are its attributes by name."""
    base = "positions" if prim.IsA(UsdGeom.PointInstancer) else "points"
    look = _Look(prim, values, frame, _size(values.get(base)))
    if prim.IsA(UsdGeom.PointBased) or base == "positions":
        if values.get(base) is None:
            yield look.missing(base)
            return
        yield from look.lengths()
        yield from look.indices()
        yield from look.ids()
    elif not prim.IsA(UsdGeom.Gprim):
        return
    yield from look.extent()


def _size(array: Any) -> int:
    """Length of an array, 0 of none."""
    return 0 if array is None else len(array)


@dataclass(frozen=True)
class _Look:
    """A look at one prim at one frame; ``count`` are its points or instances."""

    prim: Usd.Prim
    values: Mapping[str, Any]
    frame: float | None
    count: int

    def fault(self, kind: str, name: str, condition: str, value: Any, remedy: str) -> Fault:
        path = str(self.prim.GetPath())
        return Fault(kind, path, name, self.frame, condition, str(value), remedy)

    def missing(self, name: str) -> Fault:
        return self.fault("missing", name, "have a value", "none", "write it")

    def length(self, name: str, wanted: int, held: int, why: str) -> Fault:
        condition, remedy = f"have {wanted} values, {why}", "write as many as there are points"
        return self.fault("length", name, condition, held, remedy)

    def outside(self, name: str, indices: np.ndarray, count: int) -> Iterator[Fault]:
        """Indices beyond the ``count`` things that they point to."""
        bad = indices[(indices < 0) | (indices >= count)]
        if len(bad):
            remedy = "point to what is there"
            yield self.fault("index", name, f"be in 0..{count - 1}", int(bad[0]), remedy)

    def sizes(self) -> dict[str, int]:
        """How many values each interpolation takes."""
        prim, values = self.prim, self.values
        sizes = {"constant": 1, "vertex": self.count, "varying": self.count}
        if prim.IsA(UsdGeom.Mesh):
            sizes["uniform"] = _size(values.get("faceVertexCounts"))
            sizes["faceVarying"] = _size(values.get("faceVertexIndices"))
        elif prim.IsA(UsdGeom.BasisCurves):
            sizes["uniform"] = _size(values.get("curveVertexCounts"))
            if values.get("type") != UsdGeom.Tokens.linear:
                del sizes["varying"]  # depends on the basis
        elif prim.IsA(UsdGeom.Points):
            sizes["uniform"] = self.count
        return sizes

    def lengths(self) -> Iterator[Fault]:
        """Arrays that do not have one value a point, or what their interpolation says."""
        for name in ALONG:
            held = _size(self.values.get(name))
            # No velocities at all is what USD itself takes for none.
            if held not in (self.count, 0):
                yield self.length(name, self.count, held, "one a point")
        sizes = self.sizes()
        for name, value in self.values.items():
            if name in ("widths", "normals"):
                default = "vertex"
            elif name.startswith("primvars:") and not name.endswith(":indices"):
                default = "constant"
            else:
                continue
            attribute = self.prim.GetAttribute(name)
            interpolation = attribute.GetMetadata("interpolation") or default
            is_array = str(attribute.GetTypeName()).endswith("[]")
            if isinstance(value, np.ndarray) and is_array and interpolation in sizes:
                wanted = sizes[interpolation] * (attribute.GetMetadata("elementSize") or 1)
                yield from self.interpolated(name, value, wanted, f"as it is {interpolation}")

    def interpolated(self, name: str, value: np.ndarray, wanted: int, why: str) -> Iterator[Fault]:
        """One array that has an interpolation, and perhaps indices."""
        index = self.values.get(f"{name}:indices")
        held = len(value if index is None else index)
        if held != wanted:
            yield self.length(name, wanted, held, why)
        if index is not None:
            yield from self.outside(f"{name}:indices", index, len(value))
        if name == "widths" and len(value) and value.min() < 0:
            least = f"{value.min():g}"
            yield self.fault("width", name, "be at least 0", least, "write diameters")

    def indices(self) -> Iterator[Fault]:
        """Faces, curves and instances that do not fit the points or prototypes."""
        for kind, (name, least) in COUNTS.items():
            if self.prim.IsA(kind):
                yield from self.counts(name, least)
        if self.prim.IsA(UsdGeom.PointInstancer):
            kinds = self.values.get("protoIndices")
            prototypes = len(UsdGeom.PointInstancer(self.prim).GetPrototypesRel().GetTargets())
            if kinds is None or len(kinds) != self.count:
                yield self.length("protoIndices", self.count, _size(kinds), "one an instance")
            else:
                yield from self.outside("protoIndices", kinds, prototypes)

    def counts(self, name: str, least: int) -> Iterator[Fault]:
        """Counts of faces or curves that are too small, or do not add up to what there is."""
        counts, held = self.values.get(name), self.count
        divided = "points"
        if self.prim.IsA(UsdGeom.Mesh):
            divided = "faceVertexIndices"
            corners = self.values.get(divided)
            if counts is not None and corners is None:
                yield self.missing(divided)
                return
            held = _size(corners)
        if counts is None:
            yield self.missing(name)
            return
        if int(counts.sum()) != held:
            yield self.length(divided, int(counts.sum()), held, "the sum of the counts")
        if len(counts) and counts.min() < least:
            text = (f"be at least {least}", int(counts.min()), "leave such ones out")
            yield self.fault("count", name, *text)
        if divided != "points":
            yield from self.outside(divided, self.values[divided], self.count)

    def ids(self) -> Iterator[Fault]:
        """Two particles with one number."""
        order = np.sort(self.values["ids"]) if self.values.get("ids") is not None else np.zeros(0)
        twice = order[:-1][order[1:] == order[:-1]]
        if len(twice):
            text = ("be different", f"{int(twice[0])} twice", "give every particle its own")
            yield self.fault("ids", "ids", *text)

    def extent(self) -> Iterator[Fault]:
        """An extent that is not there, or is not the bound of what is drawn."""
        prim, held = self.prim, self.values.get("extent")
        try:
            expected = self.bound()
        except ValueError:  # lengths that disagree, reported above
            return
        if expected is None or not np.isfinite(expected).all():
            return
        if held is None:
            if prim.IsA(UsdGeom.PointBased) or prim.IsA(UsdGeom.PointInstancer):
                text = ("have a value", "none", "write it at every frame: renderers cull by it")
                yield self.fault("missing extent", "extent", *text)
            return
        if held.shape != (2, 3):
            remedy = "write lower and upper"
            yield self.fault("wrong extent", "extent", "be two corners", len(held), remedy)
            return
        slack = ROUNDING * float(np.abs(expected).max())
        outside = (held[0] > expected[0] + slack).any() or (held[1] < expected[1] - slack).any()
        # One extent for all frames holds them all; one a frame is the bound of that frame.
        moving = {
            name: prim.GetAttribute(name).ValueMightBeTimeVarying()
            for name in ("extent", "points", "positions")
        }
        still = not moving["extent"] and (moving["points"] or moving["positions"])
        if outside or (not still and (np.abs(held - expected) > slack).any()):
            remedy = "write the bound of points and widths"
            text = (f"be {_corners(expected)}", _corners(held), remedy)
            yield self.fault("wrong extent", "extent", *text)

    def bound(self) -> np.ndarray | None:
        """Corners (2, 3) of what is drawn; None: nothing is, or nothing is known of it."""
        prim, points = self.prim, self.values.get("points")
        if not prim.IsA(UsdGeom.PointBased):
            boundable = UsdGeom.Boundable(prim)
            time = Usd.TimeCode.Default() if self.frame is None else self.frame
            found = boundable and UsdGeom.Boundable.ComputeExtentFromPlugins(boundable, time)
            return np.array(found, dtype=np.float64) if found and len(found) else None
        if points is None or not len(points):
            return None
        widths = self.values.get("widths")
        thick = prim.IsA(UsdGeom.Points) or prim.IsA(UsdGeom.Curves)
        half = 0.5 * np.asarray(widths if thick and _size(widths) else 0.0, dtype=np.float64)
        if prim.IsA(UsdGeom.Curves):
            half = half.max()
        columns = [points[:, k].astype(np.float64) for k in range(3)]
        return np.array([[(x - half).min() for x in columns], [(x + half).max() for x in columns]])


def _corners(box: np.ndarray) -> str:
    lower, upper = (", ".join(f"{x:.6g}" for x in corner) for corner in box)
    return f"({lower}) to ({upper})"


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
