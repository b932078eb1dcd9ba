"""What is wrong with a USD file: usd-core's validators, and the checks that they lack."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence

from pxr import Tf, Usd, UsdGeom, UsdValidation

from ..layout import ClipSet
from ..recording import CLIPS, Recording, notes, prims, quiet, read
from .clip_files import clip_faults, clip_set_faults
from .fault import Fault, collapsed
from .prim_values import gprim_faults, primvar_faults, value_faults

REMEDIES = {
    "MissingDefaultPrim": "set it to the prim that holds all others",
    "MissingUpAxis": "set it to Y or Z",
    "MissingMetersPerUnit": "set it to the length of one unit in meters",
    "InvalidNestedGprims": "move it out, next to the other under an Xform",
    "UnresolvableDependency": "put the file there, or remove what asks for it",
}


def check(path: str | os.PathLike[str]) -> list[Fault]:
    """Look for faults in a USD file, at every frame.

    The validators of usd-core (default prim, units, nesting, materials, ...); and, as they do not
    look at values: clip files that are missing, cut off or of another rate; arrays whose lengths
    disagree; indices out of range; extents that are missing or wrong; numbers that are not finite;
    half precision; velocities at other times than points; primvars that readers drop.

    Args:
        path: The file: a recording, or any other.

    Returns:
        The faults, none if all is well.

    Raises:
        FileNotFoundError: There is no such file. ValueError: It cannot be read as USD.

    Example:
        >>> from particlesim import Scene, Simulation
        >>> scene = Scene()
        >>> ball = scene.add_particles([(0, 1, 0)], velocity=(1, 0, 0), radius=0.1)
        >>> Simulation(scene, device="cpu").run(2, record="ball.usda")
        >>> check("ball.usda")
        []
    """
    with quiet():
        recording = Recording("usd.check", path)
        return collapsed(_faults(recording))


def _faults(recording: Recording) -> Iterator[Fault]:
    found = [fault for each in recording.clip_sets for fault in clip_set_faults(recording, each)]
    yield from found
    # Without its manifest nothing can be read of a clip.
    if not any(fault.kind == "manifest" for fault in found):
        yield from _own_faults(recording)
    yield from _validator_faults(recording.stage)


def _own_faults(recording: Recording) -> Iterator[Fault]:
    """What the validators do not look at: rates, times, and the values of every frame."""
    frames = recording.frames()
    yield from _stage_faults(recording.stage, frames)
    for prim in prims(recording.stage):
        yield from primvar_faults(prim)
        yield from _time_faults(prim, recording.clip_sets)
    first = (frames or [0.0])[0]
    yield from recording.visit(
        frames or [0.0],
        lambda stage, some: list(_frame_faults(recording, stage, some, some[0] == first)),
    )


def _frame_faults(
    recording: Recording, stage: Usd.Stage, frames: Sequence[float], first: bool
) -> Iterator[Fault]:
    """Clips and values of some frames; what never changes is looked at with the first ones."""
    broken = set()
    for clip_set in recording.clip_sets:
        for clip in clip_set.clips:
            if clip.frame in frames and clip.exists:
                found = list(clip_faults(recording, clip_set, clip))
                broken |= {each.frame for each in found if each.kind == "unreadable"}
                yield from found
    whole = [frame for frame in frames if frame not in broken]
    for prim in prims(stage) if whole else ():
        yield from _prim_faults(prim, whole, first, recording.clip_sets)


def _stage_faults(stage: Usd.Stage, frames: Sequence[float]) -> Iterator[Fault]:
    """The rate, and the range of time codes."""
    rate, shown = stage.GetTimeCodesPerSecond(), stage.GetFramesPerSecond()
    if rate <= 0 or rate != shown:
        text = (f"be framesPerSecond, {shown:g}", f"{rate:g}", "set both to the frames a second")
        yield Fault("fps", "/", "timeCodesPerSecond", None, *text)
    made = notes(stage).get("fps", rate)
    if made != rate:
        text = (f"be {made:g}, as recorded", f"{rate:g}", "set it back, framesPerSecond too")
        yield Fault("fps", "/", "timeCodesPerSecond", None, *text)
    if not frames:
        return
    if not stage.GetRootLayer().HasTimeCodesPerSecond():
        text = ("be set", "nothing", "set it and framesPerSecond: readers differ in what they take")
        yield Fault("fps", "/", "timeCodesPerSecond", None, *text)
    if not stage.HasAuthoredTimeCodeRange():
        text = (f"be {frames[0]:g}..{frames[-1]:g}", "nothing", "set startTimeCode and endTimeCode")
        yield Fault("range", "/", "timeCodes", None, *text)
        return
    start, end = stage.GetStartTimeCode(), stage.GetEndTimeCode()
    if start > frames[0] or end < frames[-1]:
        condition = f"hold the frames {frames[0]:g}..{frames[-1]:g}"
        remedy = "set startTimeCode and endTimeCode"
        yield Fault("range", "/", "timeCodes", None, condition, f"{start:g}..{end:g}", remedy)


def _time_faults(prim: Usd.Prim, clip_sets: Sequence[ClipSet]) -> Iterator[Fault]:
    """Velocities at other times than points; those of clips are looked at there."""
    name = "positions" if prim.IsA(UsdGeom.PointInstancer) else "points"
    times = _times(prim.GetAttribute(name), clip_sets)
    if not times:
        return
    for other in ("velocities", "accelerations"):
        attribute = prim.GetAttribute(other)
        if not attribute or not attribute.GetResolveInfo().HasAuthoredValueOpinion():
            continue
        wrong = times ^ _times(attribute, clip_sets)
        if wrong:
            frame = min(wrong)
            value = "none there" if frame in times else "one where there are no points"
            text = (f"have samples at the times of {name}", value, "write both together")
            yield Fault("times", str(prim.GetPath()), other, frame, *text)


def _times(attribute: Usd.Attribute, clip_sets: Sequence[ClipSet]) -> set[float]:
    """Time codes of the attribute's samples, without opening clips."""
    if not attribute:
        return set()
    if attribute.GetResolveInfo().GetSource() != CLIPS:
        return set(attribute.GetTimeSamples())
    # Nearest above, as values come from it.
    above = [each for each in clip_sets if attribute.GetPath().HasPrefix(each.prim)]
    nearest = max(above, key=lambda each: each.prim.pathElementCount)
    return {clip.frame for clip in nearest.clips if clip.exists}


