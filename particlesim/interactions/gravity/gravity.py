"""Gravity between all pairs of particles, by a tree, or in a periodic box."""

from __future__ import annotations

from typing import Any

import warp as wp

from ... import validate
from ...engine.limit import Limit
from ...engine.model import Model
from ...engine.neighbors.lists import Neighbors
from ...engine.probe import Probe
from ...engine.state import State
from ...scene.law import law
from ..electrostatics.images import METHODS
from ..pair import Pair
from .limits import closest_approach, closest_passage, orbits
from .periodic import Periodic
from .tree import Tree


@law
def gravity_potential(r: float, mass_i: float, mass_j: float, constant: float, softening: float):
    return -(constant * mass_i) * (mass_j / wp.sqrt(r * r + softening * softening))


@law
def gravity_force(r: float, mass_i: float, mass_j: float, constant: float, softening: float):
    # In an order that stays in single precision's range wherever the force does.
    d2 = r * r + softening * softening
    return -(constant * mass_i) * (mass_j / d2) * (r / wp.sqrt(d2))


@law
def own_potential(
    r: float, mass_i: float, mass_j: float, softening_i: float, softening_j: float, constant: float
):
    s2 = 0.5 * (softening_i * softening_i + softening_j * softening_j)
    return -(constant * mass_i) * (mass_j / wp.sqrt(r * r + s2))


@law
def own_force(
    r: float, mass_i: float, mass_j: float, softening_i: float, softening_j: float, constant: float
):
    d2 = r * r + 0.5 * (softening_i * softening_i + softening_j * softening_j)
    return -(constant * mass_i) * (mass_j / d2) * (r / wp.sqrt(d2))


class Gravity(Pair):
    """Newton's gravity between the particles of a world, u = -G m_i m_j / sqrt(r^2 + s^2).

    Softened after Plummer (1911); of particles with softenings of their own a pair has
    s^2 = (s_i^2 + s_j^2) / 2, smooth in both, which a tree can take the mean of (Saitoh and Makino
    2012, with s / sqrt(2) for their epsilon).

    Summed over all pairs, which costs the square of the number of particles; or, where
    ``Settings(opening_angle=...)`` is set, by a tree with quadrupoles, at N log N. Forces on a
    Plummer sphere of 100 000 are then off by 5e-4 at an angle of 0.5, a good choice, by 1e-4 at 0.3
    and 2.4e-5 at 0.2 (root mean square, relative), and by rounding alone at 0. They sum to zero
    within that error, not exactly. Coincident particles do not pull each other there.

    In a periodic box all images attract, by ``method="ewald"`` or ``"particle_mesh_ewald"`` (see
    :class:`Electrostatics`, of which masses are the charges and -G the constant; softened as
    erfc(a R) / R nearby, R^2 = r^2 + s^2, and by waves of the rest). A uniform background that
    repels takes away the mean density, without which there would be neither a force nor an energy
    (Jeans' swindle): a homogeneous box is at rest, and what is denser than its mean collapses. It
    is for bodies that are resolved; of a smooth density a :class:`PoissonField` is cheaper.

    Args:
        group: Which particles attract each other; None: all.
        G: [length^3 / (mass time^2)].
        softening: s [length], at least 0; None: each particle's own, its attribute ``softening``,
            which is not for periodic boxes.
        method: One of these two, in a periodic box; None: in open space.
        cutoff: Of near pairs of a method [length]; None: what costs least.
        tolerance: What each part of a method may leave out, in parts.

    Raises:
        ValueError: When a simulation is made, of a periodic box without a method or the reverse.
        ImportError: ``"ewald"`` without the library.

    Example:
        >>> from particlesim import Scene, Settings, Simulation
        >>> scene = Scene()
        >>> stars = scene.add_particles([(0, 0, 0), (2, 0, 0)], mass=4.0)
        >>> gravity = scene.add_interaction(Gravity(G=1.0))
        >>> sim = Simulation(scene, Settings(opening_angle=0.5), device="cpu")
        >>> sim.get("force").tolist()
        [[4.0, 0.0, 0.0], [-4.0, 0.0, 0.0]]
    """

    def __init__(
        self, group: Any = None, G: float = 1.0, softening: float | None = 0.0,
        method: str | None = None, cutoff: float | None = None, tolerance: float = 1e-6,
    ):  # fmt: skip
        values = {"constant": validate.number(self.name, "G", G)}
        self.own_softening = softening is None
        if softening is not None:
            values["softening"] = validate.number(
                self.name, "softening", softening, minimum=0.0, unit="length"
            )
        laws = (own_potential, own_force) if softening is None else (
            gravity_potential, gravity_force
        )  # fmt: skip
        super().__init__(*laws, group, None, values)
        self.method, self.near_cutoff = method, cutoff
        self.tolerance = validate.number(self.name, "tolerance", tolerance, above=0.0, maximum=0.1)
        if method is None and cutoff is not None:
            raise validate.fail(
                self.name, "cutoff", "be left out without a method", cutoff,
                "gravity has no end in open space",
            )  # fmt: skip
        if method is not None:
            validate.choice(self.name, "method", method, METHODS)
            if softening is None:
                raise validate.fail(
                    self.name, "softening", f"be one length for all with method={method!r}", None,
                    "give one",
                )  # fmt: skip
        if cutoff is not None:
            validate.number(self.name, "cutoff", cutoff, above=0.0, unit="length")

    def kind(self) -> tuple[Any, ...]:
        return (*super().kind(), self.method)

    def prepare(self, model: Model, neighbors: Neighbors) -> None:
        if model.periodic and self.method is None:
            raise validate.fail(
                self.name, "periodic", "be None, as every image would attract",
                list(model.periodic), "leave the scene's axes open, or choose a method",
            )  # fmt: skip
        self.sums: Tree | Periodic | None = None
        self.listed = self.method is None and model.settings.opening_angle is None
        if self.listed:
            super().prepare(model, neighbors)
            self.members = self.pairs.members_host
            return
        self.model = model
        for each in self.arguments:
            each.check(model.attributes)
        self.members = model.members([peer.group for peer in self.peers], self.name)
        columns = self.columns(self.parameters)
        model.fits(self.name, columns)
        if self.method is None:
            self.sums = Tree(model, self.name, self.members, columns)
        else:
            self.sums = Periodic(self, model, neighbors)

    def attach(self, model: Model, state: State) -> None:
        if self.sums is None:
            super().attach(model, state)
        else:
            self.sums.attach(model, state)

    def complaint(self) -> str:
        """That places are too coarse for how far particles are apart."""
        return super().complaint() if self.sums is None else self.sums.complaint()

    def apply(self, state: State, neighbors: Neighbors, dt: float) -> None:
        if self.sums is None:
            super().apply(state, neighbors, dt)
        else:
            self.sums.pull(state)

    def measure(self, state: State, energy: wp.array, virial: wp.array) -> None:
        if self.sums is None:
            super().measure(state, energy, virial)
        else:
            self.sums.measure(state, energy, virial)

    def limits(self, probe: Probe) -> list[Limit]:
        """By the tide now, or orbits in the tree, by orbits' pericentres, and by passages at the
        softening length.
        """
        limits = orbits(self, probe) if isinstance(self.sums, Tree) else probe.response(self)
        return limits + closest_passage(self, probe) + closest_approach(self, probe)
