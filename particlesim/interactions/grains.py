"""Grains as elastic spheres that dissipate and rub: the discrete element method."""

from __future__ import annotations

from typing import Any

import numpy as np
import warp as wp

from .. import validate
from ..engine.limit import Limit
from ..engine.model import Model
from ..engine.neighbors.lists import Neighbors
from ..engine.probe import Probe
from ..engine.state import State
from ..scene.group import select
from ..scene.law import law
from ..scene.part import Interaction
from .pair_sum import PairSum

STEPS = 20.0  # in a collision: it then gains less than a thousandth of its energy


@law
def _overlap(r: float, radius_i: float, radius_j: float):
    return wp.max(radius_i + radius_j - r, 0.0)


@law
def _steepness(overlap: float, radius_i: float, radius_j: float, stiffness: float):
    both = radius_i + radius_j  # of points, which have no contact, 0
    return stiffness * wp.sqrt(radius_i * radius_j / wp.where(both > 0.0, both, 1.0) * overlap)


@law
def _normal(k: float, overlap: float, closing: float, dissipation: float):
    return wp.max(k * (overlap + 1.5 * dissipation * closing), 0.0)


@law
def grain_force(
    r: float, x_ij: wp.vec3, radius_i: float, radius_j: float, velocity_i: wp.vec3,
    velocity_j: wp.vec3, stiffness: float, dissipation: float, sliding: float, friction: float,
) -> wp.vec3:  # fmt: skip
    overlap = _overlap(r, radius_i, radius_j)
    k = _steepness(overlap, radius_i, radius_j, stiffness)
    relative, inverse = velocity_i - velocity_j, 1.0 / r
    closing = -wp.dot(relative, x_ij) * inverse
    normal = _normal(k, overlap, closing, dissipation)
    along = relative + x_ij * (closing * inverse)
    square = wp.dot(along, along)
    slides = square > 0.0
    most = friction * normal / wp.sqrt(wp.where(slides, square, 1.0))
    rubbing = wp.where(slides, wp.min(sliding * k, most), 0.0)
    return x_ij * (normal * inverse) - along * rubbing


@law
def grain_energy(r: float, radius_i: float, radius_j: float, stiffness: float):
    overlap = _overlap(r, radius_i, radius_j)
    return 0.2 * _steepness(overlap, radius_i, radius_j, stiffness) * overlap * overlap


@law
def grain_virial(
    r: float, x_ij: wp.vec3, radius_i: float, radius_j: float, velocity_i: wp.vec3,
    velocity_j: wp.vec3, stiffness: float, dissipation: float,
):  # fmt: skip
    overlap = _overlap(r, radius_i, radius_j)
    k = _steepness(overlap, radius_i, radius_j, stiffness)
    closing = -wp.dot(velocity_i - velocity_j, x_ij) / r
    return 0.5 * r * _normal(k, overlap, closing, dissipation)


class _Touching(Interaction):
    """Grains of one world, which look for each other as far as the two largest reach."""

    def __init__(self, group: Any, cutoff: float, parameters: dict[str, Any]):
        self.group, self.cutoff, self.parameters = group, cutoff, parameters


