"""Checks of what is drawn: lengths of arrays, indices, and extents, at one frame.

``values`` are a prim's attributes by name, as ``recording.read`` gives them.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from pxr import Usd, UsdGeom

from .fault import Fault

# Four roundings of single precision: extents are points plus and minus a half width.
ROUNDING = 4 * 2.0**-23
ALONG = ("velocities", "accelerations", "ids", "orientations", "scales", "angularVelocities",
         "orientationsf", "invisibleIds")  # fmt: skip
Values = Mapping[str, Any]


def gprim_faults(prim: Usd.Prim, values: Values, frame: float | None) -> Iterator[Fault]:
    """What is wrong with a prim's arrays at a frame."""
    base = "positions" if prim.IsA(UsdGeom.PointInstancer) else "points"
    if prim.IsA(UsdGeom.PointBased) or base == "positions":
        if values.get(base) is None:
            yield _fault("missing", prim, base, frame, "have a value", "none", "write it")
            return
        sizes = _sizes(prim, values)
        yield from _length_faults(prim, values, sizes, frame)
        yield from _index_faults(prim, values, len(values[base]), frame)
    elif not prim.IsA(UsdGeom.Gprim):
        return
    yield from _extent_faults(prim, values, frame)


def _fault(
    kind: str,
    prim: Usd.Prim,
    name: str,
    frame: float | None,
    condition: str,
    value: str,
    remedy: str,
) -> Fault:
    return Fault(kind, str(prim.GetPath()), name, frame, condition, value, remedy)


def _sizes(prim: Usd.Prim, values: Values) -> dict[str, int]:
    """How many values each interpolation takes."""
    count = len(values["positions" if prim.IsA(UsdGeom.PointInstancer) else "points"])
    sizes = {"constant": 1, "vertex": count, "varying": count}
    if prim.IsA(UsdGeom.Mesh):
        sizes["uniform"] = _length(values, "faceVertexCounts")
        sizes["faceVarying"] = _length(values, "faceVertexIndices")
    elif prim.IsA(UsdGeom.BasisCurves):
        sizes["uniform"] = _length(values, "curveVertexCounts")
        if values.get("type") != UsdGeom.Tokens.linear:
            del sizes["varying"]  # depends on the basis
    elif prim.IsA(UsdGeom.Points):
        sizes["uniform"] = count
    return sizes


def _length(values: Values, name: str) -> int:
    value = values.get(name)
    return 0 if value is None else len(value)


def _length_faults(
    prim: Usd.Prim, values: Values, sizes: dict[str, int], frame: float | None
) -> Iterator[Fault]:
    """Arrays that do not have one value a point, or what their interpolation says."""
    for name in ALONG:
        value = values.get(name)
        # No velocities at all is what USD itself takes for none.
        if value is not None and len(value) not in (sizes["vertex"], 0) and name != "invisibleIds":
            yield _length_fault(prim, name, frame, sizes["vertex"], len(value), "one a point")
    for name, value in values.items():
        if name in ("widths", "normals"):
            default = "vertex"
        elif name.startswith("primvars:") and not name.endswith(":indices"):
            default = "constant"
        else:
            continue
        attribute = prim.GetAttribute(name)
        if not isinstance(value, np.ndarray) or not str(attribute.GetTypeName()).endswith("[]"):
            continue
        interpolation = attribute.GetMetadata("interpolation") or default
        wanted = sizes.get(interpolation)
        if wanted is None:
            continue
        wanted *= attribute.GetMetadata("elementSize") or 1
        index = values.get(f"{name}:indices")
        held = value if index is None else index
        if len(held) != wanted:
            yield _length_fault(prim, name, frame, wanted, len(held), f"as it is {interpolation}")
        if index is not None and len(index) and not 0 <= index.min() <= index.max() < len(value):
            yield _range_fault(prim, f"{name}:indices", frame, index, len(value))
        if name == "widths" and len(value) and value.min() < 0:
            text = ("be at least 0", f"{value.min():g}", "write diameters")
            yield _fault("width", prim, name, frame, *text)


def _length_fault(
    prim: Usd.Prim, name: str, frame: float | None, wanted: int, held: int, why: str
) -> Fault:
    condition, remedy = f"have {wanted} values, {why}", "write as many as there are points"
    return _fault("length", prim, name, frame, condition, str(held), remedy)


