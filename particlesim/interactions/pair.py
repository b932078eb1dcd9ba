"""Forces between pairs of particles: any law, within a cutoff or between all."""

from __future__ import annotations

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
from ..kernels.interactions.calls import CUT, SWITCH, Call
from ..scene.law import Law
from ..scene.part import Interaction
from .laws.arguments import Arguments
from .laws.consistency import is_ordinary, of_pair_force
from .laws.exchange import is_symmetric
from .pair_limits import collisions
from .pair_loop import PairLoop, check_names, squared_distances
from .selection import Chosen

TRUNCATIONS = ("cut", "shift", "force_shift", "xplor")
SWITCHED = 0.8  # of the cutoff, from where on a potential is smoothed if nothing else is said


class Pair(Interaction):
    """Base of central pair forces f_ij = F(r) (x_i - x_j) / r.

    A member gives a potential u(r), a force F(r) = -du/dr, or both; what is missing is derived
    (the force from the potential) or goes without (no energy is reported for a force alone).
    Coincident particles are pushed apart along a fixed direction, equally and opposite.

    Args:
        potential: Law ``u(r, ...)`` [energy], or None.
        force: Law ``F(r, ...)`` [force], positive where it repels, or None.
        group: Which particles interact with each other; None: all. Where something goes by kinds a
            list of groups, of which each is a kind.
        cutoff: Distance beyond which there is no force [length]; None: all pairs. Or by kinds,
            (kinds, kinds).
        parameters: Values of the law's further parameters, numbers or by kinds. Parameters that are
            not given are quantities of the two particles, named ``mass_i``, ``charge_j`` and so on.
        groups: Two groups, of which each feels only the other, in place of ``group``.
        exclude: Pairs that do not feel each other: a part that holds particles together, as
            ``Bonds`` or ``Angles`` (whose ends do not), (m, 2) indices, or a list of these.
        truncation: ``"cut"`` leaves the law as it is up to the cutoff; ``"shift"`` subtracts what
            the potential is there; ``"force_shift"`` also the line that makes the force continuous
            (Toxvaerd and Dyre 2011); ``"xplor"`` multiplies the potential, from ``switch`` on, with
            what takes it and its force to 0 smoothly (Brooks et al. 1983): x = r^2,
            (c - x)^2 (c + 2 x - 3 a) / (c - a)^3 from a = (switch cutoff)^2 to c = cutoff^2.
        switch: In parts of the cutoff.
    """

    follows_box = True
    listed = True  # sums over a list of pairs, in one pass with others that share it

    def __init__(
        self,
        potential: Law | None,
        force: Law | None,
        group: Any,
        cutoff: Any,
        parameters: dict[str, Any],
        *,
        groups: Any = None,
        exclude: Any = None,
        truncation: str = "cut",
        switch: float = SWITCHED,
    ):
        self.truncation = validate.choice(self.name, "truncation", truncation, TRUNCATIONS)
        self.potential, self.force, self.group = potential, force, group
        truncated = truncation != "cut"
        self.switch = validate.number(self.name, "switch", switch, above=0.0, maximum=0.99)
        self.chosen = Chosen(
            self.name, group, groups, cutoff, parameters, exclude, truncated=truncated
        )
        if self.chosen.kinds:
            self.group = self.chosen.group
        parameters = self.chosen.plain
        most = np.max(cutoff) if np.ndim(cutoff) == 2 else cutoff
        self.cutoff = (
            None
            if cutoff is None
            else validate.number(self.name, "cutoff", most, above=0.0, unit="length")
        )
        if truncated and cutoff is None:
            raise validate.fail(
                self.name, "cutoff", f"be given with truncation={truncation!r} [length]", None,
                "give one, or leave the law as it is",
            )  # fmt: skip
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
        what = tuple(self.parameters)
        return (
            type(self), *laws, self.cutoff is None, what, self.truncation, *self.chosen.kind
        )  # fmt: skip

    def prepare(self, model: Model, neighbors: Neighbors) -> None:
        self.model = model
        for each in self.arguments:
            each.check(model.attributes)
        # Of the laws as they are now.
        self.functions = [each.function(model.precision, self.name, float) for each in self.laws]
        self.pairs = neighbors.of(self, self.quantities)
        self.chosen.prepare(model, self.peers, self.pairs)
        largest = float(np.finfo(model.precision.numpy).max)
        columns = self.columns(self.parameters) | self.chosen.columns(self.peers, largest)
        if self.truncation != "cut":
            columns[CUT] = np.array([peer.cutoff for peer in self.peers])
            columns[SWITCH] = np.array([peer.switch for peer in self.peers])
        model.fits(self.name, columns)
        cutoff = None if self.cutoff is None else np.array([peer.cutoff for peer in self.peers])
        columns |= squared_distances(self.name, model, cutoff)
        columns["cutoff_squared"] *= [peer.acts for peer in self.peers]
        self.Params, self.params = model.parameters("PairParameters", columns)

    def attach(self, model: Model, state: State) -> None:
        fields = self.fields_of(self.pairs)
        self.loop = PairLoop.over(model, self.pairs, "Pair", fields, self.Params, self.params)
        rounding = "any" if self.derived and is_ordinary(self) else "fused"
        k = 0 if self.derived else -1
        self.term = self._term(kernels.force_term, k, derivative=self.derived, rounding=rounding)

    @property
    def derived(self) -> bool:
        """Its force comes of its potential, as it does where that is smoothed."""
        return self.force is None or self.truncation == "xplor"

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
        return {"x": pairs.fields["position"], **own, **self.chosen.fields}

    def _term(self, make: Callable[..., Term], k: int, **options: Any) -> Term:
        """A term of the k-th law."""
        precision = self.model.precision
        arguments = self.arguments[k].source({"_i": "i", "_j": "j"})
        call = Call(self.functions[k], tuple(arguments), self.chosen.selection, self.truncation)
        return make(call, precision, self.loop.Data, self.Params, **options)

    def apply(self, state: State, neighbors: Neighbors, dt: float) -> None:
        self.loop.sum(self.term, kernels.add_force, {"f": state.force})

    def limits(self, probe: Probe) -> list[Limit]:
        """By the gradient at the present distances and, within a cutoff, at those to come."""
        return probe.response(self) + ([] if self.cutoff is None else collisions(self, probe))

    def measure(self, state: State, energy: wp.array, virial: wp.array) -> None:
        make = kernels.measure_term if self.derived else kernels.virial_term
        out = {"energy": energy, "virial": virial}
        self.loop.sum(self._term(make, 0 if self.derived else -1), kernels.store_measure, out)
        self._measure_energy(energy)

    def measure_stress(self, state: State, energy: wp.array, stress: wp.array) -> bool:
        if type(self).measure is not Pair.measure:  # a member that has more than pairs
            return False
        k = 0 if self.derived else -1
        term = self._term(kernels.stress_term, k, derivative=self.derived)
        self.loop.sum(term, kernels.store_stress, {"energy": energy, "stress": stress})
        self._measure_energy(energy)
        return True

    def _measure_energy(self, energy: wp.array) -> None:
        """Add the potential, where it is not derived for the force."""
        if not self.derived and self.potential is not None:
            term = self._term(kernels.energy_term, 0)
            self.loop.sum(term, kernels.store_energy, {"energy": energy})
