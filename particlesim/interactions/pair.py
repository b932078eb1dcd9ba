"""Forces between pairs of particles: any law, within a cutoff or between all."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
import warp as wp

from .. import validate
from ..engine.limit import Limit
from ..engine.model import Model
from ..engine.neighbors.all_pairs import AllPairs
from ..engine.neighbors.lists import Neighbors
from ..engine.probe import Probe
from ..engine.state import State
from ..kernels.engine.loops import Term
from ..kernels.interactions import pair as kernels
from ..scene.law import Law
from ..scene.law import law as make_law
from ..scene.part import Interaction
from .arguments import Arguments
from .consistency import is_ordinary, of_pair_force
from .exchange import is_symmetric, named
from .pair_limits import collisions
from .pair_loop import PairLoop, check_names, squared_distances


class Pair(Interaction):
    """Base of central pair forces f_ij = F(r) (x_i - x_j) / r.

    A member gives a potential u(r), a force F(r) = -du/dr, or both; what is missing is derived
    (the force from the potential) or goes without (no energy is reported for a force alone).
    Coincident particles are pushed apart along a fixed direction, equally and opposite.

    Args:
        potential: Law ``u(r, ...)`` [energy], or None.
        force: Law ``F(r, ...)`` [force], positive where it repels, or None.
        group: Which particles interact with each other; None: all.
        cutoff: Distance beyond which there is no force [length]; None: all pairs.
        parameters: Values of the law's further parameters. Parameters that are not given are
            quantities of the two particles, named ``mass_i``, ``charge_j`` and so on.
    """

    listed = True  # sums over a list of pairs, in one pass with others that share it

    def __init__(
        self,
        potential: Law | None,
        force: Law | None,
        group: Any,
        cutoff: float | None,
        parameters: dict[str, Any],
    ):
        self.potential, self.force, self.group = potential, force, group
        self.cutoff = (
            None
            if cutoff is None
            else validate.number(self.name, "cutoff", cutoff, above=0.0, unit="length")
        )
        self.laws = [each for each in (potential, force) if each is not None]
        for each in self.laws:
            if not each.parameters:
                raise validate.fail(
                    self.name, "law", "take the distance r as its first parameter", each.name,
                    "write def law(r, ...)",
                )  # fmt: skip
            check_names(self.name, each)
            if "cutoff" in each.parameters and self.cutoff is not None:
                parameters = {**parameters, "cutoff": self.cutoff}
        if potential is not None:
            potential.check_derivable(self.name)
        self.arguments = [
            Arguments(self.name, each, 1, parameters, ("_i", "_j")) for each in self.laws
        ]
        self.parameters: dict[str, Any] = {}
        self.quantities: set[str] = set()
        for argument in self.arguments:
            self.parameters |= argument.values
            self.quantities |= argument.quantities
        self.requires = frozenset({"force"}) | self.quantities
        self.reads_velocity = "velocity" in self.quantities
        self.conservative = potential is not None and not self.reads_velocity

    @property
    def acts(self) -> bool:
        """Whether a pair can feel anything. Nothing is asked of a law that is zero everywhere.

        (Zero times what a singular law gives for coincident particles is not a number.)
        """
        return True

    def kind(self) -> tuple[Any, ...]:
        laws = [each and each.key for each in (self.potential, self.force)]
        return (type(self), *laws, self.cutoff is None, tuple(self.parameters))

    def prepare(self, model: Model, neighbors: Neighbors) -> None:
        self.model = model
        for each in self.arguments:
            each.check(model.attributes)
        # Of the laws as they are now.
        self.functions = [each.function(model.precision, self.name, float) for each in self.laws]
        self.pairs = neighbors.of(self, self.quantities)
        columns = self.columns(self.parameters)
        model.fits(self.name, columns)
        cutoff = None if self.cutoff is None else np.array([peer.cutoff for peer in self.peers])
        columns |= squared_distances(self.name, model, cutoff)
        columns["cutoff_squared"] *= [peer.acts for peer in self.peers]
        self.Params, self.params = model.parameters("PairParameters", columns)

    def attach(self, model: Model, state: State) -> None:
        fields = self.fields_of(self.pairs)
        self.loop = PairLoop.over(model, self.pairs, "Pair", fields, self.Params, self.params)
        derived = self.force is None
        rounding = "any" if derived and is_ordinary(self) else "fused"
        self.term = self._term(kernels.force_term, -1, derivative=derived, rounding=rounding)

    @property
    def reciprocal(self) -> bool:
        """Whether i feels of j what j feels of i, as far as tries on some pairs tell."""
        members = np.unique(self.pairs.members_host)
        return all(is_symmetric(each, self.model, members, self.cutoff) for each in self.arguments)

    def complaint(self) -> str:
        """That places are too coarse for the cutoff, or for how far particles are apart; that the
        law does not fit the periodic box, or the precision.
        """
        members = self.pairs.members_host
        name, lengths = "spacing", self.model.apart()[1]
        if self.cutoff is not None:
            cutoff = np.array([peer.cutoff for peer in self.peers])
            name, lengths = "cutoff or spacing", np.minimum(lengths, cutoff)
        lengths = lengths[self.model.world_of[members]]
        return self.model.unresolved(self.name, name, lengths, members) or of_pair_force(self)

    def fields_of(self, pairs: AllPairs) -> dict[str, wp.array]:
        """What the term reads, in the order of a list's slots."""
        own = {name: pairs.fields[name] for name in self.quantities if name != "position"}
        return {"x": pairs.fields["position"], **own}

    def _term(self, make: Callable[..., Term], k: int, **options: Any) -> Term:
        """A term of the k-th law."""
        precision = self.model.precision
        arguments = self.arguments[k].source({"_i": "i", "_j": "j"})
        law, Data = self.functions[k], self.loop.Data
        return make(law, arguments, precision, Data, self.Params, **options)

    def apply(self, state: State, neighbors: Neighbors, dt: float) -> None:
        self.loop.sum(self.term, kernels.add_force, {"f": state.force})

    def limits(self, probe: Probe) -> list[Limit]:
        """By the gradient at the present distances and, within a cutoff, at those to come."""
        return probe.response(self) + ([] if self.cutoff is None else collisions(self, probe))

    def measure(self, state: State, energy: wp.array, virial: wp.array) -> None:
        out = {"energy": energy, "virial": virial}
        if self.force is None:
            terms = [self._term(kernels.measure_term, 0)]
        else:
            terms = [self._term(kernels.virial_term, -1)]
            if self.potential is not None:
                terms.append(self._term(kernels.energy_term, 0))
        for term in terms:
            self.loop.sum(term, kernels.store_measure, out)


