"""The rotation of a cluster: in float64, since the sums that it comes of cancel."""

import warp as wp

from ...precision import function

SWEEPS = 8  # of Jacobi's method on 4 x 4, which converges quadratically
STEPS = 12  # of Newton's method
NEAR = 1e-8  # of the moment of inertia: from there on one step goes to where rounding ends
GOOD = 1e-9  # of the same: what counts as solved, since pinned members weigh more
THIN = 1e-12  # of the same: about the line of a linear cluster nothing is to be turned

double = wp.float64


def _axial(M: wp.mat33d):
    return wp.vec3d(M[2, 1] - M[1, 2], M[0, 2] - M[2, 0], M[1, 0] - M[0, 1])


axial = function(_axial)  # of sum g p^T it is sum p x g


def _best_turn(A: wp.mat33d):
    """The rotation R, as a quaternion, of the largest tr(R^T A), A = sum m r q^T.

    It is the eigenvector of the largest eigenvalue of a symmetric matrix of four (Horn 1987),
    found by Jacobi's method: also where A is singular or inverts, as of planes and lines.
    """
    N = wp.mat44d()
    N[0, 0] = A[0, 0] + A[1, 1] + A[2, 2]
    N[1, 1] = A[0, 0] - A[1, 1] - A[2, 2]
    N[2, 2] = A[1, 1] - A[0, 0] - A[2, 2]
    N[3, 3] = A[2, 2] - A[0, 0] - A[1, 1]
    N[0, 1] = A[2, 1] - A[1, 2]
    N[0, 2] = A[0, 2] - A[2, 0]
    N[0, 3] = A[1, 0] - A[0, 1]
    N[1, 2] = A[0, 1] + A[1, 0]
    N[1, 3] = A[0, 2] + A[2, 0]
    N[2, 3] = A[1, 2] + A[2, 1]
    V = wp.mat44d()
    for i in range(4):
        V[i, i] = double(1.0)
        for j in range(i):
            N[i, j] = N[j, i]
    rotations = int(wp.static(6 * SWEEPS))
    for n in range(rotations):
        k = n % 6
        i = wp.where(k < 3, 0, wp.where(k < 5, 1, 2))
        j = wp.where(k < 3, k + 1, wp.where(k < 5, k - 1, 3))
        if N[i, j] != double(0.0):
            theta = (N[j, j] - N[i, i]) / (double(2.0) * N[i, j])
            root = wp.abs(theta) + wp.sqrt(theta * theta + double(1.0))
            t = wp.where(theta < double(0.0), double(-1.0), double(1.0)) / root
            c = double(1.0) / wp.sqrt(t * t + double(1.0))
            s = t * c
            for a in range(4):
                left, right = N[a, i], N[a, j]
                N[a, i] = c * left - s * right
                N[a, j] = s * left + c * right
            for a in range(4):
                left, right = N[i, a], N[j, a]
                N[i, a] = c * left - s * right
                N[j, a] = s * left + c * right
                left, right = V[a, i], V[a, j]
                V[a, i] = c * left - s * right
                V[a, j] = s * left + c * right
    best = int(0)
    for a in range(1, 4):
        if N[a, a] > N[best, best]:
            best = a
    return wp.normalize(wp.quatd(V[1, best], V[2, best], V[3, best], V[0, best]))


best_turn = function(_best_turn)


def _turn_towards(turn: wp.quatd, P: wp.mat33d, a: wp.vec3d):
    """From ``turn`` on the rotation R with sum m p x (R q) = a, P = sum m p q^T, of size 1.

    Newton's method: a small further turn phi changes the left side by (tr(M) - M) phi with
    M = R P^T. Only where the symmetric part of that is positive, as near the rotation of p: else,
    or where nothing solves it, it is not found.

    Returns:
        The rotation, a - sum m p x (R q), and whether it is found.
    """
    q = turn
    rest = wp.vec3d()
    good = bool(True)
    steps = int(wp.static(STEPS))
    for _n in range(steps):
        M = wp.quat_to_matrix(q) * wp.transpose(P)
        rest = a - axial(M)
        last = wp.length(rest) < double(wp.static(NEAR))
        K = (wp.trace(M) + double(wp.static(THIN))) * wp.identity(n=3, dtype=double) - M
        xy = double(0.5) * (K[0, 1] + K[1, 0])
        S = double(0.5) * (K + wp.transpose(K))
        minor = K[0, 0] * K[1, 1] - xy * xy
        good = K[0, 0] > double(0.0) and minor > double(0.0) and wp.determinant(S) > double(0.0)
        if not good:
            break
        phi = wp.inverse(K) * rest
        angle = wp.length(phi)
        if angle > double(0.0):
            q = wp.normalize(wp.quat_from_axis_angle(phi / angle, angle) * q)
        if last:
            break
    M = wp.quat_to_matrix(q) * wp.transpose(P)
    rest = a - axial(M)
    return q, rest, good and wp.length(rest) < double(wp.static(GOOD))


turn_towards = function(_turn_towards)


def _spin_of(L: wp.vec3d, inertia: wp.mat33d):
    """The angular velocity of that angular momentum; none about a line that has no inertia.

    The inverse of what is a little more than the inertia, refined twice.
    """
    thin = double(wp.static(THIN)) * wp.trace(inertia) * wp.identity(n=3, dtype=double)
    inverse = wp.inverse(inertia + thin)
    spin = inverse * L
    for _n in range(2):
        spin = spin + inverse * (L - inertia * spin)
    return spin


spin_of = function(_spin_of)
