"""Checkpoints: a simulation in one file, to go on from as if it had never stopped.

The file is a NumPy archive (``.npz``, read without pickle) of a header, JSON in bytes, and of the
arrays: ``state/<name>`` is the state's, ``kept/<name>`` what else the snapshot of a frame holds
(the positions that neighbour rows were made from, broken links, slack) and ``read/<name>`` what
constraints offer for reading. Rows of neighbours are made again from their positions, so that sums
run in the same order and a restart equals the run that was not interrupted, bit for bit.
"""

from __future__ import annotations

import contextlib
import dataclasses
import io
import json
import os
import zipfile
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from . import batch, validate
from .fingerprint import difference, fingerprint
from .scene import Scene
from .settings import Settings

if TYPE_CHECKING:
    import warp as wp

    from .simulation import Simulation

Kind = TypeVar("Kind", bound="Simulation")
FORMAT, VERSION = "particlesim checkpoint", 1
HEADER = "header"
# What the arrays mean depends on these: which there are, their type, and the time of a frame.
FIXED = ("dt", "integrator", "precision", "compensated")


def save(sim: Simulation, path: str | os.PathLike[str], overwrite: bool) -> None:
    """Write the present of ``sim`` (see :meth:`Simulation.save`)."""
    from . import __version__

    target = _writable(path, overwrite)
    arrays = {name: array.numpy() for name, array in contents(sim).items()}
    header = {
        "format": FORMAT,
        "format_version": VERSION,
        "particlesim": __version__,
        "frame": sim.frame,
        "unknown_forces": sorted(sim._unknown_forces),
        "settings": dataclasses.asdict(sim.settings),
        "copies": all(scene is sim.scenes[0] for scene in sim.scenes),
        "scenes": fingerprint(sim.scenes),
        "arrays": list(arrays),
    }
    text = json.dumps(header, default=lambda number: number.item()).encode()
    _publish(target, {HEADER: np.frombuffer(text, np.uint8), **arrays})


def load(
    kind: type[Kind],
    path: str | os.PathLike[str],
    scene: Scene | Sequence[Scene],
    settings: Settings | None,
    device: Any,
    worlds: int | None,
) -> Kind:
    """The simulation that a file holds (see :meth:`Simulation.load`)."""
    source = Path(path)
    header, arrays = _read(source)
    if isinstance(scene, Scene) and worlds is None and header["copies"]:
        worlds = len(header["scenes"]["worlds"])
    scenes = batch.scenes(scene, worlds)
    found = difference(header["scenes"], fingerprint(scenes))
    if found:
        where, saved, given = found
        raise validate.fail(
            "Simulation.load", where, f"be as in {source.name!r}, {_short(saved)}", given,
            "give the scenes that were saved",
        )  # fmt: skip
    sim = kind(scenes, _settings(source, header["settings"], settings), device)
    _fill(sim, arrays, source)
    sim.frame = header["frame"]
    sim._unknown_forces = set(header["unknown_forces"])
    return sim


def contents(sim: Simulation) -> dict[str, wp.array]:
    """The arrays that a checkpoint holds, by their names in the file."""
    state = sim.state.arrays
    found = {f"state/{name}": array for name, array in state.items() if name != "world"}
    for name, array in sim.snapshot.arrays.items():
        if state.get(name) is not array:
            found[f"kept/{name}"] = array
    for k, constraint in enumerate(sim.constraints):
        for name, array in constraint.readable().items():
            found[f"read/constraint_{k}_{name}"] = array
    return found


def _settings(source: Path, saved: dict[str, Any], given: Settings | None) -> Settings:
    """The settings to go on with: those of the file, or ``given`` if the arrays fit them."""
    known = {field.name for field in dataclasses.fields(Settings)}
    if not known >= saved.keys():
        raise _unfit(source, f"has the unknown knobs {sorted(saved.keys() - known)}")
    settings = Settings(**saved)
    if given is None:
        return settings
    if not isinstance(given, Settings):
        raise TypeError(
            f"Simulation.load: settings must be a Settings, got {given!r}; use Settings(...)."
        )
    for name in FIXED:
        before, now = getattr(settings, name), getattr(given, name)
        if now != before:
            raise validate.fail(
                "Simulation.load", f"settings.{name}", f"be {before!r} as in {source.name!r}", now,
                f"change other knobs than {', '.join(FIXED)}",
            )  # fmt: skip
    return given


