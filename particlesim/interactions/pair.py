"""Forces between pairs of particles: any law, within a cutoff or between all."""

from __future__ import annotations

from typing import Any

import numpy as np
import warp as wp

from .. import validate
from ..engine.execution.launch import launch
from ..engine.model import Model
from ..engine.neighbors.all_pairs import AllPairs
from ..engine.neighbors.lists import Neighbors
from ..engine.probing.limit import Limit
from ..engine.probing.probe import Probe
from ..engine.state import State
from ..engine.structs import filled, structure_of
from ..kernels.interactions import pair as kernels
from ..scene.law import Law
from ..scene.law import law as make_law
from ..scene.part import Interaction
from .arguments import Arguments
from .pair_limits import collisions

# Closer than this, particles count as coincident: in parts of the cutoff, and without a cutoff.
COINCIDENT, CLOSEST = 1e-6, 1e-12
OWN = {"cutoff_squared", "closest_squared"}  # parameters of every pair force


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
            taken = sorted(OWN & each.parameters.keys())
            if taken:
                raise validate.fail(
                    self.name, f"parameter of {each.name}", "have a name of its own", taken[0],
                    "rename it",
                )  # fmt: skip
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
        members = model.members([peer.group for peer in self.peers], self.name)
        cutoff = (
            None if self.cutoff is None else np.array([peer.cutoff for peer in self.peers], float)
        )
        self.pairs = neighbors.request(self.name, members, cutoff, self.quantities | {"position"})
        columns = self.columns(self.parameters)
        columns["cutoff_squared"] = (
            np.full(model.world_count, np.finfo(model.precision.numpy).max)
            if cutoff is None
            else cutoff**2 * [peer.acts for peer in self.peers]
        )
        columns["closest_squared"] = (
            np.full(model.world_count, CLOSEST**2) if cutoff is None else (COINCIDENT * cutoff) ** 2
        )
        self.Params, self.params = model.parameters("PairParameters", columns)

    def attach(self, model: Model, state: State) -> None:
        fields = self.fields_of(self.pairs)
        self.Data = structure_of("PairData", fields)
        self.data = filled(self.Data, fields)
        out = {"f": state.force}
        self.Out = structure_of("PairForces", out)
        self.out = filled(self.Out, out)
        precision = model.precision
        derivative = self.force is None
        chosen = self.laws[-1]
        arguments = self.arguments[-1].source({"_i": "i", "_j": "j"})
        self.term = kernels.force_term(
            chosen.function(precision), arguments, derivative, precision, self.Data, self.Params
        )
        store = kernels.add_force(precision, self.Data, self.Params, self.Out)
        self.kernel = self._kernel(self.term, store, self.Out, 3, vectorised=model.vectorised)

    def fields_of(self, pairs: AllPairs) -> dict[str, wp.array]:
        """What the term reads, in the order of a list's slots."""
        own = {name: pairs.fields[name] for name in self.quantities if name != "position"}
        return {"x": pairs.fields["position"], **own}

    def _kernel(self, term: Any, store: Any, out: Any, width: int, vectorised: bool) -> Any:
        model = self.model
        return kernels.pair_kernel(
            term, store, self.Data, self.Params, out, width, model.precision, model.periodic,
            self.pairs.partners, vectorised,
        )  # fmt: skip

    def apply(self, state: State, neighbors: Neighbors, dt: float) -> None:
        self.add_forces(self.params)

    def add_forces(self, params: wp.array) -> None:
        """Sum the forces by these parameters, one entry a world."""
        inputs = [self.pairs.pairs, self.model.box, params, self.data, self.out]
        launch(self.kernel, self.pairs.count, inputs, self.model.device)

    def limits(self, probe: Probe) -> list[Limit]:
        """By the gradient at the present distances and, within a cutoff, at those to come."""
        return probe.response(self) + ([] if self.cutoff is None else collisions(self, probe))

    def measure(self, state: State, energy: wp.array, virial: wp.array) -> None:
        if self.potential is None:
            return
        precision, out = self.model.precision, {"energy": energy, "virial": virial}
        Out = structure_of("PairMeasures", out)
        arguments = self.arguments[0].source({"_i": "i", "_j": "j"})
        term = kernels.measure_term(
            self.potential.function(precision), arguments, precision, self.Data, self.Params
        )
        store = kernels.store_measure(precision, self.Data, self.Params, Out)
        kernel = self._kernel(term, store, Out, 2, vectorised=self.model.vectorised)
        inputs = [self.pairs.pairs, self.model.box, self.params, self.data, filled(Out, out)]
        launch(kernel, self.pairs.count, inputs, self.model.device)


class PairPotential(Pair):
    """Pair force from an energy law: f = -du/dr, derived by ``wp.grad`` inside the kernel.

    Args:
        law: ``u(r, ...)`` [energy]; made by :func:`particlesim.scene.law` or a plain function.
        group: Which particles interact with each other; None: all.
        cutoff: Distance beyond which there is no force [length]; None: all pairs of a world.
        **parameters: The law's further parameters; those not given are quantities of the two
            particles (``charge_i``, ``mass_j``).

    Example:
        >>> @law
        ... def yukawa(r: float, strength: float, screening: float):
        ...     return strength * wp.exp(-r / screening) / r
        >>> PairPotential(yukawa, cutoff=5.0, strength=1.0, screening=0.7).parameters
        {'strength': 1.0, 'screening': 0.7}
    """

    def __init__(self, law: Any, group: Any = None, *, cutoff: float | None, **parameters: Any):
        super().__init__(make_law(law), None, group, cutoff, parameters)


class PairForce(Pair):
    """Pair force F(r) along the pair, given directly; positive repels.

    Arguments as for :class:`PairPotential`. No energy is reported.

    Example:
        >>> @law
        ... def repel(r: float, stiffness: float):
        ...     return stiffness * (1.0 - r)
        >>> PairForce(repel, cutoff=1.0, stiffness=10.0).cutoff
        1.0
    """

    def __init__(self, law: Any, group: Any = None, *, cutoff: float | None, **parameters: Any):
        super().__init__(None, make_law(law), group, cutoff, parameters)
