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
import json
import os
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from .. import validate
from ..engine.frames import Frames
from ..engine.limit import Pacing
from ..engine.model import batch
from ..instruments.watchdog.incident import Incident
from ..instruments.watchdog.watch import Watchdog
from ..scene import __version__
from ..scene.fingerprint import difference, fingerprint
from ..scene.scene import Scene
from ..scene.settings import INTEGRATORS, Settings
from . import files
from .archive import Stored, is_whole, opened

LOAD = "Simulation.load"
FORMAT, VERSION = "particlesim checkpoint", 1
MOST = 2**53  # frames: beyond, their times are not exact
HEADER = "header"
# What the arrays mean depends on these: which there are, their type, and the time of a frame.
FIXED = ("dt", "integrator", "precision", "compensated", "ledger")


@dataclasses.dataclass(frozen=True, eq=False)
class Capture:
    """A checkpoint on the host; it shares nothing with the simulation."""

    header: dict[str, Any]
    arrays: dict[str, np.ndarray]


@dataclasses.dataclass(frozen=True)
class Saved:
    """A checkpoint in a file: its header, and what its arrays are."""

    source: Path
    header: dict[str, Any]
    arrays: dict[str, Stored]


def save(frames: Frames, watchdog: Watchdog, path: str | os.PathLike[str], overwrite: bool) -> None:
    """Write the present (see :meth:`Simulation.save`)."""
    target = files.check_new("Simulation.save", path, overwrite, suffixes=(".npz",))
    write(capture(frames, watchdog), target)


def capture(
    frames: Frames, watchdog: Watchdog, scenes: dict[str, Any] | None = None, state: bool = True
) -> Capture:
    """Copy what a checkpoint holds.

    Args:
        frames: With the loop and what outlives its substeps.
        watchdog: With what it has found and done.
        scenes: Their fingerprint, if it is known: it does not change.
        state: False leaves the arrays out, for a run that is at its start.
    """
    loop = frames.loop
    held = frames.snapshot.contents() if state else {}
    arrays = {name: array.numpy().copy() for name, array in held.items()}
    header = {
        "format": FORMAT,
        "format_version": VERSION,
        "particlesim": __version__,
        "frame": loop.frame,
        "unknown_forces": sorted(loop.unknown_forces),
        "frozen": sorted(watchdog.frozen),
        "incidents": [dataclasses.asdict(incident) for incident in watchdog.incidents],
        "settings": loop.settings.plain,
        "pacing": dataclasses.asdict(loop.pacing),
        "copies": all(scene is loop.scenes[0] for scene in loop.scenes),
        "scenes": fingerprint(loop.scenes, loop.laws) if scenes is None else scenes,
        "arrays": list(arrays),
    }
    return Capture(header, arrays)


def restore(frames: Frames, watchdog: Watchdog, saved: Saved) -> None:
    """Put a loop, of the same scenes and settings, to where a checkpoint was captured.

    Raises:
        ValueError: The arrays are damaged, or not those of the loop; it is as it was.
    """
    loop = frames.loop
    _fill(frames, saved)
    loop.frame = saved.header["frame"]
    if loop.settings.adaptive:
        loop.divide(saved.header["settings"]["substeps"])
    if "pacing" in saved.header:
        loop.pacing = Pacing.of_saved(saved.header["pacing"])
    loop.unknown_forces = set(saved.header["unknown_forces"])
    watchdog.incidents = [Incident.of_saved(each) for each in saved.header.get("incidents", ())]
    watchdog.resume(frames, saved.header.get("frozen", ()))


def check(
    saved: Saved,
    scene: Scene | Sequence[Scene],
    settings: Settings | None,
    worlds: int | None,
) -> tuple[list[Scene], Settings]:
    """The scenes and settings to go on with from a file (see :meth:`Simulation.load`)."""
    source, header = saved.source, saved.header
    if not saved.arrays:
        raise validate.fail(
            LOAD, "path", "be a checkpoint with a state", str(source),
            "this one says only how a run was started; start it anew",
        )  # fmt: skip
    if isinstance(scene, Scene) and worlds is None and header["copies"]:
        worlds = len(header["scenes"]["worlds"])
    scenes = batch(scene, worlds)
    found = difference(header["scenes"], fingerprint(scenes))
    if found:
        where, before, given = found
        raise validate.fail(
            LOAD, where, f"be as in {source.name!r}, {_short(before)}", given,
            "give the scenes that were saved",
        )  # fmt: skip
    rows = saved.arrays["state/position"].shape[:1]
    if rows != (sum(each.particle_count for each in scenes),):  # before so many worlds are made
        raise _unfit(source, f"has positions {rows} in {len(scenes)} worlds")
    return scenes, _settings(source, header["settings"], settings)


