"""Surface tension between fluids."""

from __future__ import annotations

import functools
import math
from typing import Any

import numpy as np
import warp as wp

from .... import validate
from ....engine.limit import Limit
from ....engine.model import Model
from ....engine.neighbors.lists import Neighbors
from ....engine.probe import Probe
from ....engine.state import State
from ....kernels.interactions.fluid import tension as kernels
from ....kernels.interactions.pair import add_force, store_energy
from ....scene.part import Interaction
from ...pair_loop import PairLoop, squared_distances
from ..lengths import LENGTH
from ..sph import SPH
from .fluids import FLUID


class SurfaceTension(Interaction):
    r"""The surface between fluids pulls along itself, by sigma a length (sigma an area: energy).

        f_i = sum_j (T_i/n_i^2 + T_j/n_j^2) grad_i W_ij,    T = sigma (|g| - g g / |g|)

    is the divergence of the stress of a surface that is smoothed by W: g is the slope of a colour
    that is 1 in one fluid and 0 in the others, whose size integrates to 1 across the surface
    (Lafaurie et al. 1994; Hu and Adams 2006, here without their isotropic part). It needs no
    curvature and knows no densities, only numbers n: a ratio of 1000 is as good as 1. The momentum
    is conserved to round-off. The force is no gradient: that of sigma times the area as particles
    count it would have them part along the surface. Diagnostics count this energy.

    Pulled along the surface by more than it is pressed, fluid would clump there: the pressure must
    stay well above 0.7 sigma / h, everywhere around. Depth sees to that; in a closed or periodic
    box rest densities that are some per cent below those of the start. For the same reason a free
    surface has no tension: put a light fluid around the drop.

    A surface is some 2 h thick. Measured at h = 2 spacings on drops that are 10 and 20 spacings in
    radius: the pressure in them is sigma / R (in the plane) within 2 and 1 %, and they swing 7 and
    2 % too slowly. A film thinner than 4 h is pulled too little. Walls are not seen: next to
    one there is no angle of contact that could be given.

    The step is bounded by capillary waves, dt < sqrt(rho h^3 / (2 pi sigma)) with rho the lightest
    fluid's (Brackbill, Kothe and Zemach 1992, where it is the mean of both).

    Args:
        fluid: An ``SPH`` of several fluids, with one smoothing length, in 2 or 3 dimensions. Its
            list of neighbours is used.
        coefficient: sigma [force/length], in two dimensions [force], at least 0; between any two.

    Raises:
        TypeError: Something is no ``SPH``. ValueError: It is one fluid, or a negative coefficient.

    Example:
        >>> from particlesim import Tait
        >>> fluids = SPH(["oil", "water"], smoothing_length=2e-3, rest_density=[900, 1000],
        ...              equation_of_state=Tait(sound_speed=10.0))
        >>> SurfaceTension(fluids, coefficient=0.05).parameters
        {'coefficient': 0.05}
    """

    requires = frozenset({"force"})
    reads_velocity = False

    def __init__(self, fluid: SPH, coefficient: float):
        if not isinstance(fluid, SPH):
            raise TypeError(
                f"{self.name}: fluid must be an SPH, got {fluid!r}; give what add_interaction gave."
            )
        several, dense = fluid.fluids.several, fluid.fluids.densities is not None
        if not (several and dense and fluid.dimension > 1):
            raise validate.fail(
                self.name, "fluid", "be of several fluids with rest_density, in 2 or 3 dimensions",
                f"{len(fluid.fluids.groups)} in {fluid.dimension}", "put a light one around it",
            )  # fmt: skip
        self.fluid, self.group, self.cutoff = fluid, fluid.group, fluid.cutoff
        self.parameters = {
            "coefficient": validate.number(
                self.name, "coefficient", coefficient, minimum=0.0, unit="force/length"
            )
        }

    def kind(self) -> tuple[Any, ...]:
        return (type(self), self.fluid.smoothing.kind, self.fluid.dimension)

    def prepare(self, model: Model, neighbors: Neighbors) -> None:
        self.model, self.pairs = model, neighbors.of(self)
        each = zip(self.peers, model.scenes, strict=True)
        number = np.concatenate([peer.fluid.fluids.numbers(scene) for peer, scene in each])
        self.number = self.pairs.hold(model.array(number, model.precision.scalar))
        smoothing, d = self.fluid.smoothing, self.fluid.dimension
        h = np.array([peer.fluid.parameters[LENGTH] for peer in self.peers])
        sigma = self.columns(self.parameters)["coefficient"]
        columns = {
            "strength": sigma * h ** (d - 3),
            "normal": np.full(len(h), smoothing.sigma),
            "inverse_h": 1.0 / h,
        }
        model.fits(self.name, columns)
        columns |= squared_distances(self.name, model, smoothing.support * h)
        self.Params, self.params = model.parameters("TensionParameters", columns)

    def attach(self, model: Model, state: State) -> None:
        precision, smoothing = model.precision, self.fluid.smoothing
        self.state, self.stress = state, self.pairs.array(precision.vector(4))
        fields = {"x": self.pairs.fields["position"], FLUID: self.number, "stress": self.stress}
        self.loop = PairLoop.over(model, self.pairs, "Tension", fields, self.Params, self.params)
        self.weight = smoothing.weight.function(precision)
        slope, types = smoothing.slope.function(precision), (precision, self.loop.Data, self.Params)
        self.slope = kernels.slope_term(self.weight, slope, *types)
        self.force = kernels.force_term(slope, *types)

    def _stress(self) -> None:
        """At the present positions."""
        store = functools.partial(kernels.keep_stress, self.weight)
        self.loop.sum(self.slope, store, {"stress": self.stress})

    def apply(self, state: State, neighbors: Neighbors, dt: float) -> None:
        self._stress()
        self.loop.sum(self.force, add_force, {"f": state.force})

    def measure(self, state: State, energy: wp.array, virial: wp.array) -> None:
        self._stress()
        store = functools.partial(kernels.keep_energy, self.weight)
        self.loop.sum(self.slope, store, {"energy": energy})
        types = self.model.precision, self.loop.Data, self.Params
        self.loop.sum(kernels.virial_term(self.force, *types), store_energy, {"energy": virial})

    def limits(self, probe: Probe) -> list[Limit]:
        """By capillary waves, in the world where they are fastest."""
        found = []
        for w, peer in enumerate(self.peers):
            sigma, h = peer.parameters["coefficient"], peer.fluid.parameters[LENGTH]
            rho = min(peer.fluid.fluids.densities)
            if sigma > 0:
                dt = math.sqrt(rho * h**3 / (2.0 * math.pi * sigma))
                reason = f"sqrt(rho h^3 / (2 pi sigma)), rho = {rho:.4g}, h = {h:.4g}"
                found.append(Limit(self.name, "capillary", dt, reason, w))
        return sorted(found, key=lambda limit: limit.dt)[:1]
