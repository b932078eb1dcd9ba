"""VTKHDF, read by ParaView and VTK: a file for every frame, and one that shows them as a series.

The layout is that of the VTKHDF specification for PolyData, version 2: every particle is a point
and a vertex cell. In the series each array is all frames' arrays one behind the other, and
``Steps`` says where each frame begins; the arrays themselves stay in the frames' files, which
virtual datasets lead to.
"""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import numpy as np

from .. import files
from .base import KEPT, ParticleFrame
from .folder import FolderRecorder

VERSION = (2, 0)
CELLS = ("Vertices", "Lines", "Polygons", "Strips")  # in the order of the specification
ATTRIBUTES = {"velocity": "Vectors"}
PATIENCE = 50.0  # a new series comes when so many times what the last one took has passed


class VtkhdfRecorder(FolderRecorder):
    """Records frames for ParaView (needs the extra ``vtkhdf``).

    ``out.frames/f.######.vtkhdf`` are the frames, each a file of its own that can be opened alone.
    ``out.vtkhdf`` shows them as one series in time; it reads them from there, so move both
    together. It is written at the first frame, then so rarely that it costs less than a fiftieth
    of the time, and at the end. A kill can leave it behind the frames: they are whole and can be
    opened (ParaView takes the numbered files as a series), and resuming brings it up to date.

    Points are positions; point data are ``velocity radius id group world`` and the fields. A
    frame's field data hold its ``time``; the file's attribute ``groups`` has their names.

    Arguments are those of :class:`~particlesim.output.recorders.base.ParticleRecorder`.
    """

    suffix, needs = ".vtkhdf", ("h5py", "vtkhdf")

    def __init__(self, *arguments: Any, **options: Any):
        self._library = self.library()
        self._counts: list[int] = []
        self._times: list[float] = []
        self._kinds: dict[str, tuple[np.dtype, tuple[int, ...]]] = {}  # type, and shape of a row
        self._shown = 0  # frames in the series as it is on disk
        self._next_series = 0.0
        super().__init__(*arguments, **options)

    def _put(self, frame: ParticleFrame) -> None:
        super()._put(frame)
        self._counts.append(len(frame.columns["position"]))
        self._times.append(frame.time)
        self._kinds = {name: _kind(array) for name, array in frame.columns.items()}
        if time.perf_counter() >= self._next_series:
            self._publish_series()

    @property
    def rest(self) -> int:
        shown = self.path.stat().st_size
        return shown * len(self._counts) // max(1, self._shown)

    def _finish(self) -> None:
        if self._shown != len(self._counts):
            self._publish_series()

    def _go_on(self, last: int) -> None:
        super()._go_on(last)
        if self.path.is_file():
            with self._library.File(self.path, "r") as file:
                self._shown = int(file["VTKHDF/Steps"].attrs["NSteps"])
        for number in range(self.first, last + 1):
            with self._library.File(self.frame_path(number), "r") as file:
                root = file["VTKHDF"]
                self._counts.append(int(root["NumberOfPoints"][0]))
                self._times.append(float(root["FieldData/time"][0]))
                self._kinds = {name: _kind(each) for name, each in root["PointData"].items()}
                self._kinds["position"] = _kind(root["Points"])

    # A frame ------------------------------------------------------------------------------------

    def _save(self, path: Path, frame: ParticleFrame) -> None:
        n = len(frame.columns["position"])
        with self._library.File(path, "w") as file:
            root = self._root(file)
            root["NumberOfPoints"] = np.array([n])
            root["Points"] = frame.columns["position"]
            for kind in CELLS:
                count = n if kind == "Vertices" else 0
                cells = root.create_group(kind)
                cells["NumberOfCells"] = cells["NumberOfConnectivityIds"] = np.array([count])
                cells["Offsets"] = np.arange(count + 1, dtype=np.int32)
                cells["Connectivity"] = np.arange(count, dtype=np.int32)
            data = root.create_group("PointData")
            for name, array in frame.columns.items():
                if name != "position":
                    data[name] = array
                    self._mark(data[name], name)
            root["FieldData/time"] = np.array([frame.time])

    def _root(self, file: Any) -> Any:
        # Outside of what VTK reads: its field data cannot take texts of any length.
        file.attrs["groups"] = np.array(self.group_names, dtype=self._library.string_dtype())
        root = file.create_group("VTKHDF")
        root.attrs["Version"] = np.array(VERSION)
        # Readers want a text of fixed length.
        kind = self._library.string_dtype("ascii", len("PolyData"))
        root.attrs.create("Type", np.bytes_("PolyData"), dtype=kind)
        return root

    def _mark(self, dataset: Any, name: str) -> None:
        if name in ATTRIBUTES:
            dataset.attrs["Attribute"] = np.bytes_(ATTRIBUTES[name])

    # The series ---------------------------------------------------------------------------------

    def _publish_series(self) -> None:
        started = time.perf_counter()
        with (
            files.whole(self.owner, self.path, KEPT) as temporary,
            self._library.File(temporary, "w") as file,
        ):
            self._series(self._root(file))
        self._shown = len(self._counts)
        finished = time.perf_counter()
        self._next_series = finished + PATIENCE * (finished - started)

    def _series(self, root: Any) -> None:
        counts = np.array(self._counts, dtype=np.int64)
        none = np.zeros_like(counts)
        start = np.concatenate([[0], np.cumsum(counts)[:-1]])
        root["NumberOfPoints"] = counts
        self._joined(root, "Points", counts, *self._kinds["position"])
        for kind in CELLS:
            of_kind = counts if kind == "Vertices" else none
            cells = root.create_group(kind)
            cells["NumberOfCells"] = cells["NumberOfConnectivityIds"] = of_kind
            self._joined(root, f"{kind}/Offsets", of_kind + 1, np.dtype(np.int32))
            self._joined(root, f"{kind}/Connectivity", of_kind, np.dtype(np.int32))
        for name, kind_of in self._kinds.items():
            if name != "position":
                self._joined(root, f"PointData/{name}", counts, *kind_of)
                self._mark(root[f"PointData/{name}"], name)
        self._steps(root.create_group("Steps"), start)

    def _steps(self, steps: Any, start: np.ndarray) -> None:
        """Where each frame begins in every array."""
        frames = len(self._counts)
        steps.attrs["NSteps"] = frames
        steps["Values"] = np.array(self._times)
        steps["PartOffsets"] = np.arange(frames)
        steps["NumberOfParts"] = np.ones(frames, dtype=np.int64)
        steps["PointOffsets"] = start
        cells = np.zeros((frames, len(CELLS)), dtype=np.int64)
        cells[:, 0] = start
        steps["CellOffsets"] = steps["ConnectivityIdOffsets"] = cells
        for name in self._kinds:
            if name != "position":
                steps[f"PointDataOffsets/{name}"] = start

    def _joined(
        self,
        root: Any,
        name: str,
        counts: np.ndarray,
        dtype: np.dtype,
        row: tuple[int, ...] = (),
    ) -> None:
        """An array of all frames, as a view into their files."""
        layout = self._library.VirtualLayout((int(counts.sum()), *row), dtype)
        at = 0
        for k, count in enumerate(counts.tolist()):
            if count:
                source = f"{self.folder.name}/{self.frame_path(self.first + k).name}"
                layout[at : at + count] = self._library.VirtualSource(
                    source, f"VTKHDF/{name}", (count, *row), dtype
                )
            at += count
        root.create_virtual_dataset(name, layout)


def _kind(array: Any) -> tuple[np.dtype, tuple[int, ...]]:
    """Type, and shape of a row."""
    return array.dtype, tuple(array.shape[1:])
