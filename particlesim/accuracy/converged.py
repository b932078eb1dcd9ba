"""Errors against a reference: positions that are given, or a run that is refined."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from .. import validate
from ..scene.settings import Settings
from .judges import Judge
from .observables import Observable, observable
from .reference import Reference
from .refining import SHARE, Refining
from .run import Run
from .series import WORDS, Apart, Series, World
from .study import KNOBS, Plan, Study, options_of

RUNS = 8  # of the reference, at most: to about 2^7 of the finest substeps that are judged
MEMORY = 2**24  # bytes of what is seen of a run
MOST = 1000  # times at which it is looked at, at most
# Options that say how fine space is divided, and whether more of it is finer.
SPACE = {"spacing": False, "particles": True, "resolution": True}
FINER = (1.25, 1.6)  # times the finest that varies: two references, of which the second is held


class Converged(Judge):
    """How far runs are from a reference in what is observed.

    Of positions and velocities it is the root mean square over the particles that move, of other
    values over all of them.

    Args:
        study: The scene.
        plans: All settings that are to be judged.
        reference: Positions (n, 3) at the end; or a dict of knobs and options, or a Settings, that
            the reference takes. Without ``substeps`` and ``dt`` among them, substeps are refined
            from more than the finest until the values change by less than a tenth of the smallest
            error, twice. None: refine in float64, by velocity Verlet unless there are
            constraints, everything else as the finest of ``vary``. Or a :class:`Reference` that
            has settled before.
        observe: What is compared, a name or a function; None: positions.
        over: How differences over time become one number.
    """

    name = "converged"
    watches = True

    def __init__(
        self,
        study: Study,
        plans: Sequence[Plan],
        reference: Any = None,
        observe: Any = None,
        over: str = "max",
    ):
        self.study, self.over = study, over
        self.varied: dict[str, set[str]] = {}
        for plan in plans:
            for name, value in plan.values.items():
                self.varied.setdefault(name, set()).add(repr(value))
        first = observable(study.owner, "position" if observe is None else observe)
        self.observables = [first]
        if observe is None:
            self.observables.append(observable(study.owner, "velocity"))
        self.given: np.ndarray | Refining | Reference
        self.space: dict[str, list[Any]] = {}  # what varies of the resolution of space
        if isinstance(reference, Settings):
            reference = {name: getattr(reference, name) for name in KNOBS}
        if isinstance(reference, Reference):
            self.times = len(reference.values[0][0]) - 1
            self.given, self.observables = reference, list(reference.observables)
        elif reference is None or isinstance(reference, Mapping):
            self.times = times_of(study, plans, over, self.observables)
            self.given = self._refining(plans, dict(reference or {}))
        else:
            self.times = self._times_of_positions(observe, over)
            count = len(reference) if np.ndim(reference) == 2 else None
            self.given = validate.rows(study.owner, "reference", reference, count, 3)
            self.observables = [first]

    def _times_of_positions(self, observe: Any, over: str) -> int:
        """Of positions at the end: one."""
        if over != "final" or observe not in (None, "position"):
            raise validate.fail(
                self.study.owner, "over", "be 'final', of positions, where the reference is given "
                "as positions", over, "leave out over= and observe=, or the reference",
            )  # fmt: skip
        return 1

    def _refining(self, plans: Sequence[Plan], given: dict[str, Any]) -> Refining:
        settings = [plan.settings for plan in plans]
        base, values = self.study.settings, dict(given)
        constrained = any(
            scene.constraints or any(part.answers for part in scene.interactions)
            for scene in self.study.scenes(plans[0].options)
        )
        finest = min(each.substep for each in settings)
        for name in sorted({*self.study.split(plans[0].values, "vary")[0]} - set(given)):
            different = {repr(plan.values[name]): plan.values[name] for plan in plans}
            values[name] = plans[0].values[name]
            if len(different) > 1:
                self.space[name] = self._resolutions(name, list(different.values()), given)
                values[name] = self.space[name][-1]
                finest /= FINER[-1]
        values.setdefault("precision", "float64")
        values.setdefault("compensated", True)
        values.setdefault("iterations", max(each.iterations for each in settings))
        # Not by what is judged, where there is another: what that gets wrong, it would too.
        values.setdefault("integrator", "symplectic_euler" if constrained else "velocity_verlet")
        refined = "substeps" not in given and "dt" not in given
        if refined:
            values["substeps"] = math.ceil(base.dt / finest * (1 - 1e-9)) + 1 | 1
        plan = self.study.plan(values, "reference")
        # Of space it is what remains of space that decides.
        most = (2 if self.space else RUNS) if refined else 1
        return Refining(self.study, plan, most, self.observables, self.over, self.times)

    def _resolutions(self, name: str, varied: list[Any], given: dict[str, Any]) -> list[Any]:
        """What references take where the resolution of space varies."""
        if name not in SPACE or self.observables[0].particles:
            raise validate.fail(
                self.study.owner, "reference", f"say which {name} is the most accurate",
                given or None,
                f"pass reference={{{name!r}: ...}}, or error=, a function of the simulation",
            )  # fmt: skip
        if SPACE[name]:
            return [type(varied[0])(round(max(varied) * factor)) for factor in FINER]
        return [min(varied) / factor for factor in FINER]

    def check(self, runs: Sequence[Run]) -> None:
        if not self.observables[0].particles:
            return
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

    def watch(self, run: Run) -> None:
        if run.judged.frame == 0:
            run.notes["series"] = Series(self.observables, max(run.plan.frames // self.times, 1))
        run.notes["series"].add(run.judged)

    def judge(self, runs: Sequence[Run]) -> None:
        alive = [run for run in runs if not run.cause]
        if not alive:
            return
        if isinstance(self.given, Reference):
            self._compare(alive, self.given)
            return
        if isinstance(self.given, np.ndarray):
            self._compare(alive, self._of_positions(alive[0], self.given))
            return
        for reference in self.given:
            self._compare(alive, reference)
            if self.given.most == 1:
                return
            if self.space:
                continue
            if reference.own_error <= self.given.enough(SHARE * self._least(alive)):
                self._compare(alive, self.given.confirm(reference))
                if self.floor <= self.given.enough(SHARE * self._least(alive)):
                    return
                break
        if self.space and self.given.last is not None:
            self._compare(alive, self.given.coarser(self.space))
        else:
            self._compare(alive, self.given.unsettled())

    def _least(self, runs: Sequence[Run]) -> float:
        """The smallest error so far."""
        return min((run.error for run in runs if math.isfinite(run.error)), default=0.0)

    def _of_positions(self, run: Run, x: np.ndarray) -> Reference:
        """A reference of positions at the end."""
        start = np.concatenate([scene.position for scene in run.judged.scenes])
        values = [[np.stack([start, x])]]
        return Reference(self.observables, "final", World.all_of(run.judged), values)

    @np.errstate(all="ignore")
    def _compare(self, runs: Sequence[Run], reference: Reference) -> None:
        own = reference.own_error
        self.floor = own if math.isfinite(own) else 0.0  # of a single run it is not known
        self.scale = reference.scale
        for run in runs:
            series = run.notes["series"]
            values = [
                [series.of(k, w) for w in range(len(reference.worlds))]
                for k in range(len(self.observables))
            ]
            found = [reference.apart(values, k) for k in range(len(self.observables))]
            run.settle([each.rms for each in found[0]])
            if reference.values[0][0][0].size > 1:
                run.parts["worst"] = float(np.median([each.worst for each in found[0]]))
            if self.over == "mean" and not self.observables[0].particles:
                run.parts["chance"] = _chance(found[0])
            if len(found) > 1:
                run.parts["velocity"] = float(np.median([each.rms for each in found[1]]))
        self.bound = 10.0 * max(self._size(reference), self.scale) or math.inf

    def _size(self, reference: Reference) -> float:
        """How far the particles of a reference are spread at its end.

        Farther off than ten times what there is to be seen is no longer an inaccuracy.
        """
        if not self.observables[0].particles:
            return math.inf
        ends = [values[-1] for values in reference.values[0]]
        return max(
            float(np.sqrt(((x - x.mean(axis=0)) ** 2).sum(axis=1).mean())) if len(x) else 0.0
            for x in ends
        )

    def describe(self) -> str:
        seen = self.observables[0]
        what = "distance" if seen.name == "position" else f"difference of {seen.name}"
        whom = " (of those that move)" if seen.particles else ""
        text = f"rms {what} from " + (
            "given positions" if isinstance(self.given, np.ndarray) else "a reference"
        )
        if isinstance(self.given, Refining):
            text += f" of {self.given.plan.settings.substeps} substeps"
        text += f"{whom}, {WORDS[self.over]}"
        if isinstance(self.given, Refining) and self.given.most > 1:
            text += f"; the reference changed by {self.floor:.2g} when last refined"
            words = ", ".join(f"{name}={each[-1]:.4g}" for name, each in self.space.items())
            text += f" in time and space, to {words}" if words else ""
        varied = {name for name, values in self.varied.items() if len(values) > 1}
        left = [
            name for name in options_of(self.study.build) if name in SPACE and name not in varied
        ]
        return text + (f"; of time only, {', '.join(left)} stays as it is" if left else "")


def _chance(found: Sequence[Apart]) -> float:
    """How large the median error of worlds might be by chance alone."""
    return float(np.median([each.chance for each in found]))


def times_of(
    study: Study, plans: Sequence[Plan], over: str, observables: Sequence[Observable]
) -> int:
    """How often to look at runs, so that all are seen at the same times and memory suffices."""
    if over == "final":
        return 1
    shared = math.gcd(study.frames, *(plan.frames for plan in plans))
    particles = sum(each.particle_count for each in study.scenes(plans[0].options))
    size = 24 * particles * max(len(study.seeds), 1) if observables[0].particles else 8
    most = int(min(max(MEMORY / max(size * len(observables), 1), 1), MOST))
    return max(k for k in range(1, shared + 1) if shared % k == 0 and k <= max(most, 1))
