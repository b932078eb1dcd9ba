"""The reference of a search: refined until it stops changing on the scale of the tolerance."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np

from ..errors import SimulationError
from ..tradeoff.converged import ROUND_OFF, SETTLING, distance
from ..tradeoff.plan import Plan, Study

SHARE = 0.1  # of the tolerance that the reference may still change by
REFINEMENTS = 12  # at most


def settled(study: Study, finest: dict[str, Any], tolerance: float) -> np.ndarray:
    """Positions at the end, (n, 3), that doubling the substeps changes by a tenth of ``tolerance``.

    Args:
        study: The scene.
        finest: Knobs and options of the first run; its substeps are doubled.
        tolerance: Root mean square distance [length].

    Raises:
        SimulationError: It diverges however fine. A warning says that it does not settle, as that
            of a chaotic scene does not.
    """
    before: np.ndarray | None = None
    changes: list[float] = []
    values = {"precision": "float64", "compensated": True, **finest}
    for _ in range(REFINEMENTS):
        plan = study.plan(values, "reference")
        x = _end(study, plan)
        if x is not None and before is not None:
            changes.append(distance(*x, before[1]))
            size = float(np.abs(x[1]).max(initial=0.0))
            if changes[-1] <= max(SHARE * tolerance, ROUND_OFF * size):
                return x[1]
            if len(changes) > 2 and changes[-1] > SETTLING * changes[-3]:
                break  # chaos: further refinement would only cost
        before = x
        values["substeps"] = 2 * plan.settings.substeps
    if before is None:
        raise SimulationError(
            f"tune: the reference has diverged even at {values['substeps'] // 2} substeps; give "
            "frames that end before it does, or another error."
        )
    warnings.warn(
        f"tune: the reference must change by less than {SHARE * tolerance:.3g}, got "
        f"{changes[-1] if changes else np.inf:.3g} from doubling to {values['substeps'] // 2} "
        "substeps; use fewer frames, if the scene is chaotic, or another error.",
        stacklevel=5,
    )
    return before[1]


def _end(study: Study, plan: Plan) -> tuple[Any, np.ndarray] | None:
    """The simulation of a plan and its positions at the end; None if it diverges."""
    sim = study.simulation(plan)
    try:
        for _ in range(plan.frames):
            sim.step()
    except SimulationError:
        return None
    finally:
        sim.close()
    return sim, sim.position.astype(np.float64)
