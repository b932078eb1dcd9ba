"""The reference of a search: refined until it stops changing on the scale of the tolerance."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np

from ...instruments.watchdog.incident import SimulationError
from ...simulation.simulation import Simulation
from ..tradeoff.converged import ROUND_OFF, SETTLING, distance
from ..tradeoff.plan import Plan, Study

SHARE = 0.1  # of the tolerance that the reference may still change by
REFINEMENTS = 12  # at most
ORDERLY = 0.2  # by which changes may miss the ratio 2^order that extrapolation rests on


def settled(study: Study, finest: dict[str, Any], tolerance: float) -> np.ndarray:
    """Positions at the end, (n, 3), that doubling the substeps changes by a tenth of ``tolerance``.

    As long as the changes fall by 2^p, p the order of the integrator, the positions are
    extrapolated to no step at all, (2^p x' - x) / (2^p - 1) (Richardson 1911), which settles much
    earlier.

    Args:
        study: The scene.
        finest: Knobs and options of the first run, ``substeps`` among them, which are doubled.
        tolerance: Root mean square distance [length].

    Raises:
        SimulationError: It diverges however fine. A warning says that it does not settle, as that
            of a chaotic scene does not.
    """
    ladder: list[np.ndarray] = []  # positions
    limits: list[np.ndarray] = []  # extrapolated ones
    changes: list[float] = []
    values = {"precision": "float64", "compensated": True, **finest}
    for _ in range(REFINEMENTS):
        sim = _ended(study, study.plan(values, "reference"))
        values["substeps"] *= 2
        if sim is None:
            ladder, limits, changes = [], [], []
            continue
        ladder.append(sim.position.astype(float))
        if len(ladder) < 2:
            continue
        step = _nearest(sim, ladder[-1] - ladder[-2])
        changes.append(distance(sim, step, np.zeros_like(step)))
        power = 2.0**sim.integrator.order
        limits.append(ladder[-1] + step / (power - 1.0))
        enough = max(SHARE * tolerance, ROUND_OFF * float(np.abs(ladder[-1]).max(initial=0.0)))
        if changes[-1] <= enough:
            return ladder[-1]
        if len(changes) > 1:
            orderly = abs(changes[-2] / changes[-1] / power - 1.0) < ORDERLY
            if orderly and distance(sim, limits[-1], limits[-2]) <= enough:
                return limits[-1]
        if len(changes) > 2 and changes[-1] > SETTLING * changes[-3]:
            break  # chaos: further refinement would only cost
    return _unsettled(ladder, changes, values["substeps"] // 2, SHARE * tolerance)


def _unsettled(
    ladder: list[np.ndarray], changes: list[float], substeps: int, enough: float
) -> np.ndarray:
    """The last of it, with a warning."""
    if not ladder:
        raise SimulationError(
            f"tune: the reference has diverged even at {substeps} substeps; give frames that end "
            "before it does, or another error."
        )
    change = changes[-1] if changes else np.inf
    warnings.warn(
        f"tune: the reference must change by less than {enough:.3g}, got {change:.3g} from "
        f"doubling to {substeps} substeps; use fewer frames, if the scene is chaotic, or another "
        "error.",
        stacklevel=4,
    )
    return ladder[-1]


def _nearest(sim: Simulation, d: np.ndarray) -> np.ndarray:
    """Displacements by the short way round a periodic box."""
    length = sim.model.box_length[sim.model.world_of]
    turns = np.divide(d, length, out=np.zeros_like(d), where=length > 0)
    return d - length * np.round(turns)


def _ended(study: Study, plan: Plan) -> Simulation | None:
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
