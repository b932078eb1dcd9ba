"""Smoothing lengths that follow the density: what is given, and how they are found."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from typing import Any

import numpy as np
import warp as wp

from ... import validate
from ...engine.execution.launch import call, launch, when
from ...engine.model import Model
from ...engine.neighbors.lists import Neighbors
from ...engine.neighbors.own_reach import OwnReach
from ...engine.neighbors.verlet import VerletList
from ...engine.state import State
from ...kernels.interactions.fluid import lengths as kernels
from ..pair_loop import PairLoop
from .guess import guessed_lengths

LENGTH = "smoothing_length"  # the array of the state
FOUND = (LENGTH, "density", "pressure")  # with the forces
LARGEST, SMALLEST = 4.0, 1e-3  # of the largest at the start, and of the largest that there may be
GROWTH = 1.1  # of a length until its row is made anew, which it is from half of that on
PASSES = 8  # in a substep; one where nothing has moved, three in motion
RENEWALS = 60  # of rows at the start, until they reach as far as they are to
TOLERANCE = {"float32": 1e-5, "float64": 1e-9}  # of ln h


class AdaptiveSmoothing:
    """Smoothing lengths h_i = eta (m_i / rho_i)^(1/d), each particle's own.

    A particle has as many neighbours where the fluid is thin as where it is dense, and density and
    h fit each other: rho_i = sum_j m_j W(r_ij, h_i), by Newton's steps in every substep. Forces
    know how h follows the density (Springel and Hernquist 2002; Price 2012), so that momentum,
    angular momentum and energy are conserved as with one length. Lengths are the state array
    ``smoothing_length``; in a substep none grows by more than a tenth.

    Args:
        eta: h in spacings of particles, above 0: 1.2 makes 58 neighbours in three dimensions, 1.6
            makes 137.
        largest: No h is above it [length]; particles that would need more, as those that fly off
            by themselves, keep it. None: about four times the largest of the start. In a periodic
            box a quarter of the shortest side at most.

    Raises:
        ValueError: A value out of range.

    Example:
        >>> from particlesim import Polytrope
        >>> gas = SPH(smoothing_length=AdaptiveSmoothing(eta=1.3),
        ...           equation_of_state=Polytrope(1.0, 1.5))
        >>> gas.parameters["eta"]
        1.3
    """

    def __init__(self, eta: float = 1.2, largest: float | None = None) -> None:
        name = type(self).__name__
        self.eta = validate.number(name, "eta", eta, above=0.0)
        self.largest = largest
        if largest is not None:
            self.largest = validate.number(name, "largest", largest, above=0.0, unit="length")


class Lengths:
    """The smoothing lengths of a fluid in motion.

    Args:
        fluid: The ``SPH``, bound. model: Its model.
    """

    def __init__(self, fluid: Any, model: Model):
        self.fluid, self.model, self.support = fluid, model, fluid.smoothing.support
        self.members = model.members([peer.group for peer in fluid.peers], fluid.name)
        self.dimension, worlds = fluid.dimension, range(model.world_count)
        world, mass = model.world_of[self.members], model.column("mass")
        x, _ = model.wrapped(model.column("position"), model.world_of)
        first = np.zeros(model.particle_count)
        self.most = np.ones(model.world_count)
        for w in worlds:
            rows = self.members[world == w]
            given = fluid.peers[w].adaptive
            if len(rows):
                h = guessed_lengths(x[rows], mass[rows], self.dimension, given.eta)
                self.most[w] = LARGEST * h.max() if given.largest is None else given.largest
                first[rows] = h
            sides = model.box_length[w][model.box_length[w] > 0]
            self.most[w] = min(self.most[w], *(0.25 * side for side in sides), np.inf)
        self.least = SMALLEST * self.most
        first[self.members] = np.minimum(first[self.members], self.most[world])
        self.reach = OwnReach(LENGTH, self.support, GROWTH, first, self.support * self.most)

    def request(self, neighbors: Neighbors, names: set[str]) -> VerletList:
        """The list of the fluid."""
        fluid = self.fluid
        pairs = neighbors.request(
            fluid.name, self.members, self.support * self.most, {"position", *names}, own=self.reach
        )
        assert isinstance(pairs, VerletList)  # as there is a cutoff
        self.pairs = pairs
        return pairs

    def columns(self) -> dict[str, np.ndarray]:
        """Parameters of its kernels, a row a world."""
        eta = np.array([peer.adaptive.eta for peer in self.fluid.peers])
        ones = np.ones(len(eta))
        return {
            "target": self.dimension * np.log(eta),
            "normal": self.fluid.smoothing.sigma * ones,
            "tolerance": TOLERANCE[self.model.precision.name] * ones,
        }

    def attach(self, state: State) -> None:
        """Slots' own arrays, and lengths that fit the start."""
        precision, pairs, device = self.model.precision, self.pairs, self.model.device
        self.state = state
        self.size = pairs.array(precision.vector(2))  # 1/h, sigma/h^d
        self.following, self.found = pairs.array(precision.scalar), pairs.array(wp.int32)
        self.bracket = pairs.array(precision.vector(4))
        self.searching = wp.zeros(1, dtype=wp.int32, device=device)
        bounds = np.stack([self.least, self.most], axis=1)
        self.bounds = self.model.array(bounds, precision.vector(2))
        self.kernels = kernels.length_kernels(precision)

    def over(self, loop: PairLoop, weight: wp.Function, slope: wp.Function) -> None:
        """The loop that they are summed by."""
        self.loop, self.weight = loop, weight
        self.term = kernels.length_term(weight, slope, *loop.types)

    def search(self, state: State, laws: Sequence[Any], slots: wp.array) -> None:
        """Lengths, densities and pressures at the present positions.

        Args:
            laws: Of the pressure, and of the speed of sound or None.
            slots: For what forces read.
        """
        pairs, device = self.pairs, self.model.device
        inputs = [pairs.order, pairs.world, self.bounds, self.support, self.reach.reach,
                  state[LENGTH], self.bracket, self.following, self.found]  # fmt: skip
        launch(self.kernels.begin, pairs.count, inputs, device)
        store = functools.partial(
            kernels.keep_length, self.weight, *laws, self.fluid.hot, self.dimension
        )
        out = {
            "following": self.following, "bracket": self.bracket, "found": self.found,
            "searching": self.searching, "state": slots, "h": state[LENGTH],
            "rho": state.density, "pressure": state.pressure,
        }  # fmt: skip
        self._try(store, out)
        for _ in range(PASSES - 1):
            with when(self.searching):
                self._try(store, out)

    def _try(self, store: Any, out: dict[str, wp.array]) -> None:
        inputs = [self.following, self.fluid.smoothing.sigma, self.dimension, self.size]
        launch(self.kernels.step, self.pairs.count, inputs, self.model.device)
        call(self.searching.zero_)
        self.loop.sum(self.term, store, out)

    # Outside a substep ------------------------------------------------------------------------

    def settle(self, worlds: Sequence[int]) -> None:
        """Lengths that fit the present positions of these worlds, however far they are off."""
        fluid, state, world = self.fluid, self.state, self.model.world_of[self.members]
        nearly, mine = 1 - 1e-4, np.isin(world, list(worlds))
        before = {name: state[name].numpy().copy() for name in FOUND}
        for _ in range(RENEWALS):
            self.pairs.renew(state, list(worlds))
            self.pairs.update(state)
            fluid.sum_density(state)
            h = state[LENGTH].numpy()[self.members]
            reach = self.reach.reach.numpy()[self.members]
            most = self.support * self.most[world]
            short = (self.support * h > nearly * reach) & (reach < nearly * most)
            if not ((short & mine).any() or self.searching.numpy()[0]):
                break
        others = self.members[~mine]  # are as their last forces left them
        for name, kept in before.items():
            found = state[name].numpy().copy()
            found[others] = kept[others]
            state[name].assign(found)
        self.pairs.renew(state, list(worlds))

    def start(self) -> None:
        """At the start of all worlds."""
        self.settle(range(self.model.world_count))
        self.started = self.state[LENGTH].numpy().copy()

    def reset(self, worlds: Sequence[int]) -> None:
        """These worlds are at their start again."""
        array = self.state[LENGTH]
        rows = self.members[np.isin(self.model.world_of[self.members], list(worlds))]
        host = array.numpy().copy()
        host[rows] = self.started[rows]
        array.assign(host)
        self.pairs.renew(self.state, list(worlds))

    def widest(self, slots: slice) -> float:
        """How far the particle among these slots reaches that reaches farthest [length]."""
        return float(self.support * 1.001 * self.following.numpy()[slots].max())

    def at_bound(self) -> np.ndarray:
        """Whether each member has the largest length that there is."""
        world = self.model.world_of[self.members]
        return self.state[LENGTH].numpy()[self.members] >= (1 - 1e-6) * self.most[world]