class HertzianGrains(Interaction):
    r"""Elastic spheres of the particles' radii (Hertz 1882), which dissipate and rub.

    With the overlap d = R_i + R_j - r, R = R_i R_j / (R_i + R_j) and k = 2/3 Y / (1 - nu^2),

        f_n = k sqrt(R d) (d + 3/2 A dd/dt), at least 0 (Brilliantov et al. 1996)
        f_t = -min(gamma k sqrt(R d) |v_t|, mu f_n) v_t / |v_t| (Haff and Werner 1986)

    on i along the pair and against the sliding v_t. Grains do not turn, and stick to no place:
    friction drags, and holds no slope. For heaps that stand see :class:`Contact`, which takes much
    larger steps, too.

    Args:
        group: Which particles; None: all. Their radii are those of the start.
        modulus: Y, Young's modulus [pressure], above 0.
        ratio: nu, Poisson's ratio, -1 to 0.5.
        dissipation: A [time], at least 0.
        friction: mu, at least 0.
        sliding: gamma [time], at least 0: how long a slow slide lasts, by the normal stiffness.

    Example:
        >>> grains = HertzianGrains(modulus=1e6, ratio=0.3, dissipation=1e-4)
        >>> round(grains.parameters["stiffness"])
        732601
    """

    def __init__(
        self, group: Any = None, *, modulus: float, ratio: float = 0.3, dissipation: float = 0.0,
        friction: float = 0.0, sliding: float = 0.0,
    ):  # fmt: skip
        name = self.name
        modulus = validate.number(name, "modulus", modulus, above=0.0, unit="pressure")
        ratio = validate.number(name, "ratio", ratio, above=-1.0, maximum=0.5)
        self.group = group
        self.parameters = {
            "stiffness": 2.0 / 3.0 * modulus / (1.0 - ratio**2),
            "dissipation": validate.number(name, "dissipation", dissipation, minimum=0.0),
            "sliding": validate.number(name, "sliding", sliding, minimum=0.0),
            "friction": validate.number(name, "friction", friction, minimum=0.0),
        }

    @property
    def conservative(self) -> bool:  # type: ignore[override]
        """Whether nothing dissipates, in any world."""
        lossy = ("dissipation", "friction")
        peers = getattr(self, "peers", [self])
        return not any(peer.parameters[name] for peer in peers for name in lossy)

    def prepare(self, model: Model, neighbors: Neighbors) -> None:
        self.model, self.members, parts = model, list[np.ndarray](), []
        for w, peer in enumerate(self.peers):
            rows = select(model.scenes[w], peer.group, self.name) + model.offsets[w]
            largest = float(model.column("radius")[rows].max(initial=0.0))
            self.members.append(rows)
            parts.append(_Touching(peer.group, 2.0 * largest, peer.parameters))
        self.touching = parts[0].bind(parts)
        sums = (grain_force, grain_energy, grain_virial)
        made = [PairSum(self.touching, model, neighbors, each) for each in sums]
        self.force, self.energy, self.virial = made
        self.requires = self.touching.requires
        self.reads_velocity = True

    def apply(self, state: State, neighbors: Neighbors, dt: float) -> None:
        self.force.add_to(state.force)

    def measure(self, state: State, energy: wp.array, virial: wp.array) -> None:
        self.energy.add_to(energy)
        self.virial.add_to(virial)

    def limits(self, probe: Probe) -> list[Limit]:
        """By the gradient at present, and by how short the hardest collision is.

        Of Hertz's law F = K d^(3/2) it lasts 2.94 d_max / v, d_max = (5 m v^2 / 4 K)^(2/5), with
        the masses of both, 1 / m = 1 / m_i + 1 / m_j (Landau and Lifshitz, Elasticity, 9).
        """
        found = probe.response(self)
        for w, rows in enumerate(self.members):
            free = rows[probe.inverse_mass[rows] > 0]
            if len(free) < 2:
                continue
            speed = float(2.0 * np.max(probe.relative_speed(free)))
            k = float(self.peers[w].parameters["stiffness"])
            radius, mass = self.model.column("radius")[free], 0.5 / probe.inverse_mass[free]
            K = k * np.sqrt(0.5 * radius)
            touching = (radius > 0) & (speed > 0)
            if not touching.any():
                continue
            deepest = (1.25 * mass * speed**2 / np.where(touching, K, 1.0)) ** 0.4
            lasts = np.where(touching, 2.9432 * deepest / max(speed, 1e-300), np.inf)
            at = int(np.argmin(lasts))
            reason = f"a {STEPS:g}th of a collision at {speed:.4g}, which lasts {lasts[at]:.4g}"
            place = probe.place(int(free[at]))
            found.append(Limit(self.name, "collision", float(lasts[at]) / STEPS, reason, *place))
        return found
