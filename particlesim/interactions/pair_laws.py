"""Forces between pairs by laws of one's own."""

from __future__ import annotations

import warnings
from typing import Any

from .. import validate
from ..engine.model import Model
from ..engine.state import State
from ..scene.law import law as make_law
from .laws.exchange import named
from .pair import SWITCHED, Pair


class PairPotential(Pair):
    """Pair force from an energy law: f = -du/dr, derived by ``wp.grad`` inside the kernel.

    Args:
        law: ``u(r, ...)`` [energy]; made by :func:`particlesim.scene.law` or a plain function. One
            whose first parameter is called ``distance_squared`` gets r^2, which saves a root.
        group, groups, cutoff, exclude, truncation, switch: As of ``Pair``: whom it is between, and
            up to where.
        **parameters: The law's further parameters, numbers or by kinds; those not given are
            quantities of the two particles (``charge_i``, ``mass_j``), which the law must treat
            alike.

    Raises:
        ValueError: When a simulation is made, of a law that is another with i and j exchanged: it
            would break Newton's third law, and keep neither momentum nor energy.

    Example:
        >>> @law
        ... def yukawa(r: float, strength: float, screening: float):
        ...     return strength * wp.exp(-r / screening) / r
        >>> PairPotential(yukawa, cutoff=5.0, strength=1.0, screening=0.7).parameters
        {'strength': 1.0, 'screening': 0.7}
    """

    def __init__(
        self, law: Any, group: Any = None, *, cutoff: Any, groups: Any = None, exclude: Any = None,
        truncation: str = "cut", switch: float = SWITCHED, **parameters: Any,
    ):  # fmt: skip
        super().__init__(
            make_law(law), None, group, cutoff, parameters, groups=groups, exclude=exclude,
            truncation=truncation, switch=switch,
        )  # fmt: skip

    def attach(self, model: Model, state: State) -> None:
        super().attach(model, state)
        if not self.reciprocal:
            raise validate.fail(
                self.name, f"law {self.laws[0].name}", "be the same with i and j exchanged",
                ", ".join(named(self.arguments[0])),
                "name each quantity of both particles and treat them alike, as in mass_i * mass_j; "
                "a PairForce may differ",
            )  # fmt: skip


class PairForce(Pair):
    """Pair force F(r) along the pair, given directly; positive repels.

    Arguments as for :class:`PairPotential`, but for its truncation; a law of ``distance_squared``
    gives F / r. No energy is reported. A law that is another with i and j exchanged, as
    ``charge_i * mass_j`` is, gives forces that are not opposite: i feels F of (i, j), j feels F of
    (j, i), and momentum is not kept. A warning says so, once for each law.

    Example:
        >>> @law
        ... def repel(r: float, stiffness: float):
        ...     return stiffness * (1.0 - r)
        >>> PairForce(repel, cutoff=1.0, stiffness=10.0).cutoff
        1.0
    """

    def __init__(
        self, law: Any, group: Any = None, *, cutoff: Any, groups: Any = None, exclude: Any = None,
        **parameters: Any,
    ):  # fmt: skip
        super().__init__(
            None, make_law(law), group, cutoff, parameters, groups=groups, exclude=exclude
        )

    def attach(self, model: Model, state: State) -> None:
        super().attach(model, state)
        law = self.laws[0]
        if law.content not in _WARNED and not self.reciprocal:
            _WARNED.add(law.content)
            names = ", ".join(named(self.arguments[0]))
            warnings.warn(
                f"{self.name}: law {law.name} is another with i and j exchanged ({names}): forces "
                "are not opposite, and momentum is not kept. Name each quantity of both particles "
                "and treat them alike if that is not meant.",
                stacklevel=2,
            )


_WARNED: set[str] = set()  # contents of laws
