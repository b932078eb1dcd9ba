"""The passes of a fluid over its neighbours: density, then forces."""

from __future__ import annotations

import functools
from typing import Any, cast

import numpy as np
import warp as wp

from ...engine.limit import Limit
from ...engine.model import Model
from ...engine.neighbors.lists import Neighbors
from ...engine.neighbors.verlet import VerletList
from ...engine.probe import Probe
from ...engine.state import State
from ...kernels.interactions.fluid import continuity as of_continuity
from ...kernels.interactions.fluid import heat as of_heat
from ...kernels.interactions.fluid import images
from ...kernels.interactions.fluid import lengths as of_lengths
from ...kernels.interactions.fluid import sph as kernels
from ...kernels.interactions.fluid.laws import bound_law
from ..pair_loop import PairLoop
from .density.continuity import Continuity
from .evolving import Evolving
from .heat import ENERGY, Heat, check_energies
from .lattice import lattice_sums, spacings
from .lengths import LENGTH, Lengths
from .limits import fluid_limits
from .starts import complaint
from .viscous_passes import Drift, Switch
from .walls import Pass, Walls

COINCIDENT = 1e-6  # closer than this, in parts of h, particles count as coincident


class Passes(Evolving):
    """The engine's side of :class:`~particlesim.SPH`, which describes a fluid."""

    sources: dict[str, dict[str, str]]

    @property
    def moving(self) -> bool:
        """How fast a pair approaches counts."""
        return bool(self.viscosity)

    def variables(self, name: str) -> tuple[str, ...]:
        """What a law is called with."""
        raise NotImplementedError

    def prepare(self, model: Model, neighbors: Neighbors) -> None:
        self.model = model
        columns = self.columns(self.parameters)
        read = {"velocity": self.moving or self.density is not None or self.hot, ENERGY: self.hot}
        names = {"mass"} | {name for name, on in read.items() if on}
        if self.adaptive is None:
            self.pairs = cast(VerletList, neighbors.of(self, names))  # as there is a cutoff
            least = most = columns[LENGTH]
        else:
            self.lengths = Lengths(self, model)
            self.pairs = self.lengths.request(neighbors, names)
            columns |= self.lengths.columns()
            least, most = self.lengths.least, self.lengths.most
        if self.density is not None:
            self.continuity = Continuity(self, model)
        if self.hot:
            check_energies(self.name, model, self.pairs.members_host)
        self.walls = Walls(self, model)
        self.requires = self.requires | self.walls.requires
        columns |= {"cutoff_squared": (self.smoothing.support * most) ** 2}
        columns |= {"closest_squared": (COINCIDENT * least) ** 2}
        for h in (least, most):
            self.check_range(h, columns["closest_squared"])
        self.spacings = spacings(self, model)
        if self.lengths is None:
            columns["inverse_h"] = 1.0 / most
            columns["sigma"] = self.smoothing.sigma / most**self.dimension
            if self.fluids.densities and self.density is None:
                sums = lattice_sums(self, model, most)
                columns |= {
                    name: sums * columns[name] for name in self.fluids.fields["rest_density"]
                }
        if self.fluids.several:
            columns["share"] = np.full(model.world_count, 1.0 / model.mass_unit)
            self.fluids.hold(model, self.pairs, self.fluid_numbers())
        model.fits(self.name, {name: columns[name] for name in self.parameters})
        self.Params, self.params = model.parameters("FluidParameters", columns)

    def attach(self, model: Model, state: State) -> None:
        precision, held = model.precision, self.pairs.fields
        # Mass, density, P / rho^2 and sound speed of each slot, together as they are read together.
        self.slot_state = self.pairs.array(precision.vector(4))
        fields = {"x": held["position"], "state": self.slot_state, **self.fluids.read(held["mass"])}
        if self.moving or self.continuity is not None or self.hot:
            fields["v"] = held["velocity"]
        if self.continuity is not None:
            fields |= self.continuity.attach(state)
        if self.hot:
            fields["u"] = held[ENERGY]
        if self.lengths is not None:
            self.lengths.attach(state)
            fields["size"] = self.lengths.size
        self.switch = Switch(self) if any(each.switched for each in self.viscosity) else None
        if self.switch:
            fields["balsara"] = self.switch.values
        drifts = (Drift(self, state, each) for each in self.viscosity if each.drifts)
        self.drift = next(drifts, None)
        self.fields, self.state = fields, state
        self.loop = PairLoop.over(model, self.pairs, "Fluid", fields, self.Params, self.params)
        self.laws = self._laws()
        self.weight = self.smoothing.weight.function(precision)
        self.slope = self.smoothing.slope.function(precision)
        self._make_terms()
        if self.walls:
            self.walls.attach(state, fields)
        if self.hot:
            self.heat = Heat(self, state, self.heat_term)

    def _make_terms(self) -> None:
        self._types = types = self.loop.types
        if self.lengths is not None:
            viscous = self.slope, self.laws.get("term"), self.dimension
            self.heat_term = functools.partial(of_lengths.heat_term, *viscous)
            self.force_term = of_lengths.force_term(*viscous, *types)
        else:
            given = self.slope, self.laws, self.switch is not None, self.dimension
            self.heat_term = functools.partial(of_heat.heat_term, *given)
            self.density_term = kernels.density_term(self.weight, *types)
            if self.continuity is not None:
                self.continuity.over(self.loop, self.slope, self.laws)
            pull, dragged = self.pull(*types), self.dragged(*types)
            self.force_term = kernels.force_term(pull, dragged, self.moving, self.dimension, *types)
        if self.lengths is not None:
            self.lengths.over(self.loop, self.weight, self.slope)
            self.lengths.start()

    def pull(self, *types: Any) -> wp.Function:
        """How strongly a pair pulls, for precision, data and parameters of these types."""
        term, switched = self.laws.get("term"), self.switch is not None
        return kernels.pull_function(self.slope, term, switched, self.fluids.several, *types)

    def dragged(self, *types: Any) -> wp.Function | None:
        """How strongly a pair drags; None: it does not."""
        if "drag" not in self.laws:
            return None
        return kernels.drag_function(self.slope, self.laws["drag"], self.fluids.several, *types)

    def beside_walls(self, seen: Any, *types: Any) -> tuple[Any, wp.Function]:
        """The term of densities over a pair and its images, and that of a particle's own."""
        if self.continuity is not None:
            return self.continuity.beside_walls(seen, *types)
        term = images.density_term(self.weight, seen, *types)
        return term, images.own_weight(self.weight, seen, *types)

    def _laws(self) -> dict[str, wp.Function]:
        """The parts' laws as functions of their variables and the fluid's parameters."""
        precision = self.model.precision
        return {
            name: bound_law(
                name, law.function(precision, part.name, float), self.variables(name),
                self.sources[name], precision, self.Params,
            )
            for part in (self.equation_of_state, *self.viscosity)
            for name, law in part.laws.items()
        }  # fmt: skip

    def apply(self, state: State, neighbors: Neighbors, dt: float) -> None:
        self.sum_density(state)
        self.sum_force(state)
        if self.drift:
            self.drift.sum()

    def sum_force(self, state: State) -> None:
        """The forces of pairs, at the densities summed last."""
        out = {"f": state.force}
        self.walls.sum_force(Pass(self.loop, self.force_term, kernels.add_force, out))

    def advance(self, state: State, dt: float) -> None:
        super().advance(state, dt)
        if self.drift:
            self.drift.move(dt)

    def sum_density(self, state: State, sounds: bool = False) -> None:
        """Density, pressure and their slots; speeds of sound for a viscosity, or if asked for."""
        sounds = sounds or bool(self.viscosity)
        laws = self.laws["pressure"], self.laws["sound_speed"] if sounds else None
        if self.lengths is not None:
            self.lengths.search(state, laws, self.slot_state)
            return
        out = {"state": self.slot_state, "rho": state.density, "pressure": state.pressure}
        if self.continuity is not None:
            self.continuity.look()
            out["excess"] = self.continuity.found
            term, own = self.continuity.term, of_continuity.no_rate(*self._types)
            keep = functools.partial(of_continuity.keep_density, *laws)
        else:
            term, own = self.density_term, kernels.own_weight(self.weight, *self._types)
            keep = functools.partial(kernels.keep_state, *laws, self.hot, self.fluids.several)
        self.walls.sum_density(Pass(self.loop, term, functools.partial(keep, own), out), keep)
        if self.switch:
            self.switch.sum()

    def limits(self, probe: Probe) -> list[Limit]:
        """By sound with viscosity, and by acceleration."""
        return fluid_limits(self, probe)

    def complaint(self) -> str:
        """That masses, the smoothing length or the speed of sound do not fit the start."""
        return complaint(self)

    def sound_speeds(self, probe: Probe) -> np.ndarray:
        """Speed of sound at the present densities, of each member [length/time]."""
        probe.force([self])
        if not self.viscosity:  # whose passes have no need of it
            self.sum_density(probe.state, sounds=True)
        c = np.empty(self.pairs.count)
        members = self.pairs.members_host
        c[np.searchsorted(members, self.pairs.order.numpy())] = self.slot_state.numpy()[:, 3]
        return c

    def update_density(self) -> None:
        """Density, pressure and their slots at the present positions; not within a substep."""
        self.pairs.update(self.state)
        self.pairs.grow()
        self.look_at_density(self.state)

    def measure(self, state: State, energy: wp.array, virial: wp.array) -> None:
        """Add the energy m u at the present positions, and the virial of all pair forces."""
        self.look_at_density(state)
        precision, energy_law = self.model.precision, self.laws["energy"]
        term = kernels.virial_term(self.force_term, precision, self.loop.Data, self.Params)
        own = self.lengths is not None
        kept = energy_law, self.hot, own, self.fluids.several
        store = functools.partial(kernels.keep_measure, *kept)
        self.loop.sum(term, store, {"energy": energy, "virial": virial})
