"""The sweep: every setting in turn, again and again, timed and judged.

Example:
    >>> from particlesim import Scene, Settings, UniformGravity
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

from __future__ import annotations

import contextlib
import sys
from collections.abc import Callable, Iterable, Mapping
from typing import Any

from ... import validate
from ...output.progress import Meter
from ...scene.settings import Settings
from ..judges import Judge
from ..judging import choose_judge, mark, measure
from ..run import Run
from ..study import Study
from .row import Row
from .table import Tradeoff

OWNER = "tradeoff"
Progress = Callable[[int, int], None]


def tradeoff(
    build: Callable[..., Any], vary: Mapping[str, Iterable[Any]], *,
    error: Callable[[Any], float] | str | None = None,
    observe: Callable[[Any], Any] | str | None = None, over: str | None = None,
    reference: Any = None, seeds: int | Iterable[int] = 1, repeats: int = 3,
    frames: int | None = None, settings: Settings | None = None,
    options: Mapping[str, Any] | None = None, bound: float | None = None,
    device: Any = None, progress: bool | Progress = False,
) -> Tradeoff:  # fmt: skip
    """Measure what settings cost, and how accurate they are: every combination of ``vary``.

    Every setting is run from the start over the same simulated time, after a warm-up that is not
    timed, in turn with the others and for 50 ms at least, without the times at which the system
    took the processor away. What diverges is marked, and kept in the table.

    Args:
        build: ``build(**options) -> Scene``. Of a scene module, that module's ``settings``,
            ``frames`` and ``error`` hold where None is given.
        vary: Lists of values by name: fields of Settings, and options of ``build``.
        error: ``error(sim) -> float``; ``"known"``: that of the module; ``"converged"``: rms
            distance from a reference of the particles that move; ``"energy"``, ``"momentum"``:
            drift. None: the known one over the module's own frames, otherwise converged.
        observe: What is compared with a reference in the place of positions: a function of the
            simulation that gives any values, or ``"velocity"``, ``"energy"`` and the like.
        over: ``"final"``: the error at the end; ``"max"`` and ``"rms"``: over all frames after the
            start; ``"mean"``: that of the average over them. None: at the end of known answers and
            of positions that are given, else the largest.
        reference: Positions (n, 3) at the end; or what the reference run is to take, a dict of
            knobs and options, needed where options vary other than ``spacing``, ``particles`` and
            ``resolution`` of what is observed. Unless it has ``substeps`` or ``dt``, they are
            refined until it stops changing.
        seeds: How many seeds, or which, of a build with an option ``seed``: errors are the median
            of all, as worlds of one batch.
        repeats, frames, settings, options, device: Timed runs of each setting; frames of
            ``settings.dt``, 240 where nothing says how many; what does not vary; as for Simulation.
        bound: Error beyond which a setting diverged. None: ten times what the motion or the size
            of the scene amounts to; infinite for known answers.
        progress: True for a bar, or a function of (frames done, all frames).

    Raises:
        ValueError: Unknown names, values out of range. SimulationError: The reference diverges.
    """
    study = Study(OWNER, build, settings, options, frames, device, seeds=seeds)
    if seeds != 1 and not study.seeds:
        raise validate.fail(
            OWNER, "seeds", "be of a build with an option seed, a whole number that is not given",
            seeds, "leave it out, or give build one",
        )  # fmt: skip
    shown = Meter().count(study.label, at_last="reference")
    with shown if progress is True else contextlib.nullcontext(progress or None) as show:
        return _sweep(study, vary, (error, reference, observe, over), repeats, bound, show)


def _sweep(
    study: Study,
    vary: Mapping[str, Iterable[Any]],
    judged_by: tuple[Any, Any, Any, Any],
    repeats: int,
    bound: float | None,
    progress: Progress | None,
) -> Tradeoff:
    """The table of a study (see :func:`tradeoff`)."""
    plans = study.plans(vary)
    repeats = validate.whole(OWNER, "repeats", repeats, minimum=1)
    judge = choose_judge(study, plans, *judged_by)
    if bound is not None:
        bound = validate.number(OWNER, "bound", bound, above=0.0, infinite=True)
    runs = [Run(study, plan) for plan in plans]
    measure(runs, judge, repeats, progress)
    mark(runs, judge.bound if bound is None else bound)
    varied = {name: {repr(plan.values[name]): plan.values[name] for plan in plans} for name in vary}
    return Tradeoff(
        scene=study.label,
        error=judge.describe(),
        rows=[_row(run, judge) for run in runs],
        vary={name: list(values.values()) for name, values in varied.items()},
        duration=study.duration,
        repeats=repeats,
        device=str(runs[0].sim.device),
        bound=judge.bound if bound is None else bound,
        process_bytes=process_bytes(),
        scale=judge.scale,
        floor=judge.floor,
        conserved=judge.conserved,
        seeds=len(study.seeds) or 1,
    )


def _row(run: Run, judge: Judge) -> Row:
    """What was measured of a run."""
    times = run.times
    return Row(
        values=run.plan.values,
        settings=run.plan.settings,
        options=run.plan.options,
        error=run.error,
        cause=run.cause,
        costs=tuple(wall for wall, _ in times),
        particles=run.sim.particle_count,
        array_bytes=run.memory,
        cpu_costs=tuple(cpu for _, cpu in times),
        set_up=run.set_up,
        compiling=run.compiling,
        errors=run.errors,
        relative=run.error / judge.scale,
        parts=run.parts,
    )


def process_bytes() -> int:
    """The most memory that the process has held; 0 where the system does not say."""
    try:
        import resource
    except ImportError:
        return 0
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak if sys.platform == "darwin" else 1024 * peak
