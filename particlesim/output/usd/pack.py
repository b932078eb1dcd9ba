"""The clips of a recording in one file, for sending it somewhere."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

from pxr import Sdf, Usd, UsdUtils

from ... import validate
from .. import files
from .checking.clip_files import clip_set_faults
from .recording import CLIPS, Recording, notes, plain_errors, prims, quiet

OWNER = "usd.pack"
SUFFIXES = (".usdc", ".usd")
SAVE_EVERY = 64 * 2**20  # bytes held in memory before they are put into the file


def pack(
    path: str | os.PathLike[str], out: str | os.PathLike[str], *, overwrite: bool = False
) -> int:
    """Write a recording as one file with the same values at every frame.

    The file appears whole or not at all. Memory does not grow with the number of frames. A
    recording that was cut short is packed up to its last frame.

    Args:
        path: The root file of the recording.
        out: The file to write, ``.usdc`` or ``.usd``, both binary.
        overwrite: Replace an existing file.

    Returns:
        The number of frames.

    Raises:
        FileExistsError: ``out`` exists, and ``overwrite`` is not set. FileNotFoundError: There is
            no recording, or no folder to write into. ValueError: It cannot be read, frames of it
            are missing or cut off, another suffix. OSError: The file could not be written.

    Example:
        >>> from particlesim import Scene, Simulation
        >>> scene = Scene()
        >>> ball = scene.add_particles([(0, 1, 0)], velocity=(1, 0, 0), radius=0.1)
        >>> Simulation(scene, device="cpu").run(2, record="ball.usda")
        >>> pack("ball.usda", "ball_packed.usdc")
        3
    """
    source, target = Path(path), Path(out)
    if target.exists() and source.exists() and target.samefile(source):
        raise validate.fail(
            OWNER, "out", "be another file than the recording", str(target), "choose another name"
        )
    files.check_new(OWNER, target, overwrite, suffixes=SUFFIXES, argument="out")
    with quiet():
        recording = Recording(OWNER, source)
        _refuse_incomplete(recording)
        with files.whole(OWNER, target, "The recording is as it was.") as part, plain_errors():
            return _write(recording, part, target)


def _refuse_incomplete(recording: Recording) -> None:
    """Nothing is packed that would show something else than what was recorded."""
    for clip_set in recording.clip_sets:
        for fault in clip_set_faults(recording, clip_set):
            if fault.kind in ("gap", "manifest", "clips"):
                raise ValueError(f"{OWNER}: {fault}")


def _write(recording: Recording, part: Path, target: Path) -> int:
    """Fill the file; returns the number of frames."""
    layer = Sdf.Layer.CreateNew(str(part))
    layer.TransferContent(recording.root)
    for clip_set in recording.clip_sets:
        layer.GetPrimAtPath(clip_set.prim).ClearInfo("clips")
    _move_assets(layer, recording.path, target)
    frames = recording.frames()
    rate = recording.stage.GetTimeCodesPerSecond()
    # For the check: alone, one file cannot contradict its rate as clips can.
    own = {**notes(recording.stage), "fps": rate}
    layer.customLayerData = {**layer.customLayerData, "particlesim": own}
    if frames:
        layer.endTimeCode = frames[-1]
    recording.visit(frames, lambda stage, some: _copy_frames(recording, layer, stage, some))
    layer.Save()
    return len(frames)


def _move_assets(layer: Sdf.Layer, source: Path, target: Path) -> None:
    """Paths that are relative to the recording's folder, made relative to the new file's."""
    old, new = source.absolute().parent, target.absolute().parent

    def moved(path: str) -> str:
        relative = path.startswith(("./", "../"))
        return os.path.relpath(old / path, new) if relative else path

    if old != new:
        UsdUtils.ModifyAssetPaths(layer, moved)


def _clip_attributes(stage: Usd.Stage) -> Iterator[Usd.Attribute]:
    for prim in prims(stage):
        for attribute in prim.GetAuthoredAttributes():
            if attribute.GetResolveInfo().GetSource() == CLIPS:
                yield attribute


def _copy_frames(
    recording: Recording, layer: Sdf.Layer, stage: Usd.Stage, frames: list[float]
) -> list[None]:
    """Copy the values of some frames, and put them into the file when there are many."""
    attributes, held = list(_clip_attributes(stage)), 0
    for frame in frames:
        damaged = recording.damaged(frame)
        if damaged is not None:
            raise validate.fail(
                OWNER, f"frame {frame:g}", "be readable", damaged.name,
                "run usd check, and record it again",
            )  # fmt: skip
        with Sdf.ChangeBlock():
            for attribute in attributes:
                value = attribute.Get(frame)
                if value is not None:
                    layer.SetTimeSample(attribute.GetPath(), frame, value)
                    held += 16 * len(value) if hasattr(value, "__len__") else 16
        if held > SAVE_EVERY:
            layer.Save()
            held = 0
    # What is set refers to the clip files until it is saved.
    layer.Save()
    return []
