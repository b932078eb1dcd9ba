"""PLY: one binary file a frame, for whatever reads points."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from .base import ParticleFrame
from .folder import FolderRecorder

TYPES = {"f4": "float", "f8": "double", "i4": "int", "u4": "uint"}
# What readers of PLY call them.
NAMES = {"position": ("x", "y", "z"), "velocity": ("vx", "vy", "vz")}


class PlyRecorder(FolderRecorder):
    """Records frames as binary little-endian PLY files, ``out.frames/f.######.ply``.

    The properties of an element ``vertex`` are ``x y z vx vy vz radius id group world`` and the
    fields, ``<name>`` or ``<name>_x <name>_y <name>_z``. Groups that were given triangles are also
    in an element ``face``, less those of which an edge is broken. Comments hold the frame, the time
    and the names of the groups. There is no file ``out.ply``: readers take the numbered files as a
    series.

    Arguments are those of :class:`~particlesim.output.recorders.base.ParticleRecorder`.

    Example:
        >>> from particlesim import Scene, Simulation
        >>> scene = Scene()
        >>> ball = scene.add_particles([(0, 1, 0)], velocity=(1, 0, 0))
        >>> with PlyRecorder(Simulation(scene, device="cpu"), "ball.ply") as recorder:
        ...     recorder.write()
        >>> open("ball.frames/f.000000.ply", "rb").readline()
        b'ply\\n'
    """

    suffix = ".ply"

    def _save(self, path: Path, frame: ParticleFrame) -> None:
        columns = [part for name, array in frame.columns.items() for part in _parts(name, array)]
        table = np.empty(len(columns[0][1]), dtype=[(name, each.dtype) for name, each in columns])
        for name, each in columns:
            table[name] = each
        with open(path, "wb") as file:
            file.write(self._header(frame, table).encode("ascii", "backslashreplace"))
            file.write(table.tobytes())
            faces = np.empty(len(frame.triangles), dtype=[("count", "u1"), ("corners", "<i4", 3)])
            faces["count"], faces["corners"] = 3, frame.triangles
            file.write(faces.tobytes())

    def _header(self, frame: ParticleFrame, table: np.ndarray) -> str:
        comments = [f"frame {frame.number}", f"time {frame.time!r}"]
        comments += [f"group {k} {name}" for k, name in enumerate(self.group_names)]
        lines = [
            "ply",
            "format binary_little_endian 1.0",
            *(f"comment {' '.join(comment.split())}" for comment in comments),
            f"element vertex {len(table)}",
            *(
                f"property {TYPES[table[name].dtype.str[1:]]} {name}"
                for name in table.dtype.names or ()
            ),
            *self._faces(frame),
            "end_header",
        ]
        return "\n".join(lines) + "\n"

    def _faces(self, frame: ParticleFrame) -> list[str]:
        count = f"element face {len(frame.triangles)}"
        return [count, "property list uchar int vertex_indices"] if self.skins else []


def _parts(name: str, array: np.ndarray) -> list[tuple[str, np.ndarray]]:
    """A column as properties of one number each, little-endian."""
    array = array.astype(array.dtype.newbyteorder("<"), copy=False)
    if array.ndim == 1:
        return [(name, array)]
    names = NAMES.get(name, tuple(f"{name}_{axis}" for axis in "xyz"))
    return [(each, array[:, k]) for k, each in enumerate(names)]
