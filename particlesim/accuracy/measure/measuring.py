"""Measure: from a scene and what is observed of it to a number with its error."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Mapping
from typing import Any

from ... import validate
from ...scene.settings import Settings
from ..observables import sizes
from ..statistics import Mean
from ..study import SEED, Study, options_of
from .aim import Aim
from .bench import Bench
from .over import OWNER, reduction
from .report import Measured, Part
from .rounding import round_off
from .spatial import in_space
from .temporal import in_time

ASIDE = 0.15  # of the error, for time where space is refined too: whole substeps ripple by it
CERTAIN = 1.0 - 1e-9  # as confidence: more is none
RESOLUTIONS = ("spacing", "particles")  # options of build that say how fine it is


def measure(
    build: Callable[..., Any],
    observe: Callable[[Any], Any] | str,
    error: float = 1e-3,
    confidence: float = 0.95,
    *,
    over: str | Callable[..., float] = "final",
    space: str | None = "auto",
    settings: Settings | None = None,
    frames: int | None = None,
    options: Mapping[str, Any] | None = None,
    device: Any = None,
    budget: float | None = None,
    progress: bool | Callable[[str], None] = False,
) -> Measured:
    """A number that a scene tends to without a step, with its interval, by no more than is needed.

    Substeps are doubled, from the limit of stability on, until Richardson's extrapolation settles
    at the order that is found; likewise what says how fine a scene is. With an option ``seed`` of
    ``build`` it is the mean over seeds, as many as it takes; where each goes its own way at every
    step, as in chaos, averages are. Runs are in float64, and some in float32 say what rounding is.
    The parts of the interval are added.

    Args:
        build: ``build(**options) -> Scene``. Of a scene module, that module's ``settings`` and
            ``frames`` hold where None is given.
        observe: A function of the simulation: a number, or one a world, (worlds,), with which seeds
            run as one batch. Or ``"energy"``, ``"kinetic"``, ``"potential"``, ``"virial"``,
            ``"temperature"``, ``"pressure"``, ``"momentum"``, ``"angular_momentum"``, ``"stress"``.
        error: Half the width of the interval, at most [unit of what is observed].
        confidence: With which the interval is to hold the true value.
        over: ``"final"``, at the end; ``"max"`` or ``"rms"``, of start and frames; ``"period"``, of
            upward crossings of the middle; ``"mean"``, over time in the steady state, in more
            frames where it takes them; or a function of times (m,) and values (m,).
        space: Option of ``build`` to refine: a float is a spacing, a whole number counts along a
            line. ``"auto"``: ``spacing`` or ``particles``, if it has one. None: none.
        settings, frames, options, device: As of ``tradeoff``; a resolution is the coarsest.
        budget: Wall seconds, at most.
        progress: True to print every run to stderr, or a function of such a line.

    Raises:
        ValueError: A part does not converge, the message says which; or arguments do not fit.

    Example:
        >>> ball = Scene()
        >>> _ = ball.add_particles([(0, 0, 0)], velocity=(1, 0, 0))
        >>> _ = ball.add_interaction(Drag(linear=1.0))
        >>> found = measure(lambda: ball, "momentum", frames=60, device="cpu")
        >>> found.low < 0.367879 < found.high  # 1 / e
        True
    """
    error = validate.number(OWNER, "error", error, above=0.0)
    confidence = validate.number(OWNER, "confidence", confidence, above=0.0, maximum=CERTAIN)
    validate.number(OWNER, "budget", math.inf if budget is None else budget, above=0.0,
                    infinite=True, unit="s")  # fmt: skip
    study = Study(OWNER, build, settings, options, frames, device)
    resolution = _resolution(study, space)
    tell = progress if callable(progress) else _print if progress else _nothing
    bench = Bench(study, sizes(OWNER, observe), reduction(over), _seed(study), budget, tell)
    return _measured(Aim(bench, error, confidence), resolution, f"{_name(observe)}, {_name(over)}")


def _seed(study: Study) -> int | None:
    """The first seed, where ``build`` has them and none is given."""
    seed = options_of(study.build).get(SEED)
    given = SEED in study.options or isinstance(seed, bool)
    return seed if isinstance(seed, int) and not given else None


def _measured(aim: Aim, resolution: tuple[str, Any] | None, words: str) -> Measured:
    """Refine in time, in space, and ask for round-off; the parts together."""
    bench = aim.bench
    timed = in_time(aim, None if resolution is None else ASIDE * aim.error)
    spaced = None if resolution is None else in_space(aim, timed, *resolution)
    last = timed if spaced is None else spaced
    rounded = round_off(aim, timed.coarsest, last.substeps)
    errors = {
        "time": timed.unsure, "space": 0.0 if spaced is None else spaced.unsure,
        "chance": last.mean.reach(aim.confidence), "round-off": rounded.error,
    }  # fmt: skip
    how = {
        "time": timed.how,
        "space": "no option of build is refined" if spaced is None else spaced.how,
        "chance": _chance(bench, last.mean), "round-off": rounded.how,
    }  # fmt: skip
    half, value, study = sum(errors.values()), last.mean.value, bench.study
    options = dict(study.options)
    if spaced is not None and resolution is not None:
        options[resolution[0]] = spaced.option
    if bench.first_seed is not None:
        options[SEED] = bench.first_seed
    return Measured(
        scene=study.label, observe=words, value=value, low=value - half, high=value + half,
        confidence=aim.confidence, order=timed.order,
        parts={
            name: Part(errors[name], spent.seconds, spent.substeps, how[name])
            for name, spent in bench.spent.items()
        },
        settings=study.settings.replace(substeps=last.substeps, precision=rounded.precision),
        options=options, frames=timed.frames, worlds=last.worlds, device=bench.device,
    )  # fmt: skip


def _chance(bench: Bench, mean: Mean) -> str:
    """Where chance comes from, in words."""
    if bench.chance:
        return f"{mean.effective:.0f} seeds" if mean.effective else "seeds"
    if bench.steady:
        return "of time: the start is left out" if bench.start else "of time"
    return "none: build has no option seed"


def _print(line: str) -> None:
    print(line, file=sys.stderr, flush=True)


def _nothing(line: str) -> None:
    pass


def _name(thing: Any) -> str:
    return thing if isinstance(thing, str) else getattr(thing, "__name__", "a function")


def _resolution(study: Study, space: str | None) -> tuple[str, Any] | None:
    """The option that says how fine the scene is, and its value."""
    options = {**options_of(study.build), **study.options}
    if space == "auto":
        known = (name for name in RESOLUTIONS if isinstance(options.get(name), int | float))
        space = next(known, None)
    if space is None:
        return None
    validate.choice(OWNER, "space", space, options)
    value = options[space]
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0 < value < math.inf:
        raise validate.fail(
            OWNER, "space", f"name a number above 0, {space} of build", value, "set it in options"
        )
    return space, value
