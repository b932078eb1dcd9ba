"""The values of one frame: checked, in single precision, in the order of the description."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from pxr import Sdf, Tf

from .... import validate
from ..description import (
    LinksPrim,
    MeshPrim,
    PointsPrim,
    Shape,
    StageInfo,
    particle_ids,
    row_indices,
)
from ..description import row_pairs as checked_pairs

OWNER = "UsdRecorder.write"
KINDS: dict[int | str, Sdf.ValueTypeName] = {
    1: Sdf.ValueTypeNames.FloatArray,
    3: Sdf.ValueTypeNames.Float3Array,
    "int": Sdf.ValueTypeNames.IntArray,
    "color": Sdf.ValueTypeNames.Color3fArray,
}
# Fields that USD has itself: they take the place of what is the same for a whole group.
BUILT_IN: dict[str, int | str] = {"displayColor": "color", "widths": 1}
# Readers take these names to mean something else than a value of the particle.
TAKEN_FIELDS = frozenset(
    "points positions position velocities velocity accelerations normals radius ids pid scales "
    "orientations displayOpacity st".split()
)


@dataclass(frozen=True, eq=False)
class Surface:
    """A mesh in one frame; triangles are None where they never change."""

    points: np.ndarray
    normals: np.ndarray
    triangles: np.ndarray | None
    velocities: np.ndarray | None
    rows: Any = None


@dataclass(frozen=True, eq=False)
class Frame:
    """One frame. Lists are in the order of the description."""

    number: int
    x: np.ndarray
    v: np.ndarray
    fields: dict[str, np.ndarray]  # by primvar
    clouds: list[tuple[Any, np.ndarray | None]]  # rows, and ids where they change
    pairs: list[np.ndarray]
    surfaces: list[Surface]
    poses: list[np.ndarray | None]  # (4, 4), a point in a row times the pose
    notes: dict[str, Any]
    box: np.ndarray | None  # lengths of a box that changes, (3,)

    def widths(self, prim: PointsPrim, rows: Any) -> np.ndarray | float | None:
        """Diameters of a group: the frame's own, or those of the description."""
        return self.fields["widths"][rows] if "widths" in self.fields else prim.widths


def primvar(name: str) -> str:
    """Name of a field's primvar, without the namespace."""
    return Tf.MakeValidIdentifier(name)


def field_kinds(fields: Mapping[str, int | str]) -> dict[str, int | str]:
    """The fields of a recording, checked."""
    owner = "UsdRecorder"
    primvars: dict[str, str] = {}
    for name, kind in fields.items():
        if kind not in KINDS:
            raise validate.fail(
                owner, f"fields[{name!r}]", "have 1 or 3 numbers, 'int' or 'color'", kind,
                "split it up",
            )  # fmt: skip
        own = primvar(name)
        if own in TAKEN_FIELDS or own in primvars or BUILT_IN.get(own, kind) != kind:
            taken = f"have another name than {primvars.get(own, 'what USD has itself')!r}"
            raise validate.fail(owner, "fields", taken, name, "leave it out or rename it")
        primvars[own] = name
    return dict(fields)


