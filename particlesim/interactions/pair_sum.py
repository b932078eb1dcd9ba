"""Sums over pairs for interactions of one's own, in as many passes as they take."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
import warp as wp

from .. import validate
from ..engine.model import Model
from ..engine.neighbors.lists import Neighbors
from ..kernels.interactions import pair as kernels
from ..scene.law import Law
from ..scene.law import law as make_law
from ..scene.part import Interaction
from .laws.arguments import Arguments
from .pair_loop import OWN, PairLoop, check_names, squared_distances

# What a law may name of the pair, and how many numbers it returns by what it says it returns.
PAIR = {"r": "r", "x_ij": "along", "distance_squared": "square"}
WIDTHS = {inspect.Signature.empty: 1, float: 1, wp.vec2: 2, wp.vec3: 3, wp.vec4: 4}
READ = "read_{0}(d.{0}, {1})"


class PairSum:
    r"""The sum of a law over the partners of every particle: one pass of an interaction.

        s_i = sum_j law(i, j), or then(s_i), over the pairs of a group nearer than the cutoff

    Made in ``prepare`` of an :class:`Interaction`, which has a ``group``, a ``cutoff`` (None: all
    pairs of a world) and ``parameters``, a dict of numbers and 3-vectors that may differ from world
    to world. What is summed is added to an array of the particles, such as the force, or kept for
    the passes after it. All passes of an interaction go over one list of neighbours.

    Args:
        part: The interaction, ``self`` there.
        model: As ``prepare`` gets it.
        neighbors: As ``prepare`` gets them.
        law: Function of a pair (see ``particlesim.law``); a vector it returns is written after the
            arrow, ``-> wp.vec3``. Its arguments are, by name, ``r`` [length], ``x_ij: wp.vec3``
            from j to i, ``distance_squared``; what both particles have, as ``mass_i``, ``charge_j``
            or ``velocity_i: wp.vec3``; what an earlier pass has kept; and the interaction's
            parameters, ``cutoff`` among them. Of coincident particles x_ij is short and not zero,
            along a fixed direction, opposite for the two.
        then: Law of one particle, from the sum to what becomes of it: of ``total``, ``mass`` and
            so on, what earlier passes have kept and the parameters. None: the sum itself.
        **earlier: Passes that run before, by the names that the laws read them by.

    Raises:
        ValueError: Something that a law names is not there.

    Laws that choose by ``wp.where``, ``wp.max`` and ``wp.min`` rather than by ``if`` run on the
    CPU's vector units. A law may derive others, by ``wp.grad(law)(arguments)``. What laws name of
    the particles is required of the state without further saying.

    Example:
        A metal after Finnis and Sinclair (1984), u = sum_i (sum_j V(r_ij) / 2 - A sqrt(rho_i)) with
        rho_i = sum_j phi(r_ij), in two passes. First the slope of the square root at rho, then

            f_i = -sum_j (V' + (slope_i + slope_j) phi') x_ij / r

        >>> @law
        ... def phi(r: float, d: float):
        ...     return wp.min(r - d, 0.0) * wp.min(r - d, 0.0)
        >>> @law
        ... def slope(total: float, A: float):
        ...     return -0.5 * A / wp.sqrt(wp.max(total, 1.0e-12))
        >>> @law
        ... def pull(r: float, x_ij: wp.vec3, slope_i: float, slope_j: float, d: float,
        ...          c: float, k: float) -> wp.vec3:
        ...     repulsion = 2.0 * k * wp.min(r - c, 0.0)  # of V = k (r - c)^2
        ...     return -(repulsion + (slope_i + slope_j) * 2.0 * wp.min(r - d, 0.0)) / r * x_ij
        >>> class Metal(Interaction):
        ...     def __init__(self, group=None, A=1.9, d=4.4, c=3.25, k=5.0):
        ...         self.group, self.cutoff = group, max(c, d)
        ...         self.parameters = {"A": A, "d": d, "c": c, "k": k}
        ...     def prepare(self, model, neighbors):
        ...         self.slope = PairSum(self, model, neighbors, phi, then=slope)
        ...         self.pull = PairSum(self, model, neighbors, pull, slope=self.slope)
        ...     def apply(self, state, neighbors, dt):
        ...         self.slope.keep()
        ...         self.pull.add_to(state.force)
        >>> scene = Scene()
        >>> tungsten = scene.add_particles(sample.lattice("bcc", (3, 3, 3), 3.165), mass=184.0)
        >>> _ = scene.add_interaction(Metal(tungsten))
        >>> sim = Simulation(scene, Settings(dt=0.01), device="cpu")
        >>> sim.step()
    """

    def __init__(
        self, part: Interaction, model: Model, neighbors: Neighbors, law: Any, *, then: Any = None,
        **earlier: PairSum,
    ) -> None:  # fmt: skip
        self.name, self.part, self.model = f"{part.name}.PairSum", part, model
        self.of_pair = self._bound(law, ("_i", "_j"), PAIR, earlier)
        self.of_one = None if then is None else self._bound(then, ("",), ("total",), earlier)
        self.last = self.of_one or self.of_pair
        bound = {self.of_pair, self.last}
        self.functions = {
            each: each.law.function(model.precision, self.name, _returned(each.law))
            for each in bound
        }
        self.kept = self._checked(earlier)
        self.names = (self.of_pair.quantities | self.last.quantities) - self.kept.keys()
        part.requires = part.requires | self.names
        if "velocity" in self.names:
            part.reads_velocity = True
        self.pairs = neighbors.of(part, self.names)
        cutoff = None if part.cutoff is None else np.array([each.cutoff for each in part.peers])
        columns = squared_distances(self.name, model, cutoff)
        for each in (self.of_pair, self.last):
            columns |= {name: self._column(each, name) for name in each.values}
        model.fits(self.name, {name: columns[name] for name in columns if name not in OWN})
        self.Params, self.params = model.parameters("PairSumParameters", columns)

    def _bound(
        self, func: Any, suffixes: Sequence[str], extra: Iterable[str], earlier: Mapping[str, Any]
    ) -> Arguments:
        """A law with what fills its arguments."""
        law = make_law(func)
        check_names(self.name, law)
        if law.returns not in WIDTHS:
            raise validate.fail(
                self.name, law.name, "return a number or a vector of 2 to 4", law.returns,
                "write def law(...) -> wp.vec3",
            )  # fmt: skip
        given = {k: v for k, v in _parameters(self.part).items() if k in law.parameters}
        bound = Arguments(self.name, law, 0, given, suffixes, tuple(extra))
        bound.check({**self.model.attributes, **earlier})
        return bound

    def _checked(self, earlier: Mapping[str, Any]) -> dict[str, PairSum]:
        named = self.of_pair.quantities | self.last.quantities
        validate.known(self.name, earlier, sorted(named), "what its laws name")
        for name, each in earlier.items():
            if not isinstance(each, PairSum) or each.part is not self.part:
                raise TypeError(
                    f"{self.name}: {name} must be a PairSum of the same interaction, got {each!r}; "
                    "make one before."
                )
        return dict(earlier)

    def _column(self, bound: Arguments, name: str) -> np.ndarray:
        """A parameter in every world."""
        worlds = [_parameters(peer) for peer in self.part.peers]
        return np.array([bound.value(name, each.get(name, bound.values[name])) for each in worlds])

    def keep(self) -> None:
        """Sum, for the passes after this one to read."""
        self._sum(self.slots, kernels.KEEP)

    def add_to(self, array: wp.array) -> None:
        """Sum, and add to an array over all particles: ``state.force``, or ``energy``."""
        numbers = 1 if array.dtype in (wp.float32, wp.float64) else len(array.dtype())
        shape = (self.model.particle_count, WIDTHS[self.last.law.returns])
        if (len(array), numbers) != shape:
            raise validate.fail(
                self.name, "array", f"hold (particles, numbers) = {shape}", (len(array), numbers),
                f"have {self.last.law.name} say what it returns, -> wp.vec3",
            )  # fmt: skip
        self._sum(array, kernels.ADD)

    @functools.cached_property
    def slots(self) -> wp.array:
        """What is kept, in the order of the list's slots."""
        precision, width = self.model.precision, WIDTHS[self.last.law.returns]
        return self.pairs.array(precision.scalar if width == 1 else precision.vector(width))

    @functools.cached_property
    def fields(self) -> dict[str, wp.array]:
        """What the laws read of the particles, in the order of the list's slots."""
        own = {name: self.pairs.fields[name] for name in sorted(self.names - {"position"})}
        kept = {name: each.slots for name, each in self.kept.items()}
        return {"x": self.pairs.fields["position"], **own, **kept}

    def _sum(self, array: wp.array, place: str) -> None:
        width = WIDTHS[self.of_pair.law.returns]
        loop = PairLoop.over(
            self.model, self.pairs, "PairSum", self.fields, self.Params, self.params
        )
        kinds = {name: each.dtype for name, each in self.fields.items()}
        law, arguments = self._called(self.of_pair, {"_i": "i", "_j": "j"}, PAIR)
        term = kernels.sum_term(law, arguments, width, kinds, *loop.types)
        then, arguments = None, []
        if self.of_one is not None:
            total = {"total": "total[0]" if width == 1 else "total"}
            then, arguments = self._called(self.of_one, {"": "i"}, total)
        store = functools.partial(
            kernels.sum_store, then, arguments, width, place, array.dtype, kinds
        )
        loop.sum(term, store, {"sum": array})

    def _called(
        self, bound: Arguments, index: Mapping[str, str], extra: Mapping[str, str]
    ) -> tuple[wp.Function, list[str]]:
        """A law's function, and the source of its arguments."""
        return self.functions[bound], bound.source(index, extra, READ)


def _returned(law: Law) -> Any:
    """What a law says that it returns; a number where it says nothing."""
    return float if law.returns is inspect.Signature.empty else law.returns


def _parameters(part: Interaction) -> dict[str, Any]:
    """What laws may name of an interaction."""
    own = getattr(part, "parameters", {})
    return own if part.cutoff is None else {"cutoff": part.cutoff, **own}
