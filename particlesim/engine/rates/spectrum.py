"""The largest eigenvalue of an operator that can only be applied, approximately."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

QUICKEST = 2  # applications beyond the first, before anything is sure

# Applies the operator: from a vector to what it was really applied to (rounded), and the image.
Operator = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]


@dataclass(frozen=True)
class Largest:
    """The eigenvalue of largest size.

    Args:
        size: Its estimate from below, by Rayleigh and Ritz.
        residual: Norm of A z - theta z for the unit vector z: as far off the size may be.
        vector: z, (n,); largest where the eigenvector is.
        steps: Applications of the operator.
        values: All that was found of the spectrum, complex.
    """

    size: float
    residual: float
    vector: np.ndarray
    steps: int
    values: np.ndarray = field(default_factory=lambda: np.zeros(0))

    @property
    def bound(self) -> float:
        """theta + |residual|: from above, as a rule, for symmetric operators (Zhou and Li 2011)."""
        return self.size + self.residual


def largest(
    apply: Operator, start: np.ndarray, *, steps: int, tolerance: float, enough: float = 0.0
) -> Largest:
    """The eigenvalue of largest size, from the Krylov space of ``start``.

    The basis q_1, A q_1, ... is made orthogonal as Arnoldi (1951) does, but need not be exactly
    so: eigenvalues are those of (Q^T Q)^-1 Q^T (A Q) with the vectors that A was really applied
    to. So the operator may round its argument, and need not be symmetric.

    Args:
        apply: The operator.
        start: (n,), not zero.
        steps: Applications at most.
        tolerance: Stop when the residual is this part of the eigenvalue. A new direction that is
            smaller than this part of its image counts as rounding, and ends it too.
        enough: Stop, too, as soon as the eigenvalue is surely below this. A start at random has
            1 / n of its square along the eigenvector, so that after k applications
            theta >= lambda n^(-1 / (2k - 1)) for a symmetric operator without sign.
    """
    count = len(start)
    steps = min(steps, count)
    basis, images = np.zeros((steps, count)), np.zeros((steps, count))
    q, found = start / size_of(start), Largest(0.0, 0.0, np.zeros(count), 0)
    for k in range(steps):
        basis[k], images[k] = apply(q)
        gram = _products(basis[: k + 1], basis[: k + 1])
        found = _ritz(basis[: k + 1], images[: k + 1], gram)
        scale = size_of(images[k])
        if not np.isfinite(scale) or found.residual <= tolerance * found.size:
            break
        most = found.size * count ** (1.0 / (2 * k + 1))
        if k >= QUICKEST and most < enough:
            return replace(found, residual=most - found.size)
        q = images[k] / scale if scale > 0.0 else images[k]
        for _ in range(2):  # once leaves what rounding makes of nearly parallel vectors
            along = _solve(gram, _products(basis[: k + 1], q[None])[:, 0])
            q = q - _sum(along, basis[: k + 1])
        size = size_of(q)
        if size <= 0.1 * tolerance:
            break
        q /= size
    return found


# Over all particles without BLAS: its threads go on spinning for a while on the cores of our own.


def _products(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Of each row of one with each row of the other."""
    return np.einsum("in,jn->ij", a, b)


def _sum(weights: np.ndarray, rows: np.ndarray) -> np.ndarray:
    return np.einsum("k,kn->n", weights, rows)


def size_of(v: np.ndarray) -> float:
    """The norm of all its numbers."""
    return math.sqrt(float(np.sum(v.real**2 + v.imag**2)))


def _solve(gram: np.ndarray, right: np.ndarray) -> np.ndarray:
    """What times Q^T Q is ``right``, of least size where directions are missing."""
    values, vectors = np.linalg.eigh(gram)
    kept = values > len(values) * np.finfo(float).eps * values[-1]
    along = vectors[:, kept]
    return (along / values[kept]) @ (along.T @ right)


def _ritz(basis: np.ndarray, images: np.ndarray, gram: np.ndarray) -> Largest:
    """The largest Ritz value of a basis (k, n), its images (k, n), and its products (k, k)."""
    count = basis.shape[1]
    if not np.isfinite(images).all():
        return Largest(np.inf, 0.0, np.ones(count), len(basis))
    values, vectors = np.linalg.eig(_solve(gram, _products(basis, images)))
    top = int(np.argmax(np.abs(values)))
    z = _sum(vectors[:, top], basis)
    norm = size_of(z)
    residual = size_of(_sum(vectors[:, top], images) - values[top] * z) / norm
    return Largest(float(abs(values[top])), float(residual), np.abs(z) / norm, len(basis), values)
