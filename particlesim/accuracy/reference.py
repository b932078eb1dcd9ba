"""References: runs of a scene that are refined until their end stops changing."""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from ..instruments.watchdog.incident import SimulationError
from ..simulation.simulation import Simulation
from .study import Plan, Study

SETTLING = 0.7  # of the change two refinements ago; more is no convergence, of any order
ORDERLY = 0.2  # by which changes may miss the ratio 2^order that extrapolation rests on
SHARE = 0.1  # of the smallest error to be seen that the reference may still change by
REFINEMENTS = 12  # at most, where the tolerance is known
ROUND_OFF = 1e-13  # of the scene's size, float64: nothing below it can be told apart


class Refining:
    """Runs of a plan, its substeps doubled from one to the next, while that leads anywhere.

    Iterating gives the positions at the end of each run, (n, 3) float64. It stops after ``most``
    runs, or when the changes no longer fall, as those of a chaotic scene. Runs that diverge give
    nothing. ``change`` is the rms distance by which the last doubling moved the particles. As long
    as the changes fall by 2^p, p the order of the integrator, ``limit`` is the positions
    extrapolated to no step at all, (2^p x' - x) / (2^p - 1) (Richardson 1911), and
    ``limit_change`` by how much these changed; otherwise that is infinite.

    Args:
        study: The scene.
        plan: Of the first run.
        most: How many runs, at most.
    """

    def __init__(self, study: Study, plan: Plan, most: int):
        self.study, self.plan, self.most = study, plan, most
        self.x: np.ndarray | None = None
        self.limit: np.ndarray | None = None
        self.changes: list[float] = []
        self.limit_change = math.inf

    @property
    def change(self) -> float:
        return self.changes[-1] if self.changes else math.inf

    def __iter__(self) -> Iterator[np.ndarray]:
        for number in range(self.most):
            if number:
                values = {**self.plan.values, "substeps": 2 * self.plan.settings.substeps}
                self.plan = self.study.plan(values, "reference")
            sim = ended(self.study, self.plan)
            if sim is None:
                self.x, self.limit, self.changes = None, None, []
                continue
            yield self._add(sim)
            if len(self.changes) > 2 and self.change > SETTLING * self.changes[-3]:
                return  # chaos: further refinement would only cost

    @np.errstate(all="ignore")
    def _add(self, sim: Simulation) -> np.ndarray:
        before, limit, self.x = self.x, self.limit, sim.position.astype(np.float64)
        if before is not None:
            step = nearest(sim, self.x - before)
            self.changes.append(rms(step))
            power = 2.0**sim.integrator.order
            self.limit = self.x + step / (power - 1.0)
            self.limit_change = math.inf
            # Multiplied out, as a change may be zero.
            orderly = len(self.changes) > 1 and (
                abs(self.changes[-2] - power * self.change) < ORDERLY * power * self.change
            )
            if orderly and limit is not None:
                self.limit_change = rms(nearest(sim, self.limit - limit))
        return self.x

    def enough(self, allowed: float) -> float:
        """The change that counts as none: the allowed one, or that of rounding."""
        assert self.x is not None
        return max(allowed, ROUND_OFF * float(np.abs(self.x).max(initial=0.0)))

    def unsettled(self, must: str) -> np.ndarray:
        """The last positions, with a warning.

        Raises:
            SimulationError: It diverges however fine.
        """
        owner, substeps = self.study.owner, self.plan.settings.substeps
        if self.x is None:
            raise SimulationError(
                f"{owner}: the reference has diverged even at {substeps} substeps; give more, "
                "frames that end before it does, or another error."
            )
        warnings.warn(
            f"{owner}: the reference must {must}, got {self.change:.3g} from doubling to "
            f"{substeps} substeps; smaller errors mean nothing: use fewer frames, if the scene is "
            "chaotic, or another error.",
            stacklevel=6,
        )
        return self.x


def settled(study: Study, finest: Mapping[str, Any], tolerance: float) -> np.ndarray:
    """Positions at the end, (n, 3), that doubling the substeps changes by a tenth of ``tolerance``.

    Extrapolated ones where these settle first, which is much earlier.

    Args:
        study: The scene.
        finest: Knobs and options of the first run, ``substeps`` among them, which are doubled.
        tolerance: Root mean square distance [length].

    Raises:
        SimulationError: It diverges however fine. A warning says that it does not settle, as that
            of a chaotic scene does not.
    """
    plan = study.plan({"precision": "float64", "compensated": True, **finest}, "reference")
    refining = Refining(study, plan, REFINEMENTS)
    for x in refining:
        enough = refining.enough(SHARE * tolerance)
        if refining.change <= enough:
            return x
        if refining.limit is not None and refining.limit_change <= enough:
            return refining.limit
    return refining.unsettled(f"change by less than {SHARE * tolerance:.3g}")


def ended(study: Study, plan: Plan) -> Simulation | None:
    """The simulation of a plan at its end; None if it diverges."""
    sim = study.simulation(plan)
    try:
        for _ in range(plan.frames):
            sim.step()
    except SimulationError:
        return None
    finally:
        sim.close()
    return sim


@np.errstate(all="ignore")
def distance(sim: Any, a: np.ndarray, b: np.ndarray) -> float:
    """Root mean square distance of the particles in two states, the short way round a box."""
    return rms(nearest(sim, a - b))


@np.errstate(all="ignore")
def nearest(sim: Any, d: np.ndarray) -> np.ndarray:
    """Displacements by the short way round a periodic box."""
    length = sim.model.box_length[sim.model.world_of]
    turns = np.divide(d, length, out=np.zeros_like(d), where=length > 0)
    return d - length * np.round(turns)


@np.errstate(all="ignore")
def rms(d: np.ndarray) -> float:
    """Root mean square length of vectors (n, 3)."""
    return float(np.sqrt((d**2).sum(axis=1).mean())) if len(d) else 0.0
