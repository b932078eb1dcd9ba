"""What measures of tuples share that keep a value, their own at the start where none is given."""

from __future__ import annotations

from typing import Any

import numpy as np

from ... import validate
from ...engine import topology
from ...engine.model import Model
from ...scene.law import Law
from ..solving.plasticity import Plastic


class Resting(Plastic):
    """Base of C(x) = q(x) - q_0, with q_0 = q at the start where none is given.

    A subclass names its arguments and measures q in NumPy; NaN where a tuple has none.
    """

    relative = True
    argument: str  # what the tuples are called
    size: int  # particles of a tuple
    exists: str  # what a tuple must have for q to be there, for errors

    def __init__(self, law: Law, tuples: Any, rest: Any, options: dict[str, Any]):
        tuples = topology.tuples(self.name, self.argument, tuples, self.size)
        self.from_start = rest is None
        value = 0.0 if rest is None else rest
        options[self.rest] = validate.rows(self.name, self.rest, value, len(tuples), None)
        super().__init__(law, tuples, **options)

    @staticmethod
    def quantity(x: np.ndarray) -> np.ndarray:
        """q of the positions x, (m, k, 3), as (m,)."""
        raise NotImplementedError

    def _within(self, lowest: float, highest: float = np.inf) -> None:
        """Refuse rest values that q never has."""
        rest = self.parameters[self.rest]
        bad = (rest < lowest) | (rest > highest)
        if bad.any():
            at = int(np.argmax(bad))
            bounds = f"be at least {lowest:.6g}"
            bounds += f" and at most {highest:.6g}" if np.isfinite(highest) else ""
            raise validate.fail(
                self.name, f"{self.rest}[{at}]", bounds, float(rest[at]), "give one within"
            )

    def columns(self, model: Model, w: int) -> dict[str, np.ndarray]:
        columns = super().columns(model, w)
        if self.from_start and len(self.particles):
            x = topology.pieces(model, w, self.particles)
            with np.errstate(invalid="ignore", divide="ignore"):
                rest = self.quantity(x)
            if np.isnan(rest).any():
                at = int(np.argmax(np.isnan(rest)))
                raise validate.fail(
                    self.name, f"{self.argument}[{at}]", f"have {self.exists} at the start",
                    self.particles[at].tolist(), f"leave it out, or give {self.rest}",
                )  # fmt: skip
            columns[self.rest] = rest
        return columns
