"""Frames as bytes: what a page draws, in arrays that go to the graphics card as they are.

A packet is a 32-bit count, so many bytes of JSON, and after them the arrays, all little endian and
at multiples of four. The JSON holds ``frame`` and ``arrays``, by ``<layer>.<name>``

    ball, cone, wire    float32 (n, 4): x, y, z, radius; or (n, 3), and one ``radius`` in the JSON
    corner, veil, edge  float32 (n, 3): triangles, clear triangles, and lines
    normal              int8 (n, 4): of the corners, times 127; left out where faces are flat
    <name>_color        uint8 (n, 4): sRGB and opacity; one row where all are equal
"""

from __future__ import annotations

import json
import struct
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from ...output import colors
from ..render.geometry import Geometry

ROUND = ("ball", "cone", "wire")
STEPS = 4096  # of linear light, fine enough for 8 bits of sRGB
FORMATS = {"<f4": "float32", "|u1": "uint8", "|i1": "int8"}
SRGB = np.rint(255 * colors.encoded(np.linspace(0.0, 1.0, STEPS))).astype(np.uint8)


def packed(frame: float, layers: Mapping[str, Geometry], edges: np.ndarray) -> bytes:
    """A packet.

    Args:
        frame: Its time code.
        layers: What is drawn, by the name of its layer.
        edges: Ends of lines that outline boundaries, (m, 2, 3) [length].
    """
    described: dict[str, dict[str, Any]] = {}
    blocks: list[bytes] = []
    offset = 0
    for name, array, notes in _arrays(layers, edges):
        block = array.tobytes()
        described[name] = {
            "type": FORMATS[array.dtype.str], "width": array.shape[1], "count": len(array),
            "offset": offset, **notes,
        }  # fmt: skip
        blocks.append(block)
        offset += len(block)
    header = {"frame": frame, "arrays": described}
    text = json.dumps(header, separators=(",", ":"), allow_nan=False).encode()
    text += b" " * (-len(text) % 4)
    return b"".join([struct.pack("<I", len(text)), text, *blocks])


def _arrays(
    layers: Mapping[str, Geometry], edges: np.ndarray
) -> Iterator[tuple[str, np.ndarray, dict[str, Any]]]:
    """Name, array and further notes of all that there is."""
    for layer, geometry in layers.items():
        for name in ROUND:
            rows = geometry.array(name)
            if len(rows):
                yield f"{layer}.{name}", *_round(rows)
                yield f"{layer}.{name}_color", _bytes(geometry.array(f"{name}_color")), {}
        corners = geometry.array("corner")
        if len(corners):
            yield f"{layer}.corner", _floats(corners), {}
            yield f"{layer}.corner_color", _bytes(geometry.array("corner_color")), {}
            normals = geometry.array("normal")
            if normals.any():
                yield f"{layer}.normal", _directions(normals), {}
        veils = geometry.array("veil")
        if len(veils):
            opacity = geometry.array("veil_opacity")
            yield f"{layer}.veil", _floats(veils), {}
            yield f"{layer}.veil_color", _bytes(geometry.array("veil_color"), opacity), {}
    if len(edges):
        yield "boundary.edge", _floats(edges.reshape(-1, 3)), {}


def _floats(rows: np.ndarray) -> np.ndarray:
    return np.ascontiguousarray(rows, dtype="<f4")


def _round(rows: np.ndarray) -> tuple[np.ndarray, dict[str, Any]]:
    """Centers and radii; where all radii are equal, only one of them."""
    radius = float(rows[0, 3])
    if (rows[:, 3] == rows[0, 3]).all():
        return _floats(rows[:, :3]), {"radius": radius}
    return _floats(rows), {}


def _bytes(linear: np.ndarray, opacity: np.ndarray | None = None) -> np.ndarray:
    """Colours as bytes; where all are equal, only one of them.

    Args:
        linear: (n, 3).
        opacity: (n,) of triangles, whose corners then have the colour each.
    """
    alike = (linear == linear[0]).all() and (opacity is None or (opacity == opacity[0]).all())
    if alike:
        linear, opacity = linear[:1], opacity if opacity is None else opacity[:1]
    # What is not a number has no place in the table, and is drawn white.
    at = np.fmax(np.fmin(linear, 1.0), 0.0) * np.float32(STEPS - 1)
    rows = np.full((len(linear), 4), 255, dtype=np.uint8)
    rows[:, :3] = SRGB[(at + np.float32(0.5)).astype(np.int16)]
    if opacity is not None:
        rows[:, 3] = np.rint(255 * opacity.clip(0.0, 1.0))
    return rows if alike or opacity is None else np.repeat(rows, 3, axis=0)


def _directions(normals: np.ndarray) -> np.ndarray:
    """Directions as bytes; nothing stays nothing, which is drawn flat."""
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    unit = np.divide(normals, length, out=np.zeros_like(normals), where=length > 0)
    rows = np.zeros((len(normals), 4), dtype=np.int8)
    rows[:, :3] = np.rint(127 * unit)
    return rows