def _index_faults(
    prim: Usd.Prim, values: Values, count: int, frame: float | None
) -> Iterator[Fault]:
    """Faces, curves and instances that do not fit the points or prototypes."""
    if prim.IsA(UsdGeom.Mesh):
        counts, indices = values.get("faceVertexCounts"), values.get("faceVertexIndices")
        if counts is None or indices is None:
            name = "faceVertexCounts" if counts is None else "faceVertexIndices"
            yield _fault("missing", prim, name, frame, "have a value", "none", "write it")
            return
        yield from _sum_faults(prim, "faceVertexIndices", frame, counts, len(indices), 3)
        if len(indices) and not 0 <= indices.min() <= indices.max() < count:
            yield _range_fault(prim, "faceVertexIndices", frame, indices, count)
    elif prim.IsA(UsdGeom.BasisCurves):
        counts = values.get("curveVertexCounts")
        if counts is None:
            name = "curveVertexCounts"
            yield _fault("missing", prim, name, frame, "have a value", "none", "write it")
            return
        yield from _sum_faults(prim, "points", frame, counts, count, 2)
    elif prim.IsA(UsdGeom.PointInstancer):
        kinds = values.get("protoIndices")
        prototypes = len(UsdGeom.PointInstancer(prim).GetPrototypesRel().GetTargets())
        if kinds is None or len(kinds) != count:
            held = 0 if kinds is None else len(kinds)
            yield _length_fault(prim, "protoIndices", frame, count, held, "one an instance")
        elif count and not 0 <= kinds.min() <= kinds.max() < prototypes:
            yield _range_fault(prim, "protoIndices", frame, kinds, prototypes)
    ids = values.get("ids")
    if ids is not None and len(np.unique(ids)) != len(ids):
        order = np.sort(ids)
        twice = int(order[:-1][order[1:] == order[:-1]][0])
        text = ("be different", f"{twice} twice", "give every particle its own")
        yield _fault("ids", prim, "ids", frame, *text)


def _sum_faults(
    prim: Usd.Prim, name: str, frame: float | None, counts: np.ndarray, held: int, least: int
) -> Iterator[Fault]:
    """Counts that are too small, or do not add up to what there is."""
    total = int(counts.sum())
    if total != held:
        yield _length_fault(prim, name, frame, total, held, "the sum of the counts")
    if len(counts) and counts.min() < least:
        what = "faceVertexCounts" if least == 3 else "curveVertexCounts"
        text = (f"be at least {least}", str(int(counts.min())), "leave such ones out")
        yield _fault("count", prim, what, frame, *text)


def _range_fault(
    prim: Usd.Prim, name: str, frame: float | None, indices: np.ndarray, count: int
) -> Fault:
    bad = indices[(indices < 0) | (indices >= count)]
    text = (f"be in 0..{count - 1}", str(int(bad[0])), "point to what is there")
    return _fault("index", prim, name, frame, *text)


def _extent_faults(prim: Usd.Prim, values: Values, frame: float | None) -> Iterator[Fault]:
    """An extent that is not there, or is not the bound of what is drawn."""
    try:
        expected = _bound(prim, values, frame)
    except ValueError:  # lengths that disagree, reported above
        return
    if expected is None or not np.isfinite(expected).all():
        return
    held = values.get("extent")
    if held is None:
        if prim.IsA(UsdGeom.PointBased) or prim.IsA(UsdGeom.PointInstancer):
            text = ("have a value", "none", "write it at every frame: renderers cull by it")
            yield _fault("missing extent", prim, "extent", frame, *text)
        return
    if held.shape != (2, 3):
        text = ("be two corners", f"{len(held)}", "write lower and upper")
        yield _fault("wrong extent", prim, "extent", frame, *text)
        return
    slack = ROUNDING * float(np.abs(expected).max())
    moving = prim.GetAttribute("extent").ValueMightBeTimeVarying()
    outside = (held[0] > expected[0] + slack).any() or (held[1] < expected[1] - slack).any()
    # One extent for all frames holds them all; one a frame is the bound of that frame.
    still = not moving and any(
        prim.GetAttribute(name).ValueMightBeTimeVarying() for name in ("points", "positions")
    )
    if outside or (not still and (np.abs(held - expected) > slack).any()):
        text = (f"be {_corners(expected)}", _corners(held), "write the bound of points and widths")
        yield _fault("wrong extent", prim, "extent", frame, *text)


def _bound(prim: Usd.Prim, values: Values, frame: float | None) -> np.ndarray | None:
    """Corners (2, 3) of what is drawn; None: nothing is, or nothing is known of it."""
    if not prim.IsA(UsdGeom.PointBased):
        boundable = UsdGeom.Boundable(prim)
        time = Usd.TimeCode.Default() if frame is None else frame
        bound = UsdGeom.Boundable.ComputeExtentFromPlugins(boundable, time) if boundable else None
        return None if bound is None or not len(bound) else np.array(bound, dtype=np.float64)
    points = values["points"]
    if not len(points):
        return None
    half = 0.5 * np.asarray(values["widths"] if _wide(prim, values) else 0.0, dtype=np.float64)
    if prim.IsA(UsdGeom.Curves):
        half = half.max()
    columns = [points[:, k].astype(np.float64) for k in range(3)]
    return np.array([[(x - half).min() for x in columns], [(x + half).max() for x in columns]])


def _wide(prim: Usd.Prim, values: Values) -> bool:
    """Whether the points have widths."""
    thick = prim.IsA(UsdGeom.Points) or prim.IsA(UsdGeom.Curves)
    return thick and _length(values, "widths") > 0


def _corners(box: np.ndarray) -> str:
    lower, upper = (", ".join(f"{x:.6g}" for x in corner) for corner in box)
    return f"({lower}) to ({upper})"