class FrameChecker:
    """Makes a :class:`Frame` of what a writer is given, or says what is wrong with it.

    Args:
        info: The description.
        paths: Prim paths of its groups, for messages.
        fields: Name to kind (see ``KINDS``).
    """

    def __init__(self, info: StageInfo, paths: Sequence[Sdf.Path], fields: Mapping[str, int | str]):
        self.info, self.paths, self.fields = info, paths, dict(fields)
        used = [prim.rows for prim in info.points] + [mesh.rows for mesh in info.meshes]
        used += [links.pairs for links in info.links if links.pairs is not None]
        self.row_count = _row_count(used)

    def frame(
        self,
        number: int,
        position: Any,
        velocity: Any,
        fields: Mapping[str, Any] | None,
        rows: Mapping[PointsPrim, tuple[Any, Any]] | None,
        pairs: Mapping[LinksPrim, Any] | None,
        meshes: Mapping[MeshPrim, Any] | None,
        poses: Mapping[Shape, tuple[Any, Any]] | None,
        notes: Mapping[str, Any] | None,
        box: Any,
    ) -> Frame:
        """The frame of these values (see ``UsdWriter.write``)."""
        info = self.info
        given = dict(fields or {})
        if given.keys() != self.fields.keys():
            raise validate.fail(
                OWNER, "fields", f"be {sorted(self.fields)}", sorted(given), "give just these"
            )
        clouds = [_cloud(prim, found) for prim, found in _paired(
            "rows", info.points, [prim.indices is None for prim in info.points], rows)]  # fmt: skip
        links = [
            prim.pairs if found is None else checked_pairs(OWNER, found, empty=True)
            for prim, found in _paired(
                "pairs", info.links, [prim.pairs is None for prim in info.links], pairs)
        ]  # fmt: skip
        own = [c[0] for c, p in zip(clouds, info.points, strict=True) if p.indices is None]
        needed = max(self.row_count, _row_count([*own, *(pairs or {}).values()]))
        x = self._array("position", position, 3, number, needed)
        v = self._array("velocity", velocity, 3, number, needed, info.velocity_scale)
        values = {
            primvar(name): self._array(name, given[name], kind, number, needed)
            for name, kind in self.fields.items()
        }
        surfaces = [_surface(prim, found, x, v, number) for prim, found in _paired(
            "meshes", info.meshes, [prim.triangles is None for prim in info.meshes], meshes
        )]  # fmt: skip
        matrices = [
            None if found is None else _pose(shape, *found)
            for shape, found in _paired(
                "poses", info.shapes, [shape.moving for shape in info.shapes], poses)
        ]  # fmt: skip
        sides = validate.vector(OWNER, "box", box) if info.flexible else None
        notes = dict(notes or {})
        return Frame(number, x, v, values, clouds, links, surfaces, matrices, notes, sides)

    def _array(
        self, name: str, given: Any, kind: int | str, number: int, needed: int, scale: float = 1.0
    ) -> np.ndarray:
        """(n, 3) or (n,), single precision and finite, or 32-bit whole numbers."""
        array = np.asarray(given.numpy() if hasattr(given, "numpy") else given)
        row_shape = (3,) if kind in (3, "color") else ()
        if array.ndim == 0 or array.shape[1:] != row_shape or len(array) < needed:
            wanted = f"have shape {(needed, *row_shape)}, or more rows"
            raise validate.fail(OWNER, name, wanted, array.shape, "give a row a particle")
        if kind == "int":
            return _whole(name, array)
        with np.errstate(over="ignore"):  # becomes infinite, which is found below
            values = np.ascontiguousarray(array, dtype=np.float32)
            values = values if scale == 1.0 else values * np.float32(scale)
        good = np.isfinite(values)
        if not good.all():
            row = int(np.argmin(good.reshape(len(values), -1).all(axis=1)))
            raise validate.fail(
                OWNER,
                f"{name} of particle {row}{self._place(row)} at frame {number}",
                "be finite in single precision",
                array[row],
                "look for what made it so, or take a smaller dt",
            )
        if name == "widths" and len(values) and values.min() < 0:
            raise validate.fail(
                OWNER, name, "be at least 0 [length]", float(values.min()), "give diameters"
            )
        return values

    def _place(self, row: int) -> str:
        for prim, path in zip(self.info.points, self.paths, strict=True):
            found = np.flatnonzero(prim.rows == row)
            if len(found) and prim.ids is not None:
                return f" ({path}, id {prim.ids[found[0]]})"
        return ""


def _row_count(used: Iterable[Any]) -> int:
    """How many rows arrays must have for these indices."""
    count = 0
    for rows in used:
        if isinstance(rows, slice):
            count = max(count, rows.stop)
        elif np.size(rows):
            count = max(count, 1 + int(np.max(rows)))
    return count


