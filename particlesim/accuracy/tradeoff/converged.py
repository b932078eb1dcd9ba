"""Errors against a reference: a run that is refined until it stops changing."""

from __future__ import annotations

import math
import warnings
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ... import validate
from ...instruments.watchdog.incident import SimulationError
from ...scene.settings import Settings
from ...simulation.simulation import Simulation
from .judges import Judge
from .plan import OWNER, Plan, Study
from .run import Run

REFINEMENTS = 6  # at most: to 2^7 of the finest substeps that are judged
SETTLING = 0.7  # of the change two refinements ago; more is no convergence, of any order
SHARE = 0.1  # of the smallest error that the reference may still change by
ROUND_OFF = 1e-13  # of the scene's size, float64: nothing below it can be told apart


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
        self.study, self.given, self.change = study, None, 0.0
        self.plan: Plan | None = None
        self.refined = False
        if reference is None or isinstance(reference, Mapping):
            self.plan = self._reference_plan(plans, dict(reference or {}))
        elif isinstance(reference, Settings):
            values = {name: getattr(reference, name) for name in reference.__dataclass_fields__}
            self.plan = self._reference_plan(plans, values)
        else:
            count = len(reference) if np.ndim(reference) == 2 else None
            self.given = validate.rows(OWNER, "reference", reference, count, 3)

    def _reference_plan(self, plans: Sequence[Plan], given: dict[str, Any]) -> Plan:
        settings = [plan.settings for plan in plans]
        base, values = self.study.settings, dict(given)
        for name in sorted({*self.study.split(plans[0].values, "vary")[0]} - set(given)):
            if len({repr(plan.values[name]) for plan in plans}) > 1:
                raise validate.fail(
                    OWNER, "reference", f"say which {name} is the most accurate", given or None,
                    f"pass reference={{{name!r}: ...}}, or error=, a function of the simulation",
                )  # fmt: skip
            values[name] = plans[0].values[name]
        verlet = any(each.integrator == "velocity_verlet" for each in settings)
        values.setdefault("precision", "float64")
        values.setdefault("compensated", True)
        values.setdefault("iterations", max(each.iterations for each in settings))
        values.setdefault("integrator", "velocity_verlet" if verlet else base.integrator)
        self.refined = "substeps" not in given and "dt" not in given
        if self.refined:
            finest = min(each.substep for each in settings)
            values["substeps"] = 2 * math.ceil(base.dt / finest * (1 - 1e-9))
        return self.study.plan(values, "reference")

    def check(self, runs: Sequence[Run]) -> None:
        counts = {run.sim.particle_count for run in runs}
        if self.given is not None:
            counts.add(len(self.given))
        if len(counts) > 1:
            raise validate.fail(
                OWNER, "error", "be a function, 'energy' or 'momentum' where the number of "
                f"particles varies ({', '.join(map(str, sorted(counts)))})", self.name,
                "positions can only be compared over the same particles",
            )  # fmt: skip

    def finish(self, run: Run) -> None:
        run.notes["position"] = run.sim.position.astype(np.float64)

    def judge(self, runs: Sequence[Run]) -> None:
        alive = [run for run in runs if not run.cause]
        if not alive:
            return
        if self.given is not None:
            self._compare(alive, self.given)
            return
        x = self._positions(alive[0].sim)
        if self.refined:
            self._settle(alive, x)
        elif x is None:
            raise SimulationError(f"{OWNER}: the reference has diverged; give a finer one.")
        else:
            self._compare(alive, x)

    def _settle(self, runs: Sequence[Run], before: np.ndarray | None) -> None:
        """Refine until the positions stop changing, and compare with the last of them."""
        changes: list[float] = []
        x = before
        for _ in range(REFINEMENTS):
            self._refine()
            x = self._positions(runs[0].sim)
            if x is not None:
                self._compare(runs, x)
                self.change = math.inf if before is None else distance(runs[0].sim, x, before)
                least = min((run.error for run in runs if math.isfinite(run.error)), default=0.0)
                if self.change <= max(SHARE * least, ROUND_OFF * np.abs(x).max(initial=0.0)):
                    return
                changes.append(self.change)
                if len(changes) > 2 and changes[-1] > SETTLING * changes[-3]:
                    break  # chaos: further refinement would only cost
            before = x
        self._complain(x)

    def _refine(self) -> None:
        assert self.plan is not None
        values = {**self.plan.values, "substeps": 2 * self.plan.settings.substeps}
        self.plan = self.study.plan(values, "reference")

    def _complain(self, last: np.ndarray | None) -> None:
        assert self.plan is not None
        substeps = self.plan.settings.substeps
        if last is None:
            raise SimulationError(
                f"{OWNER}: the reference has diverged even at {substeps} substeps; give frames "
                "that end before it does, or another error."
            )
        warnings.warn(
            f"{OWNER}: the reference must stop changing, got {self.change:.3g} from doubling to "
            f"{substeps} substeps; smaller errors mean nothing: use fewer frames, if the scene is "
            "chaotic, or another error.",
            stacklevel=5,
        )

    def _positions(self, like: Simulation) -> np.ndarray | None:
        """Where the reference ends, or None if it diverges."""
        assert self.plan is not None
        sim = self.study.simulation(self.plan)
        if sim.particle_count != like.particle_count:
            raise validate.fail(
                OWNER, "reference", f"have {like.particle_count} particles, as what is judged",
                sim.particle_count, "positions can only be compared over the same particles",
            )  # fmt: skip
        try:
            for _ in range(self.plan.frames):
                sim.step()
        except SimulationError:
            return None
        finally:
            sim.close()
        return sim.position.astype(np.float64)

    def _compare(self, runs: Sequence[Run], x: np.ndarray) -> None:
        for run in runs:
            run.error = distance(run.sim, run.notes["position"], x)
        start = np.concatenate([scene.position for scene in runs[0].sim.scenes])
        size = float(np.sqrt(((x - x.mean(axis=0)) ** 2).sum(axis=1).mean())) if len(x) else 0.0
        # Farther off than ten times what there is to be seen is no longer an inaccuracy.
        self.bound = 10.0 * max(size, distance(runs[0].sim, x, start)) or math.inf

    def describe(self) -> str:
        text = "rms distance from "
        if self.plan is None:
            return text + "given positions"
        text += f"a reference of {self.plan.settings.substeps} substeps"
        if self.refined:
            text += f", which changed by {self.change:.2g} when last doubled"
        return text


def distance(sim: Simulation, a: np.ndarray, b: np.ndarray) -> float:
    """Root mean square distance of the particles in two states, the short way round a box."""
    with np.errstate(all="ignore"):
        d = a - b
        for axis, on in enumerate(sim.model.periodic):
            if on:
                length = sim.model.box_length[sim.model.world_of, axis]
                d[:, axis] -= length * np.round(d[:, axis] / length)
        return float(np.sqrt((d**2).sum(axis=1).mean())) if len(d) else 0.0
