"""Errors against a reference: positions that are given, or a run that is refined."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from .. import validate
from ..scene.settings import Settings
from .judges import Judge
from .reference import SHARE, Refining, distance
from .run import Run
from .study import KNOBS, Plan, Study

RUNS = 7  # of the reference, at most: to 2^7 of the finest substeps that are judged


class Converged(Judge):
    """Root mean square distance of the particles from where a reference has them at the end.

    Args:
        study: The scene.
        plans: All settings that are to be judged.
        reference: Positions (n, 3); or a dict of knobs and options, or a Settings, that the
            reference takes. Without ``substeps`` and ``dt`` among them, substeps are doubled from
            twice the finest until the positions change by less than a tenth of the smallest
            error. None: refine in float64, everything else as the finest of ``vary``.
    """

    name = "converged"

    def __init__(self, study: Study, plans: Sequence[Plan], reference: Any):
        self.study = study
        self.given: np.ndarray | Refining
        if isinstance(reference, Settings):
            reference = {name: getattr(reference, name) for name in KNOBS}
        if reference is None or isinstance(reference, Mapping):
            self.given = self._refining(plans, dict(reference or {}))
        else:
            count = len(reference) if np.ndim(reference) == 2 else None
            self.given = validate.rows(study.owner, "reference", reference, count, 3)

    def _refining(self, plans: Sequence[Plan], given: dict[str, Any]) -> Refining:
        settings = [plan.settings for plan in plans]
        base, values = self.study.settings, dict(given)
        for name in sorted({*self.study.split(plans[0].values, "vary")[0]} - set(given)):
            if len({repr(plan.values[name]) for plan in plans}) > 1:
                raise validate.fail(
                    self.study.owner, "reference", f"say which {name} is the most accurate",
                    given or None,
                    f"pass reference={{{name!r}: ...}}, or error=, a function of the simulation",
                )  # fmt: skip
            values[name] = plans[0].values[name]
        verlet = any(each.integrator == "velocity_verlet" for each in settings)
        values.setdefault("precision", "float64")
        values.setdefault("compensated", True)
        values.setdefault("iterations", max(each.iterations for each in settings))
        values.setdefault("integrator", "velocity_verlet" if verlet else base.integrator)
        refined = "substeps" not in given and "dt" not in given
        if refined:
            finest = min(each.substep for each in settings)
            values["substeps"] = 2 * math.ceil(base.dt / finest * (1 - 1e-9))
        return Refining(self.study, self.study.plan(values, "reference"), RUNS if refined else 1)

    def check(self, runs: Sequence[Run]) -> None:
        owner, given = self.study.owner, self.given
        counts = {run.sim.particle_count for run in runs}
        if isinstance(given, np.ndarray):
            counts.add(len(given))
        if len(counts) > 1:
            raise validate.fail(
                owner, "error", "be a function, 'energy' or 'momentum' where the number of "
                f"particles varies ({', '.join(map(str, sorted(counts)))})", self.name,
                "positions can only be compared over the same particles",
            )  # fmt: skip
        if isinstance(given, Refining):
            count = sum(each.particle_count for each in self.study.scenes(given.plan.options))
            if count not in counts:
                raise validate.fail(
                    owner, "reference", f"have {counts.pop()} particles, as what is judged", count,
                    "positions can only be compared over the same particles",
                )  # fmt: skip

    def finish(self, run: Run) -> None:
        run.notes["position"] = run.sim.position.astype(np.float64)

    def judge(self, runs: Sequence[Run]) -> None:
        alive = [run for run in runs if not run.cause]
        if not alive:
            return
        if not isinstance(self.given, Refining):
            self._compare(alive, self.given)
            return
        for x in self.given:
            self._compare(alive, x)
            least = min((run.error for run in alive if math.isfinite(run.error)), default=0.0)
            if self.given.most == 1 or self.given.change <= self.given.enough(SHARE * least):
                return
        self.given.unsettled("stop changing")

    def _compare(self, runs: Sequence[Run], x: np.ndarray) -> None:
        for run in runs:
            run.error = distance(run.sim, run.notes["position"], x)
        start = np.concatenate([scene.position for scene in runs[0].sim.scenes])
        size = float(np.sqrt(((x - x.mean(axis=0)) ** 2).sum(axis=1).mean())) if len(x) else 0.0
        # Farther off than ten times what there is to be seen is no longer an inaccuracy.
        self.bound = 10.0 * max(size, distance(runs[0].sim, x, start)) or math.inf

    def describe(self) -> str:
        if not isinstance(self.given, Refining):
            return "rms distance from given positions"
        text = f"rms distance from a reference of {self.given.plan.settings.substeps} substeps"
        if self.given.most == 1:
            return text
        return f"{text}, which changed by {self.given.change:.2g} when last doubled"
