"""Yoshida's method of sixth order: seven evaluations of the forces a substep."""

from __future__ import annotations

from .composition import Composition

# Solution A (Yoshida 1990, table 1), refined to all digits of float64.
_W1, _W2, _W3 = -1.17767998417887100695, 0.23557321335935813368, 0.78451361047755726382


class Yoshida6(Composition):
    """Velocity Verlet in seven stages, w_3, w_2, w_1, w_0, w_1, w_2, w_3 (Yoshida 1990).

    Solution A of his three: w_0 = 1 - 2 (w_1 + w_2 + w_3) = 1.3152. Stable up to omega dt = 2.269.
    """

    title = "yoshida6"
    order = 6
    stages = (_W3, _W2, _W1, 1.0 - 2.0 * (_W1 + _W2 + _W3), _W1, _W2, _W3)
