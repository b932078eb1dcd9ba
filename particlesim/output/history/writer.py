"""What a run did: conserved quantities and errors of every frame, in a file that survives a crash.

A history is plain text, one line a frame and world, each line written at once: ``.csv`` with a
heading, or ``.jsonl`` with one object a line. What a killed process leaves behind is whole but for
the last line, which readers skip.
"""

from __future__ import annotations

import contextlib
import csv
import io
import json
import math
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ... import validate
from ...engine.source import Source
from .. import files
from .sample import TEXT, Observed, sample

SUFFIXES = (".csv", ".jsonl")
OWN = ("frame", "time", "world")  # what every line starts with


class History(files.Closing):
    """Records what a simulation did, frame by frame.

    Columns: ``mass``, ``momentum_x``, ``angular_momentum_x`` (and y, z), ``kinetic``,
    ``potential``, ``energy``, ``temperature``, in a periodic box ``pressure`` and ``stress_xx``
    (and yy, zz, yz, xz, xy; see ``Simulation.diagnostics``), with a barostat ``volume``;
    ``potential:<interaction>`` of each that has one; ``density_error_max:<fluid>`` and
    ``density_error_rms:<fluid>`` of rho / rho0 - 1, where there is a rest density;
    ``residual_max:<constraint>`` and ``residual_rms:<constraint>`` (see
    :mod:`particlesim.instruments.residuals`); where substeps are adaptive ``substeps`` and, in
    words, ``limiter``; ``observed:<name>`` of what is observed. A run with a history goes as one
    without, bit for bit.

    Args:
        sim: The simulation.
        path: The file, ``.csv`` or ``.jsonl``.
        overwrite: Replace an existing file.
        resume: Go on with an existing file: frames after the simulation's present one are dropped.
        observe: Functions by name, of the simulation, that give one number a world, (worlds,), or
            several, (worlds, k), as ``ps.mean_square_displacement`` does. They look only.

    Raises:
        FileExistsError: The file exists, and neither ``overwrite`` nor ``resume`` is set.
        FileNotFoundError: The folder does not exist. ValueError: Another suffix, or an existing
            file that is no history of such a simulation.

    Example:
        >>> from particlesim import Scene, Settings, Simulation
        >>> scene = Scene()
        >>> ball = scene.add_particles([(0, 0, 0)], velocity=(2, 0, 0))
        >>> sim = Simulation(scene, Settings(dt=0.1), device="cpu")
        >>> with History(sim, "ball.csv") as history:
        ...     history.write()
        ...     sim.step()
        ...     history.write()
        >>> read_history("ball.csv")["kinetic"].tolist()
        [[2.0], [2.0]]
    """

    def __init__(
        self,
        sim: Source,
        path: str | os.PathLike[str],
        *,
        overwrite: bool = False,
        resume: bool = False,
        observe: Observed | None = None,
    ):
        self.sim, self.observe = sim, dict(observe or {})
        self.path = files.check_new("History", path, overwrite or resume, suffixes=SUFFIXES)
        self.overwrite = overwrite and not resume
        self._file: io.FileIO | None = None
        self._columns: list[str] | None = None
        if resume and self.path.exists():
            self._go_on()

    def write(self) -> None:
        """Append the simulation's present state.

        Raises:
            OSError: The file could not be written; what it held before is kept.
        """
        sim = self.sim
        values = sample(sim, self.observe)
        if self._file is None:
            self._begin([*OWN, *values])
        table = [
            np.asarray(column, dtype=None if name in TEXT else np.float64).tolist()
            for name, column in values.items()
        ]
        lines = [
            self._line([sim.frame, sim.time, w, *(column[w] for column in table)])
            for w in range(sim.model.world_count)
        ]
        self._append("".join(lines).encode())

    def sync(self) -> None:
        """Return only when the disk has every line, so that it outlives a loss of power."""
        files.sync([self.path])

    def close(self) -> None:
        """Close the file. May be called again."""
        if self._file is not None:
            self._file.close()
            self._file = None

    def _begin(self, columns: list[str]) -> None:
        if self._columns is None:
            files.check_new("History", self.path, self.overwrite)
            self._columns = columns
            heading = ",".join(columns) + "\n" if _is_csv(self.path) else ""
            self.path.write_text(heading, encoding="utf-8")
        elif self._columns != columns:
            raise validate.fail(
                "History", "path", f"hold {', '.join(columns[3:])}", str(self.path),
                "go on with the scene that it began with",
            )  # fmt: skip
        self._file = open(self.path, "ab", buffering=0)  # noqa: SIM115  closed by close()

    def _line(self, row: list[Any]) -> str:
        if _is_csv(self.path):
            return ",".join(each if isinstance(each, str) else repr(each) for each in row) + "\n"
        pairs = zip(self._columns or (), row, strict=True)
        plain = {k: None if isinstance(v, float) and not math.isfinite(v) else v for k, v in pairs}
        return json.dumps(plain) + "\n"

    def _append(self, content: bytes) -> None:
        """All of it or nothing."""
        assert self._file is not None
        size = os.fstat(self._file.fileno()).st_size
        try:
            while content:
                content = content[self._file.write(content) :]
        except OSError as error:
            with contextlib.suppress(OSError):
                self._file.truncate(size)
            kept = "What was recorded before is kept."
            raise files.unwritable("History", self.path, error, kept, "free some space") from error

    def _go_on(self) -> None:
        """Keep the whole frames up to the present one."""
        with open(self.path, encoding="utf-8", newline="") as file:
            lines = [line for line in file if line.endswith("\n")]
        heading = lines[:1] if _is_csv(self.path) else []
        past = read_history(self.path)
        if past.world_count not in (0, self.sim.model.world_count):
            raise validate.fail(
                "History", "path", f"hold {self.sim.model.world_count} worlds", past.world_count,
                "go on with as many worlds as it began with",
            )  # fmt: skip
        count = int((past.frame < self.sim.frame).sum()) * max(1, past.world_count)
        self._columns = [*OWN, *past.values] if lines else None
        with files.whole("History", self.path, "The history is as it was.") as part:
            part.write_text("".join(lines[: len(heading) + count]), encoding="utf-8")


