"""The sweep: every setting in turn, again and again, timed and judged."""

from __future__ import annotations

import contextlib
import math
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

from ... import validate
from ...scene.settings import Settings
from .bar import bar
from .converged import Converged
from .judges import EnergyDrift, Judge, Known, MomentumDrift
from .plan import OWNER, Plan, Study
from .run import Run
from .table import Row, Tradeoff

ERRORS = ("known", "converged", "energy", "momentum")
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
    timed, ``repeats`` times and in turn with the others, so that a noisy machine does not decide.
    Settings that diverge (the simulation fails, the error is not finite or beyond the bound) are
    marked, and kept in the table.

    Args:
        build: ``build(**options) -> Scene``. What is not given here is taken from its module, if
            that is a scene module: ``settings``, ``frames`` and ``error``.
        vary: Lists of values by name: fields of Settings, and options of ``build``.
        error: ``error(sim) -> float`` at the end of a run, whose size counts; ``"known"``: that of
            the module; ``"converged"``: rms distance of the particles from a reference;
            ``"energy"`` or ``"momentum"``: largest drift of what should be conserved. None: the
            known one over the module's own frames, otherwise converged.
        reference: For ``"converged"``: positions (n, 3), or what the reference run is to take, a
            dict of knobs and options; needed where options of ``build`` vary. Unless ``substeps``
            or ``dt`` is given, substeps are refined until the reference stops changing.
        repeats: Timed runs of each setting, at least 1.
        frames: Frames of ``settings.dt``. None: those of the module, or 240.
        settings: The knobs that do not vary. None: those of the module, or Settings().
        options: Options of ``build`` that do not vary.
        bound: Error beyond which a setting counts as diverged. None: ten times what the motion
            or the size of the scene amounts to; infinite for known answers.
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
        ...     fall, {"substeps": [1, 2, 4]}, frames=10, device="cpu", repeats=1,
        ...     settings=Settings(dt=0.1, precision="float64"),
        ...     error=lambda sim: sim.position[0, 1] - (1 - 5 * sim.time**2))
        >>> [round(row.error, 9) for row in table.rows], round(table.order("substeps"), 6)
        ([0.5, 0.25, 0.125], 1.0)
    """
    study = Study(build, settings, options, frames, device)
    plans = study.plans(vary)
    repeats = validate.whole(OWNER, "repeats", repeats, minimum=1)
    judge = choose_judge(study, plans, error, reference)
    if bound is not None:
        bound = validate.number(OWNER, "bound", bound, above=0.0, infinite=True)
    runs = [Run(plan, study.simulation(plan)) for plan in plans]
    with bar(study.label) if progress is True else contextlib.nullcontext(progress) as show:
        measure(runs, judge, repeats, show if callable(show) else None)
    limit = judge.bound if bound is None else bound
    mark(runs, limit)
    names = {name: distinct([plan.values[name] for plan in plans]) for name in vary}
    return table(study, runs, names, judge.describe(), limit, repeats)


def choose_judge(study: Study, plans: Sequence[Plan], error: Any, reference: Any) -> Judge:
    """What gives the runs their errors."""
    if error is None:
        known = study.known_here and reference is None
        error = "known" if known else "converged"
    if error != "converged" and reference is not None:
        raise validate.fail(
            OWNER, "error", "be 'converged' with a reference", error, "leave one of them out"
        )
    if callable(error):
        return Known(error)
    validate.choice(OWNER, "error", error, ERRORS)
    if error == "converged":
        return Converged(study, plans, reference)
    if error == "known":
        if study.known is None:
            raise validate.fail(
                OWNER, "error", f"be another where {study.label} has no error(sim)", error,
                "pass a function, 'converged', 'energy' or 'momentum'",
            )  # fmt: skip
        return Known(study.known)
    return EnergyDrift() if error == "energy" else MomentumDrift()


def measure(runs: Sequence[Run], judge: Judge, repeats: int, progress: Progress | None) -> None:
    """Warm up, run in turn, and judge."""
    judge.check(runs)
    done, total = 0, repeats * sum(run.plan.frames for run in runs)

    def count(frames: int = 1) -> None:
        nonlocal done
        done += frames
        if progress is not None:
            progress(done, total)

    for run in runs:
        run.warm_up()
    for repeat in range(repeats):
        watch = judge.watch if judge.watches and repeat == 0 else None
        for run in runs:
            if run.cause and repeat:
                count(run.plan.frames)  # it would go the same way again
                continue
            run.cause = ""
            run.advance(watch, count)
            if repeat == 0 and not run.cause:
                judge.finish(run)
    for run in runs:
        run.sim.close()
    judge.judge(runs)


def mark(runs: Sequence[Run], bound: float) -> None:
    """Have runs count as diverged whose error is not finite or beyond the bound."""
    for run in runs:
        if not run.cause and not run.error <= bound:
            which = "be finite" if not math.isfinite(run.error) else f"be at most {bound:g}"
            run.cause = f"error must {which}, got {run.error:g}"


def table(
    study: Study,
    runs: Sequence[Run],
    vary: dict[str, list[Any]],
    error: str,
    bound: float,
    repeats: int,
) -> Tradeoff:
    """The table of runs that are done and judged."""
    return Tradeoff(
        scene=study.label,
        error=error,
        rows=[row(run) for run in runs],
        vary=vary,
        duration=study.duration,
        repeats=repeats,
        device=str(runs[0].sim.device),
        bound=bound,
        process_bytes=process_bytes(),
    )


def distinct(values: Sequence[Any]) -> list[Any]:
    """Without repeats, in order; values need not be hashable."""
    return list({repr(value): value for value in values}.values())


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
