"""Elastic solids of tetrahedra."""

from __future__ import annotations

from typing import Any

import numpy as np
import warp as wp

from ... import validate
from ...engine import topology
from ...engine.model import Model
from ...kernels.constraints.kinds.neo_hookean import neo_hookean_evaluation
from ...scene.law import law
from ...scene.part import Part
from ..constraint import Constraint
from .volume import Volume


@law
def _strain(
    x: wp.vec3, y: wp.vec3, z: wp.vec3, w: wp.vec3, b_0: wp.vec3, b_1: wp.vec3, b_2: wp.vec3,
    deviatoric: float, hydrostatic: float,
):  # fmt: skip
    F = wp.outer(y - x, b_0) + wp.outer(z - x, b_1) + wp.outer(w - x, b_2)  # type: ignore[operator]
    J = wp.determinant(F)
    D = wp.sqrt(wp.max(wp.ddot(F, F) + (J - 2.0) * (J - 2.0) - 4.0, 0.0))
    return deviatoric * D + hydrostatic * (J - 1.0)


class NeoHookean(Constraint):
    r"""Tetrahedra of a stable neo-Hookean solid.

    With the deformation gradient F and J = det F an element of rest volume V holds

        V (mu (|F|^2 - 3) / 2 - mu (J - 1) + (lambda + mu) (J - 1)^2 / 2)

    which for small strains is Hooke's law with Young's modulus E and Poisson's ratio nu
    (Smith, de Goes and Kim 2018, with lambda + mu for their lambda, as they say). As Macklin and
    Mueller (2021) do, it is solved as two constraints a tetrahedron, each a square of this energy:

        C_D = sqrt(V (|F|^2 + (J - 2)^2 - 4)),  compliance 1 / mu
        C_H = sqrt(V) (J - 1),                  compliance 1 / lambda

    They share the energy otherwise than theirs, |F| and J - 1 - mu / lambda, which pull against
    each other at rest: here both vanish there, so that rest is at rest at any stiffness and number
    of iterations. An element that is flat or inside out comes back; one that has shrunk to a point
    is in balance there and stays, as the law has it. At nu = 0.5 volumes are kept strictly.

    Linear elements are too stiff in bending where there are few across, and the more so the closer
    nu is to 0.5 (locking): converged, the answer is that of the finite elements of the same mesh.

    ``sim.force`` is (m,): the larger of both parts of each.

    Args:
        tetrahedra: (m, 4) indices, whose positions at the start are the rest state.
        youngs_modulus: E [energy / length^3], one or (m,), above 0.
        poissons_ratio: nu, one or (m,), 0 to 0.5.
        damping: tau, one or (m,), at least 0 [time]: stresses of the rate of strain, tau times as
            large as those of the strain. A volume that is kept strictly has nothing to damp.

    Raises:
        ValueError: Wrong shapes, indices or values; a tetrahedron without a volume at the start.

    Example:
        >>> NeoHookean([(0, 1, 2, 3)], youngs_modulus=1e5, poissons_ratio=0.3).tetrahedra.tolist()
        [[0, 1, 2, 3]]
    """

    relative = True
    carried = True  # where it is at rest its strain has no gradient

    def __init__(
        self, tetrahedra: Any, youngs_modulus: Any, poissons_ratio: Any, *, damping: Any = 0.0
    ):
        self.tetrahedra = topology.tuples(self.name, "tetrahedra", tetrahedra, 4)
        axis, count = (0.0, 0.0, 0.0), len(self.tetrahedra)
        super().__init__(
            _strain, self.tetrahedra, b_0=axis, b_1=axis, b_2=axis, deviatoric=0.0, hydrostatic=0.0
        )
        E = topology.per_item(self.name, "youngs_modulus", youngs_modulus, count, minimum=0)
        nu = topology.per_item(self.name, "poissons_ratio", poissons_ratio, count, minimum=0)
        tau = topology.per_item(self.name, "damping", damping, count, minimum=0)
        self._refuse("youngs_modulus", E, ~(E > 0), "be above 0")
        self._refuse("poissons_ratio", nu, nu > 0.5, "be at most 0.5")
        self.volumetric = nu > 0
        soft = np.ones((count, 2))  # rows of both parts of one follow each other
        soft[:, 0] = 2.0 * (1.0 + nu) / E
        np.divide((1.0 + nu) * (1.0 - 2.0 * nu), E * nu, out=soft[:, 1], where=self.volumetric)
        self.particles = np.repeat(self.tetrahedra, 2, axis=0)
        self.compliance = soft.reshape(-1)
        beta = np.divide(tau[:, None], soft, out=np.zeros_like(soft), where=soft > 0)
        self.damping = beta.reshape(-1)

    def _refuse(self, argument: str, values: np.ndarray, bad: np.ndarray, condition: str) -> None:
        if bad.any():
            at = int(np.argmax(bad))
            raise validate.fail(
                self.name, f"{argument}[{at}]", condition, float(values[at]), "give one within"
            )

    def columns(self, model: Model, w: int) -> dict[str, np.ndarray]:
        x = topology.pieces(model, w, self.tetrahedra)
        volume = np.abs(Volume.quantity(x))
        if np.isnan(volume).any():
            at = int(np.argmax(np.isnan(volume)))
            raise validate.fail(
                self.name, f"tetrahedra[{at}]", "have a volume at the start",
                self.tetrahedra[at].tolist(), "leave it out",
            )  # fmt: skip
        inverse = np.linalg.inv(np.swapaxes(x[:, 1:], 1, 2))
        size, off = np.sqrt(volume), np.zeros(len(x))
        both = {
            **{f"b_{k}": (inverse[:, k], inverse[:, k]) for k in range(3)},
            "deviatoric": (size, off),
            "hydrostatic": (off, np.where(self.volumetric, size, 0.0)),
        }
        rows = {
            name: np.stack(parts, axis=1).reshape(-1, *parts[0].shape[1:])
            for name, parts in both.items()
        }
        return super().columns(model, w) | rows

    def evaluation(self, model: Model, item: Any) -> wp.Function:
        return neo_hookean_evaluation(model.precision, item)

    def read_force(self, part: Part) -> np.ndarray:
        return super().read_force(part).reshape(-1, 2).max(axis=1)

    def read_broken(self, part: Part) -> np.ndarray:
        return super().read_broken(part)[::2]