@dataclass(frozen=True)
class Record:
    """A history that was read: ``frame`` (frames,), ``time`` (frames,) [time], and ``values``,
    (frames, worlds) by column.

    ``record["energy"]`` is a column; ``record["momentum"]`` are three, (frames, worlds, 3).
    """

    frame: np.ndarray
    time: np.ndarray
    values: Mapping[str, np.ndarray]

    @property
    def world_count(self) -> int:
        """How many worlds."""
        return next(iter(self.values.values())).shape[1] if self.values else 0

    def __getitem__(self, name: str) -> np.ndarray:
        if name in self.values:
            return self.values[name]
        parts = [f"{name}_{axis}" for axis in "xyz"]
        if all(part in self.values for part in parts):
            return np.stack([self.values[part] for part in parts], axis=-1)
        raise KeyError(
            f"Record: name must be one of {', '.join(self.values)}, got {name!r}; choose one."
        )


def read_history(path: str | os.PathLike[str]) -> Record:
    """Read a history: its frames that are whole.

    Args:
        path: The file, ``.csv`` or ``.jsonl``.

    Raises:
        FileNotFoundError: There is no such file. ValueError: It is no history.
    """
    source = files.check_new("read_history", path, overwrite=True, suffixes=SUFFIXES)
    with open(source, encoding="utf-8", newline="") as file:
        lines = [line for line in file if line.endswith("\n")]  # the last may be cut off
    try:
        rows = _csv_rows(lines) if _is_csv(source) else _json_rows(lines)
    except (ValueError, TypeError):
        rows = [{}]
    if any(name not in row for row in rows for name in OWN):
        raise validate.fail(
            "read_history", "path", "be a history", str(path),
            "give a file that a run wrote with --history",
        )  # fmt: skip
    return _record(rows)


def _is_csv(path: Path) -> bool:
    return path.suffix.lower() == ".csv"


Row = dict[str, Any]  # numbers, and words of the columns that have them


def _csv_rows(lines: list[str]) -> list[Row]:
    return [
        {name: text if name in TEXT else float(text) for name, text in row.items()}
        for row in csv.DictReader(lines, strict=True)
    ]


def _json_rows(lines: list[str]) -> list[Row]:
    return [{name: _plain(name, v) for name, v in json.loads(line).items()} for line in lines]


def _plain(name: str, value: Any) -> Any:
    return value if name in TEXT else math.nan if value is None else float(value)


def _record(rows: list[Row]) -> Record:
    """Lines as arrays, without a last frame that lacks worlds."""
    worlds = 1 + max((int(row["world"]) for row in rows), default=-1)
    frames = len(rows) // worlds if worlds else 0
    names = [name for name in rows[0] if name not in OWN] if rows else []
    table = {
        name: np.array([row[name] for row in rows[: frames * worlds]]).reshape(frames, worlds)
        for name in [*OWN, *names]
        if worlds
    }
    empty = np.zeros((0, 0))
    frame, time = (table.pop(name, empty) for name in ("frame", "time"))
    table.pop("world", None)
    first = slice(0, 1) if worlds else slice(0, 0)
    return Record(frame[:, first].ravel().astype(int), time[:, first].ravel(), table)
