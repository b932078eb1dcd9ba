"""Coulomb forces between the charges of a scene."""

from __future__ import annotations

from typing import Any

import numpy as np
import warp as wp

from ... import validate
from ...engine.limit import Limit
from ...engine.model import Model
from ...engine.neighbors.lists import Neighbors
from ...engine.probe import Probe
from ...engine.state import State
from ...scene.law import law
from ...scene.part import Interaction
from ..bonded.bonds import Bonds
from ..pair_limits import collisions
from ..potentials.coulomb import Coulomb
from .images import METHODS as IMAGES
from .images import Asked, Images

METHODS = ("all_pairs", "damped_shifted_force", *IMAGES)


@law
def _smooth(r: float, charge_i: float, charge_j: float, constant: float, damping: float):
    """What the smooth part has of a pair."""
    return -(constant * charge_i) * charge_j * wp.erf(damping * r) / r


class Electrostatics(Interaction):
    """u = k q_i q_j / r between the particles' attributes ``charge``, by a method of choice.

    ``"all_pairs"`` looks at all pairs of a world, in open space. ``"damped_shifted_force"`` ends
    the force at a cutoff (Fennell and Gezelter 2006): see :class:`Coulomb`. Two sum over all
    periodic images (Ewald 1921), near pairs by erfc(a r) / r up to a cutoff, and waves q:

        U = k sum_(i<j) q_i q_j erfc(a r) / r
            + 2 pi k / V sum_(q != 0) exp(-q^2 / 4 a^2) / q^2 |S(q)|^2 - k a / sqrt(pi) sum_i q_i^2

    of images that a conductor surrounds. Charges that do not add up to 0 are neutralised by a
    uniform background. ``"ewald"`` takes the waves one by one, by the kernels of
    ``nvalchemi-toolkit-ops`` (extra ``electrostatics``), at N^(3/2) and 16 bytes a wave and
    particle: for some hundred charges. Its forces sum to zero.

    ``"particle_mesh_ewald"`` takes them by a mesh, at N log N: charges are put on it by B-splines
    (Essmann et al. 1995), its influence function is the best for forces that are slopes of the
    splines, and what a charge has with itself between the nodes is taken out (Ballenegger, Cerda
    and Holm 2012). Spacing and order follow from the tolerance by the error that such a mesh
    leaves (Hockney and Eastwood 1988). Forces keep the energy, and sum to zero within the
    tolerance. The transform is NumPy's on the host, in double precision, of a CUDA device's mesh
    too.

    Args:
        method: One of these four.
        group: Which particles' charges; None: all.
        constant: k [energy length / charge^2].
        cutoff: Of near pairs [length], for all but the first; of the last two None: what costs
            least, within half the box.
        damping: a [1/length], of ``"damped_shifted_force"``.
        tolerance: Of the last two: what each part may leave out, in parts of q^2 / d^2, about the
            force of neighbours.
        exclude: Pairs that do not feel each other, as of ``Pair``; their images do.

    Raises:
        ValueError: An open axis with the last two, a cutoff where none is taken or the reverse.
        ImportError: ``"ewald"`` without the library.

    Example:
        >>> Electrostatics("damped_shifted_force", cutoff=6.0, damping=0.3).cutoff
        6.0
    """

    conservative = True

    def __init__(
        self,
        method: str = "all_pairs",
        group: Any = None,
        constant: float = 1.0,
        cutoff: float | None = None,
        damping: float = 0.0,
        tolerance: float = 1e-6,
        exclude: Any = None,
    ):
        self.method = validate.choice(self.name, "method", method, METHODS)
        self.group, self.constant = group, validate.number(self.name, "constant", constant)
        self.tolerance = validate.number(self.name, "tolerance", tolerance, above=0.0, maximum=0.1)
        if (method == "all_pairs") != (cutoff is None) and method not in IMAGES:
            what = "be left out" if method == "all_pairs" else "be given [length]"
            raise validate.fail(
                self.name, "cutoff", f"{what} with method={method!r}", cutoff, "choose another"
            )
        if damping and method != "damped_shifted_force":
            raise validate.fail(
                self.name, "damping", f"be left out with method={method!r}", damping,
                "it is for 'damped_shifted_force'",
            )  # fmt: skip
        self.requires = frozenset({"force", "charge"})
        self.cutoff, self.exclude = cutoff, exclude
        self.pairs = Coulomb(group, constant, cutoff, damping, exclude=exclude)

    def kind(self) -> tuple[Any, ...]:
        return (type(self), self.method, *self.pairs.kind())

    def prepare(self, model: Model, neighbors: Neighbors) -> None:
        self.model = model
        self.images = self._images(model) if self.method in IMAGES else None
        pairs = [peer.pairs for peer in self.peers]
        if self.images:
            pairs = self._split(self.images)
        self.near = pairs[0].bind(pairs)
        self.near.prepare(model, neighbors)
        if self.images:
            self.left_out.prepare(model, neighbors)

    def _images(self, model: Model) -> Images:
        asked = [Asked(p.group, p.constant, p.tolerance, p.cutoff) for p in self.peers]
        return Images(self.name, model, self.method, "charge", asked)

    def _split(self, images: Images) -> list[Coulomb]:
        """Near pairs of every world; and what those that are excluded have in the smooth part."""
        pairs, left_out = [], []
        for peer, found in zip(self.peers, images.splittings, strict=True):
            given = peer.group, peer.constant, found.cutoff, found.damping
            pairs.append(Coulomb(*given, truncation="cut", exclude=peer.exclude))
            law_of = {"constant": peer.constant, "damping": found.damping}
            left_out.append(Bonds(pairs[-1].chosen.excluded(), _smooth, **law_of))
        self.left_out = left_out[0].bind(left_out)
        return pairs

    def attach(self, model: Model, state: State) -> None:
        self.near.attach(model, state)
        if self.images:
            self.left_out.attach(model, state)

    def apply(self, state: State, neighbors: Neighbors, dt: float) -> None:
        self.near.apply(state, neighbors, dt)
        if self.images:
            self.images.apply(state)
            self.left_out.apply(state, neighbors, dt)

    def limits(self, probe: Probe) -> list[Limit]:
        """By the gradient at the present distances and, within a cutoff, at those to come."""
        near = [] if self.near.cutoff is None else collisions(self.near, probe)
        return probe.response(self) + near

    def complaint(self) -> str:
        """That charges of a periodic box are not neutral; what pairs have to say."""
        if self.images:
            member = self.images.member.numpy() > 0
            for w in range(self.model.world_count):
                rows = self.model.rows(w)
                q = self.model.column("charge")[rows] * member[rows]
                if abs(q.sum()) > 1e-6 * np.abs(q).sum():
                    return (
                        f"{self.name}: charges must add up to 0 in a periodic box, got "
                        f"{q.sum():.4g} in world {w}, which a uniform background neutralises; add "
                        "what is missing."
                    )
        return self.near.complaint()

    def measure(self, state: State, energy: wp.array, virial: wp.array) -> None:
        if not self.images:
            self.near.measure(state, energy, virial)
            return
        own = wp.zeros_like(energy), wp.zeros_like(virial)
        for part in (self.near, self.left_out):
            part.measure(state, *own)
        self.images.measure(state, own, energy, virial)
