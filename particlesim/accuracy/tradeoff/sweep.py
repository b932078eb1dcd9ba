"""The sweep: every setting in turn, again and again, timed and judged."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Callable, Iterable, Mapping
from typing import Any

from ... import validate
from ...output.progress import Meter
from ...scene.settings import Settings
from ..judging import choose_judge, mark, measure
from ..run import Run
from ..study import Study
from .row import Row
from .table import Tradeoff

OWNER = "tradeoff"
Progress = Callable[[int, int], None]


def tradeoff(
    build: Callable[..., Any],
    vary: Mapping[str, Iterable[Any]],
    *,
    error: Callable[[Any], float] | str | None = None,
    reference: Any = None,
    repeats: int = 3,
    frames: int | None = None,
    settings: Settings | None = None,
    options: Mapping[str, Any] | None = None,
    bound: float | None = None,
    device: Any = None,
    progress: bool | Progress = False,
) -> Tradeoff:
    """Measure what settings cost, and how accurate they are: every combination of ``vary``.

    Every setting is run from the start over the same simulated time, after a warm-up that is not
    timed, in turn with the others, so that a noisy machine does not decide. What diverges (it
    fails, or its error is not finite or beyond the bound) is marked, and kept in the table.

    Args:
        build: ``build(**options) -> Scene``. Of a scene module, that module's ``settings``,
            ``frames`` and ``error`` hold where None is given.
        vary: Lists of values by name: fields of Settings, and options of ``build``.
        error: ``error(sim) -> float`` at the end of a run, whose size counts; ``"known"``: that of
            the module; ``"converged"``: rms distance of the particles from a reference;
            ``"energy"`` or ``"momentum"``: largest drift of what is conserved. None: the known
            one over the module's own frames, otherwise converged.
        reference: For ``"converged"``: positions (n, 3), or what the reference run is to take, a
            dict of knobs and options; needed where options of ``build`` vary. Unless ``substeps``
            or ``dt`` is given, substeps are refined until the reference stops changing.
        repeats: Timed runs of each setting, at least 1.
        frames: Frames of ``settings.dt``; 240 where nothing says how many.
        settings: The knobs that do not vary.
        options: Options of ``build`` that do not vary.
        bound: Error beyond which a setting diverged. None: ten times what the motion or the size
            of the scene amounts to; infinite for known answers.
        device: As for Simulation.
        progress: True for a bar, or a function of (frames done, all frames).

    Raises:
        ValueError: Unknown names, values out of range. SimulationError: The reference diverges.

    Example:
        >>> def fall(height=1.0):
        ...     scene = Scene()
        ...     _ = scene.add_particles([(0, height, 0)])
        ...     _ = scene.add_interaction(UniformGravity((0, -10, 0)))
        ...     return scene
        >>> table = tradeoff(
        ...     fall, {"substeps": [1, 2, 4]}, frames=10, repeats=1, device="cpu",
        ...     settings=Settings(dt=0.1, precision="float64"),
        ...     error=lambda sim: sim.position[0, 1] - (1 - 5 * sim.time**2))
        >>> [round(row.error, 9) for row in table.rows], round(table.order("substeps"), 6)
        ([0.5, 0.25, 0.125], 1.0)
    """
    study = Study(OWNER, build, settings, options, frames, device)
    shown = Meter().count(study.label, at_last="reference")
    with shown if progress is True else contextlib.nullcontext(progress or None) as show:
        return sweep(study, vary, error, reference, repeats, bound, show)


def sweep(
    study: Study,
    vary: Mapping[str, Iterable[Any]],
    error: Any,
    reference: Any,
    repeats: int,
    bound: float | None,
    progress: Progress | None,
) -> Tradeoff:
    """The table of a study (see :func:`tradeoff`)."""
    plans = study.plans(vary)
    repeats = validate.whole(OWNER, "repeats", repeats, minimum=1)
    judge = choose_judge(study, plans, error, reference)
    if bound is not None:
        bound = validate.number(OWNER, "bound", bound, above=0.0, infinite=True)
    runs = [Run(study, plan) for plan in plans]
    measure(runs, judge, repeats, progress)
    bound = judge.bound if bound is None else bound
    mark(runs, bound)
    varied = {name: {repr(plan.values[name]): plan.values[name] for plan in plans} for name in vary}
    return Tradeoff(
        scene=study.label,
        error=judge.describe(),
        rows=[row(run) for run in runs],
        vary={name: list(values.values()) for name, values in varied.items()},
        duration=study.duration,
        repeats=repeats,
        device=str(runs[0].sim.device),
        bound=bound,
        process_bytes=process_bytes(),
    )


def row(run: Run) -> Row:
    """What was measured of a run."""
    return Row(
        values=run.plan.values,
        settings=run.plan.settings,
        options=run.plan.options,
        error=run.error,
        cause=run.cause,
        costs=tuple(run.costs),
        particles=run.sim.particle_count,
        array_bytes=run.memory,
    )


def process_bytes() -> int:
    """The most memory that the process has held; 0 where the system does not say."""
    try:
        import resource
    except ImportError:
        return 0
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak if sys.platform == "darwin" else 1024 * peak