def _prim_faults(
    prim: Usd.Prim, frames: Sequence[float], first: bool, clip_sets: Sequence[ClipSet]
) -> Iterator[Fault]:
    """Values of one prim at some frames; what never changes is looked at once."""
    attributes = {each.GetName(): each for each in prim.GetAuthoredAttributes()}
    moving = {name: each for name, each in attributes.items() if each.ValueMightBeTimeVarying()}
    if not moving and not first:
        return
    still = {n: read(each, frames[0]) for n, each in attributes.items() if n not in moving}
    for name, value in still.items() if first else ():
        yield from value_faults(attributes[name], value, None)
    shape = moving.get("points") or moving.get("positions")
    drawn = _times(shape, clip_sets) if shape else set(frames)
    held = _times(moving["extent"], clip_sets) if "extent" in moving else drawn
    for frame in frames if moving else frames[:1]:
        values = dict(still)
        for name, each in moving.items():
            values[name] = read(each, frame)
            yield from value_faults(each, values[name], frame)
        if frame in drawn:
            if frame not in held:
                values["extent"] = None  # what USD gives is another frame's
            yield from gprim_faults(prim, values, frame if moving else None)


def _validator_faults(stage: Usd.Stage) -> Iterator[Fault]:
    """What the validators of usd-core find, one by one: some raise where a clip is cut off."""
    for validator in UsdValidation.ValidationRegistry().GetOrLoadAllValidators():
        try:
            errors = UsdValidation.ValidationContext([validator]).Validate(stage)
        except Tf.ErrorException:
            continue  # a file that cannot be read: reported with the clips
        for error in errors:
            prim, attribute = _site(error)
            message = error.GetMessage().strip().rstrip(".")
            remedy = REMEDIES.get(error.GetName(), "change it as the message says")
            yield Fault(
                error.GetName(), prim, attribute, None, "pass usd-core's validators", message,
                remedy,
            )  # fmt: skip


def _site(error: UsdValidation.ValidationError) -> tuple[str, str]:
    """Prim and attribute of an error, which is on the stage or in a layer."""
    for site in error.GetSites():
        if site.IsProperty() or site.GetPropertySpec():
            path = (
                site.GetProperty().GetPath() if site.IsProperty() else site.GetPropertySpec().path
            )
            return str(path.GetPrimPath()), path.name
        if site.IsPrim():
            return str(site.GetPrim().GetPath()), ""
    return "/", ""