class PairPotential(Pair):
    """Pair force from an energy law: f = -du/dr, derived by ``wp.grad`` inside the kernel.

    Args:
        law: ``u(r, ...)`` [energy]; made by :func:`particlesim.scene.law` or a plain function. One
            whose first parameter is called ``distance_squared`` gets r^2, which saves a root.
        group: Which particles interact with each other; None: all.
        cutoff: Distance beyond which there is no force [length]; None: all pairs of a world.
        **parameters: The law's further parameters; those not given are quantities of the two
            particles (``charge_i``, ``mass_j``), which the law must treat alike.

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

    def __init__(self, law: Any, group: Any = None, *, cutoff: float | None, **parameters: Any):
        super().__init__(make_law(law), None, group, cutoff, parameters)

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

    Arguments as for :class:`PairPotential`; a law of ``distance_squared`` gives F / r. No energy is
    reported. A law that is another with i and j exchanged, as ``charge_i * mass_j`` is, gives
    forces that are not opposite: i feels F of (i, j), j feels F of (j, i), and momentum is not
    kept. A warning says so, once for each law.

    Example:
        >>> @law
        ... def repel(r: float, stiffness: float):
        ...     return stiffness * (1.0 - r)
        >>> PairForce(repel, cutoff=1.0, stiffness=10.0).cutoff
        1.0
    """

    def __init__(self, law: Any, group: Any = None, *, cutoff: float | None, **parameters: Any):
        super().__init__(None, make_law(law), group, cutoff, parameters)

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