def _fill(sim: Simulation, arrays: dict[str, np.ndarray], source: Path) -> None:
    """Put the arrays of a file into a simulation that is at its start."""
    # Some arrays are made only when something asks for them, as the diagnostics do.
    prefix = "state/"
    sim.state.require(name.removeprefix(prefix) for name in arrays if name.startswith(prefix))
    targets = contents(sim)
    if targets.keys() != arrays.keys():
        raise _unfit(source, f"differs in {sorted(targets.keys() ^ arrays.keys())}")
    for name, target in targets.items():
        here, there = target.numpy(), arrays[name]
        if (here.shape, here.dtype) != (there.shape, there.dtype):
            raise _unfit(
                source, f"has {there.dtype} {there.shape} for {here.dtype} {here.shape} in {name}"
            )
        target.assign(there)
    for each in sim.neighbors.verlet:
        each.mark_all()
        each.rebuild()
        each.grow()


def _unfit(source: Path, how: str) -> ValueError:
    """The scene agrees, yet its arrays do not: the engine is another."""
    return ValueError(
        f"Simulation.load: path must be a checkpoint of this version of particlesim, got "
        f"{str(source)!r}, which {how}; load it with the version that saved it."
    )


# The file ------------------------------------------------------------------------------------


def _writable(path: str | os.PathLike[str], overwrite: bool) -> Path:
    """``path``, checked before any work is done for it."""
    owner, target = "Simulation.save", Path(path)
    if target.suffix != ".npz":
        raise validate.fail(
            owner, "path", "end in .npz", str(target), f"name it {target.with_suffix('.npz').name}"
        )
    if not target.parent.is_dir():
        raise FileNotFoundError(
            f"{owner}: path must be in an existing folder, got {str(target)!r}; "
            f"make {str(target.parent)!r} first."
        )
    if target.is_dir():
        raise IsADirectoryError(
            f"{owner}: path must be a file, got the folder {str(target)!r}; choose another name."
        )
    if target.exists() and not overwrite:
        raise FileExistsError(
            f"{owner}: path must be new, got {str(target)!r}, which exists; choose another, or "
            "pass overwrite=True."
        )
    return target


def _publish(target: Path, arrays: dict[str, np.ndarray]) -> None:
    """Write the file so that readers find the old one or the new one, never a part."""
    temporary = target.with_name(f"{target.stem}.tmp{target.suffix}")
    try:
        with open(temporary, "wb") as file:
            with zipfile.ZipFile(file, "w") as archive:
                for name, array in arrays.items():
                    with archive.open(f"{name}.npy", "w", force_zip64=True) as entry:
                        np.lib.format.write_array(entry, array, allow_pickle=False)
            file.flush()
            os.fsync(file.fileno())
        os.replace(temporary, target)
    except BaseException as error:
        with contextlib.suppress(OSError):
            temporary.unlink(missing_ok=True)
        if not isinstance(error, OSError):
            raise
        raise type(error)(
            f"Simulation.save: {str(target)!r} must be writable, got {error}; free some space or "
            "choose another folder. What was saved before is kept."
        ) from error


def _read(source: Path) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """Header and arrays of a file, every byte of them checked."""
    owner = "Simulation.load"
    try:
        file = open(source, "rb")  # noqa: SIM115, what fails within is told apart
    except OSError as error:
        raise type(error)(
            f"{owner}: path must be a file that can be read, got {str(source)!r} "
            f"({error.strerror}); check the path."
        ) from error
    with file:
        try:
            with zipfile.ZipFile(file) as archive:
                header = json.loads(_entry(archive, f"{HEADER}.npy").tobytes())
                if header["format"] != FORMAT:
                    raise ValueError(f"format {header['format']!r}")
                if header["format_version"] <= VERSION:
                    names = header["arrays"]
                    return header, {name: _entry(archive, f"{name}.npy") for name in names}
        except Exception as error:  # bytes may be anything, and their readers raise as much
            raise ValueError(
                f"{owner}: path must be a whole checkpoint written by Simulation.save, got "
                f"{str(source)!r} ({type(error).__name__}: {error}); take another file."
            ) from error
    raise ValueError(
        f"{owner}: path must be a checkpoint of format {VERSION} or older, got format "
        f"{header['format_version']} in {str(source)!r}; use particlesim "
        f"{header.get('particlesim')} or newer."
    )


def _entry(archive: zipfile.ZipFile, name: str) -> np.ndarray:
    """An array of the archive; reading it to its end has its checksum compared."""
    return np.lib.format.read_array(io.BytesIO(archive.read(name)), allow_pickle=False)


def _short(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 80 else text[:77] + "..."