def _paired(
    name: str, prims: Sequence[Any], open_ones: Sequence[bool], given: Mapping[Any, Any] | None
) -> list[tuple[Any, Any]]:
    """Every part of a description with what the frame gives for it, None where it is fixed."""
    given = given or {}
    wanted = {prim for prim, is_open in zip(prims, open_ones, strict=True) if is_open}
    if given.keys() != wanted:
        raise validate.fail(
            OWNER, name, f"be for {sorted(prim.name for prim in wanted)}, which leave them open",
            sorted(getattr(prim, "name", prim) for prim in given), "give just these",
        )  # fmt: skip
    return [(prim, given.get(prim)) for prim in prims]


def _cloud(prim: PointsPrim, found: tuple[Any, Any] | None) -> tuple[Any, np.ndarray | None]:
    """Rows of a group, and its ids where they change."""
    if found is None:
        return prim.indices, None
    rows = row_indices(OWNER, "rows", found[0], empty=True)
    count = rows.stop - rows.start if isinstance(rows, slice) else len(rows)
    return rows, particle_ids(OWNER, found[1], count)


def _surface(
    prim: MeshPrim,
    found: Any,
    x: np.ndarray,
    v: np.ndarray,
    number: int,
) -> Surface:
    """A mesh: of a group as it is now, or as given."""
    if prim.indices is not None:
        points, own = x[prim.indices], prim.triangles
        if own is None:
            found = validate.triangles(OWNER, found, len(points), proper=False)
        normals = vertex_normals(points, found if own is None else own)
        return Surface(points, normals, found, v[prim.indices], prim.indices)
    points, normals = (
        validate.rows(OWNER, f"at frame {number} {name} of {prim.name!r}", array, None, 3)
        for name, array in (("points", found[0]), ("normals", found[2]))
    )
    if len(points) != len(normals):
        raise validate.fail(
            OWNER, f"normals of {prim.name!r}", f"have shape ({len(points)}, 3)", normals.shape,
            "give one a point",
        )  # fmt: skip
    indices = validate.triangles(OWNER, found[1], len(points), proper=False)
    return Surface(points.astype(np.float32), normals.astype(np.float32), indices, None)


def _pose(shape: Shape, translation: Any, rotation: Any) -> np.ndarray:
    """(4, 4), for points in rows: the transpose of R x + t."""
    pose = np.eye(4)
    pose[3, :3] = validate.vector(OWNER, f"translation of {shape.name!r}", translation)
    matrix = validate.rows(OWNER, f"rotation of {shape.name!r}", rotation, 3, 3)
    # Single precision is good enough for what rounding leaves of a rotation.
    if np.abs(matrix @ matrix.T - np.eye(3)).max() > 1e-4 or np.linalg.det(matrix) < 0:
        raise validate.fail(
            OWNER, f"rotation of {shape.name!r}", "turn and not stretch", rotation,
            "give R with R R^T = 1 and det R = 1",
        )  # fmt: skip
    pose[:3, :3] = matrix.T
    return pose


def _whole(name: str, array: np.ndarray) -> np.ndarray:
    """Whole numbers of 32 bits: Blender loses those of 64."""
    limits = np.iinfo(np.int32)
    if not np.issubdtype(array.dtype, np.integer):
        raise validate.fail(OWNER, name, "be whole numbers", array, "record it with 1 number")
    if len(array) and (array.min() < limits.min or array.max() > limits.max):
        raise validate.fail(OWNER, name, "fit into 32 bits", array, "number from 0")
    return np.ascontiguousarray(array, dtype=np.int32)


def vertex_normals(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Unit normals of points (n, 3): means of their triangles' (t, 3), weighted by area; float32.

    A point without area around it has (0, 0, 1): a direction that renderers can use.
    """
    x = points.astype(np.float64)
    a, b, c = (x[triangles[:, k]] for k in range(3))
    twice_area = np.cross(b - a, c - a)
    corners = triangles.ravel()
    normals = np.stack(
        [np.bincount(corners, np.repeat(twice_area[:, k], 3), len(x)) for k in range(3)], axis=1
    )
    length = np.linalg.norm(normals, axis=1)
    flat = length == 0
    normals[flat], length[flat] = (0.0, 0.0, 1.0), 1.0
    return (normals / length[:, None]).astype(np.float32)