def _settings(source: Path, saved: dict[str, Any], given: Settings | None) -> Settings:
    """The settings to go on with: those of the file, or ``given`` if the arrays fit them."""
    known = {field.name for field in dataclasses.fields(Settings)}
    if not known >= saved.keys():
        raise _unfit(source, f"has the unknown knobs {sorted(saved.keys() - known)}")
    if given is not None and not isinstance(given, Settings):
        raise TypeError(
            f"Simulation.load: settings must be a Settings, got {given!r}; use Settings(...)."
        )
    method = None if given is None else given.integrator
    if isinstance(method, type) and method.__name__ == saved["integrator"]:
        saved = {**saved, "integrator": method}
    elif saved["integrator"] not in INTEGRATORS:
        raise validate.fail(
            LOAD, "settings.integrator",
            f"be the {saved['integrator']} of {source.name!r}", method,
            "give settings with that class",
        )  # fmt: skip
    settings = Settings(**saved)
    if given is None:
        return settings
    if given.automatic:
        given = given.replace(dt=settings.dt, substeps=settings.substeps)
    for name in FIXED:
        before, now = getattr(settings, name), getattr(given, name)
        if now != before:
            raise validate.fail(
                LOAD, f"settings.{name}", f"be {before!r} as in {source.name!r}", now,
                f"change other knobs than {', '.join(FIXED)}",
            )  # fmt: skip
    return given


def _fill(frames: Frames, saved: Saved) -> None:
    """Put the arrays of a file into a loop that is at its start."""
    source, arrays = saved.source, saved.arrays
    # Some arrays are made only when something asks for them, as the diagnostics do.
    prefix = "state/"
    frames.loop.state.require(
        name.removeprefix(prefix) for name in arrays if name.startswith(prefix)
    )
    targets = frames.snapshot.contents()
    if targets.keys() != arrays.keys():
        raise _unfit(source, f"differs in {sorted(targets.keys() ^ arrays.keys())}")
    for name, target in targets.items():
        here, there = target.numpy(), arrays[name]
        if (here.shape, here.dtype) != (there.shape, there.dtype):
            raise _unfit(
                source, f"has {there.dtype} {there.shape} for {here.dtype} {here.shape} in {name}"
            )
    with _whole(source):
        read = {name: there.read() for name, there in arrays.items()}  # all, before one is changed
    for name, target in targets.items():
        target.assign(read[name])
    for each in frames.loop.neighbors.verlet:
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


def write(capture: Capture, path: Path) -> None:
    """Write a captured checkpoint in the place of the one before; touches no simulation."""
    text = json.dumps(capture.header, default=lambda number: number.item()).encode()
    arrays = {HEADER: np.frombuffer(text, np.uint8), **capture.arrays}
    with files.whole("Simulation.save", path, "What was saved before is kept.") as temporary:
        files.write_arrays(temporary, arrays, sync=True)
    files.sync([path])


def read(source: Path) -> Saved:
    """What a file holds, its header checked; of its arrays only what they are.

    Raises:
        ValueError: It is damaged, newer or no checkpoint. OSError: It cannot be read.
    """
    try:
        open(source, "rb").close()
    except OSError as error:
        raise type(error)(
            f"{LOAD}: path must be a file that can be read, got {str(source)!r} "
            f"({error.strerror}); check the path."
        ) from error
    with _whole(source), opened(source) as file:
        header = json.loads(Stored.find(file, HEADER).read().tobytes())
        if header["format"] != FORMAT:
            raise ValueError(f"format {header['format']!r}")
        if header["format_version"] <= VERSION:
            _check_header(header)
            return Saved(
                source, header, {name: Stored.find(file, name) for name in header["arrays"]}
            )
    raise ValueError(
        f"{LOAD}: path must be a checkpoint of format {VERSION} or older, got format "
        f"{header['format_version']} in {str(source)!r}; use particlesim "
        f"{header.get('particlesim')} or newer."
    )


@contextlib.contextmanager
def _whole(source: Path) -> Iterator[None]:
    """Say of whatever goes wrong that the file is not whole."""
    try:
        yield
    except Exception as error:  # bytes may be anything, and their readers raise as much
        raise ValueError(
            f"{LOAD}: path must be a whole checkpoint written by Simulation.save, got "
            f"{str(source)!r} ({type(error).__name__}: {error}); take another file."
        ) from error


def _check_header(header: dict[str, Any]) -> None:
    """Refuse numbers that no simulation has.

    Raises:
        Exception: Something is missing, or of another kind.
    """
    kinds, worlds = header["scenes"]["kinds"], header["scenes"]["worlds"]
    frame, run = header["frame"], header.get("run", {"recorded": None, "arguments": {}})
    incidents = [Incident.of_saved(each) for each in header.get("incidents", ())]
    names, recorded = header["arrays"], run["recorded"]
    sound = {
        "frame": is_whole(frame, MOST),
        "scenes": bool(worlds) and all(is_whole(kind, len(kinds)) for kind in worlds),
        "frozen": all(is_whole(world, len(worlds)) for world in header.get("frozen", ())),
        "unknown_forces": all(is_whole(world, len(worlds)) for world in header["unknown_forces"]),
        "incidents": all(is_whole(each.world, len(worlds)) for each in incidents),
        "settings": isinstance(header["settings"], dict),
        "copies": isinstance(header["copies"], bool),
        "arrays": len(set(names)) == len(names) and all(isinstance(each, str) for each in names),
        "run": isinstance(run["arguments"], dict)
        and (recorded is None or is_whole(recorded, frame + 1)),
    }
    for name, right in sound.items():
        if not right:
            raise ValueError(f"{name} {_short(header[name])}")


def _short(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 80 else text[:77] + "..."
