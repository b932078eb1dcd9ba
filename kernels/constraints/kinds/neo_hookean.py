"""The strains of an elastic tetrahedron."""

import warp as wp

from ...precision import Precision, function
from ..constraints import positions_type


def neo_hookean_evaluation(precision: Precision, item: type) -> wp.Function:
    """C = d sqrt(|F|^2 + (J - 2)^2 - 4) + h (J - 1).

    With F = sum_j (x_j - x_0) b_j^T and J = det F; one of ``d`` and ``h`` is 0, or both are. Under
    the root it is near a rotation of the second order in the strain: taken from A = F^T F - 1, of
    whose entries all digits are there, with J - 1 = (det(1 + A) - 1) / (J + 1), what is of the
    first order cancels by itself and not by rounding.
    """
    real, vec3, positions = precision.scalar, precision.vec3, positions_type(precision, 4)

    def neo_hookean_constraint(X: positions, q: item):
        u, v, w = X[1] - X[0], X[2] - X[0], X[3] - X[0]
        f = u * q.b_0[0] + v * q.b_1[0] + w * q.b_2[0]  # the columns of F
        g = u * q.b_0[1] + v * q.b_1[1] + w * q.b_2[1]
        h = u * q.b_0[2] + v * q.b_1[2] + w * q.b_2[2]
        f_cof, g_cof, h_cof = wp.cross(g, h), wp.cross(h, f), wp.cross(f, g)  # dJ/dF
        J = wp.dot(f, f_cof)
        one, two = real(1.0), real(2.0)
        a, b, c = wp.dot(f, f) - one, wp.dot(g, g) - one, wp.dot(h, h) - one
        r, s, t = wp.dot(g, h), wp.dot(h, f), wp.dot(f, g)
        trace = a + b + c
        second = a * b + b * c + c * a - r * r - s * s - t * t
        third = a * (b * c - r * r) - t * (t * c - r * s) + s * (t * r - b * s)
        upright = J > real(0.0)
        over = one / wp.where(upright, J + one, one)
        j = wp.where(upright, (trace + second + third) * over, J - one)
        first = wp.where(upright, (trace * j - two * (second + third)) * over, trace - two * j)
        D = wp.sqrt(wp.max(first + j * j, real(0.0)))
        some = D > real(0.0)
        pull = wp.where(some, q.deviatoric / wp.where(some, D, one), real(0.0))
        turn = pull * (j - one) + q.hydrostatic
        P_f, P_g, P_h = f * pull + f_cof * turn, g * pull + g_cof * turn, h * pull + h_cof * turn
        G_1 = P_f * q.b_0[0] + P_g * q.b_0[1] + P_h * q.b_0[2]
        G_2 = P_f * q.b_1[0] + P_g * q.b_1[1] + P_h * q.b_1[2]
        G_3 = P_f * q.b_2[0] + P_g * q.b_2[1] + P_h * q.b_2[2]
        G_0 = vec3() - G_1 - G_2 - G_3
        return q.deviatoric * D + q.hydrostatic * j, wp.matrix_from_rows(G_0, G_1, G_2, G_3)

    return function(neo_hookean_constraint)
