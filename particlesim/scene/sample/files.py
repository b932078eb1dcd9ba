"""Meshes from files, by meshio."""

from __future__ import annotations

import os
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ... import validate

OWNER = "sample.mesh"
SPLIT = {"triangle": [[0, 1, 2]], "quad": [[0, 1, 2], [0, 2, 3]]}  # into triangles


class Mesh(NamedTuple):
    """What a file holds: vertices (v, 3) [length], triangles (t, 3), tetrahedra (n, 4)."""

    vertices: np.ndarray
    triangles: np.ndarray
    tetrahedra: np.ndarray


def mesh(path: str | os.PathLike[str]) -> Mesh:
    """A mesh from a file: OBJ, PLY, STL, OFF, VTK, Gmsh and what else meshio reads.

    Quadrilaterals are split along a diagonal; other cells, and vertices that none of those kept
    has, are left out.

    Args:
        path: The file, of a known ending.

    Returns:
        Vertices, triangles (none of a file of tetrahedra alone: see :func:`sample.surface`) and
        tetrahedra (none of a surface).

    Raises:
        ImportError: meshio is not installed.
        FileNotFoundError: There is no such file.
        ValueError: A file that cannot be read, or has neither triangles nor tetrahedra.
    """
    meshio = validate.installed(OWNER, "meshio", "mesh")
    if not Path(path).exists():
        raise FileNotFoundError(
            f"{OWNER}: path must be a file, got {str(path)!r}, which does not exist; "
            "look for its name."
        )
    try:
        read = meshio.read(path)
    except (meshio.ReadError, ValueError, KeyError, IndexError, SystemExit) as error:
        # Some of its readers say nothing of what they meet, and some releases exit.
        raise validate.fail(
            OWNER, "path", "be a mesh that meshio can read", str(path),
            str(error) or "try another format",
        ) from None  # fmt: skip
    triangles = np.concatenate(
        [read.get_cells_type(kind)[:, part] for kind, parts in SPLIT.items() for part in parts]
    )
    tetrahedra = read.get_cells_type("tetra")
    used, back = np.unique(
        np.concatenate([triangles.ravel(), tetrahedra.ravel()]).astype(np.int64),
        return_inverse=True,
    )
    if not len(used):
        raise validate.fail(
            OWNER, "path", "hold triangles or tetrahedra", str(path), "export it as a mesh"
        )
    vertices = np.zeros((len(used), 3))
    vertices[:, : read.points.shape[1]] = np.asarray(read.points, dtype=float)[used, :3]
    cut = triangles.size
    return Mesh(vertices, back[:cut].reshape(-1, 3), back[cut:].reshape(-1, 4))
