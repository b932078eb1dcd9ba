"""Yoshida's method of fourth order: three evaluations of the forces a substep."""

from __future__ import annotations

from .composition import Composition

_OUTER = 1.0 / (2.0 - 2.0 ** (1.0 / 3.0))  # 2 w_1 + w_0 = 1 and 2 w_1^3 + w_0^3 = 0


class Yoshida4(Composition):
    """Velocity Verlet in three stages, w_1, w_0, w_1 (Yoshida 1990; Forest and Ruth 1990).

    w_1 = 1 / (2 - 2^(1/3)) = 1.3512, w_0 = 1 - 2 w_1 = -1.7024. Stable up to omega dt = 1.573.
    """

    title = "yoshida4"
    order = 4
    stages = (_OUTER, 1.0 - 2.0 * _OUTER, _OUTER)
