"""Checks of value clips: that all files are there, can be read, and hold what they should, when."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from pxr import Sdf, Usd

from ..layout import Clip, ClipSet, opened
from ..recording import CLIPS, Recording
from .fault import Fault, type_fault

AGAIN = "record it again, or go on from the last checkpoint before"


def clip_set_faults(recording: Recording, clip_set: ClipSet) -> Iterator[Fault]:
    """Files that are missing or cannot be read, and a manifest that does not fit the stage."""
    prim, folder = str(clip_set.prim), recording.path.absolute().parent
    if not clip_set.clips:
        remedy = "give clips by a template, or by assetPaths and active"
        yield Fault("clips", prim, "clips", None, "name its files", "none", remedy)
    yield from _gap_faults(clip_set, folder)
    if clip_set.manifest is None or not clip_set.manifest.is_file():
        value = "none" if clip_set.manifest is None else f"no file {clip_set.manifest.name}"
        remedy = "record it again: without it nothing is read from the clips"
        yield Fault("manifest", prim, "clips", None, "have a manifest", value, remedy)
        return
    manifest = opened(clip_set.manifest)
    if manifest is None:
        where = _relative(clip_set.manifest, folder)
        yield Fault("manifest", prim, "clips", None, f"read {where}", "an error", AGAIN)
        return
    for path in sorted(clip_set.declared(manifest)):
        yield from _manifest_faults(recording.stage, manifest, path, clip_set)


def _gap_faults(clip_set: ClipSet, folder: Path) -> Iterator[Fault]:
    missing = [clip for clip in clip_set.clips if not clip.exists]
    present = [clip.frame for clip in clip_set.clips if clip.exists]
    last = max(present, default=float("-inf"))
    for clip in missing:
        name = _relative(clip.path, folder)
        if clip.frame > last:
            # Killed, or still being written: what is there is good, but the end is not the end.
            kind, remedy = "unfinished", f"resume the run, or end the recording at frame {last:g}"
        else:
            kind, remedy = "gap", AGAIN
        yield Fault(kind, str(clip_set.prim), "clips", clip.frame, f"have {name}", "none", remedy)


def _manifest_faults(
    stage: Usd.Stage, manifest: Sdf.Layer, path: Sdf.Path, clip_set: ClipSet
) -> Iterator[Fault]:
    at = clip_set.outside(path)
    attribute = stage.GetAttributeAtPath(at)
    prim, name = str(at.GetPrimPath()), at.name
    if not attribute:
        remedy = "declare it there: clips alone cannot make it"
        yield Fault("undeclared", prim, name, None, "be in the root too", "none", remedy)
    elif attribute.GetResolveInfo().GetSource() not in (CLIPS, Usd.ResolveInfoSourceNone):
        remedy = "remove the value that the root gives it"
        yield Fault("hidden", prim, name, None, "come from the clips", "a value above", remedy)
    else:
        held, wanted = manifest.GetAttributeAtPath(path).typeName, attribute.GetTypeName()
        if held.type != wanted.type:
            yield type_fault(prim, name, None, str(held), str(wanted))


def clip_faults(recording: Recording, clip_set: ClipSet, clip: Clip) -> Iterator[Fault]:
    """One file: readable, of the root's rate, with every declared attribute at its own time."""
    folder, prim = recording.path.absolute().parent, str(clip_set.prim)
    layer = opened(clip.path)
    if layer is None:
        name = _relative(clip.path, folder)
        condition = f"read {name} to its end"
        size = f"an error after {clip.path.stat().st_size} bytes"
        yield Fault("unreadable", prim, "clips", clip.frame, condition, size, AGAIN)
        return
    rate = recording.stage.GetTimeCodesPerSecond()
    if layer.HasTimeCodesPerSecond() and layer.timeCodesPerSecond != rate:
        condition = f"have the {layer.timeCodesPerSecond:g} of its clips"
        remedy = "set timeCodesPerSecond and framesPerSecond to it"
        yield Fault("fps", "/", "timeCodesPerSecond", None, condition, f"{rate:g}", remedy)
    manifest = opened(clip_set.manifest) if clip_set.manifest else None
    if manifest is None:
        return
    expected = clip_set.declared(manifest)
    for path in sorted(clip_set.declared(layer) - expected):
        at = clip_set.outside(path)
        condition, remedy = "be in the manifest", "declare it there: readers skip it"
        yield Fault(
            "undeclared", str(at.GetPrimPath()), at.name, clip.frame, condition, "no", remedy
        )
    for path in sorted(expected):
        yield from _sample_faults(layer, manifest, path, clip_set, clip)


def _sample_faults(
    layer: Sdf.Layer, manifest: Sdf.Layer, path: Sdf.Path, clip_set: ClipSet, clip: Clip
) -> Iterator[Fault]:
    """An attribute has a sample at the clip's time, of its type, and none outside."""
    at = clip_set.outside(path)
    prim, name = str(at.GetPrimPath()), at.name
    times = layer.ListTimeSamplesForPath(path)
    length = clip.until - clip.frame
    astray = [time for time in times if not clip.time <= time < clip.time + length]
    if clip.time not in times or astray:
        kind = "times" if times else "missing extent" if name == "extent" else "missing"
        value = f"samples at {', '.join(f'{time:g}' for time in times[:4])}" if times else "none"
        condition, remedy = f"have a sample at {clip.time:g} only", "write it with the points"
        yield Fault(kind, prim, name, clip.frame, condition, value, remedy)
    held = layer.GetAttributeAtPath(path)
    wanted = manifest.GetAttributeAtPath(path).typeName
    if held and held.typeName.type != wanted.type:
        yield type_fault(prim, name, clip.frame, str(held.typeName), str(wanted))


def _relative(path: Path, folder: Path) -> str:
    return str(path.relative_to(folder)) if path.is_relative_to(folder) else str(path)
