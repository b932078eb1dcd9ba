"""Potentials of Poisson's equation in a periodic box: gravity, or charges, by a mesh."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np
import warp as wp

from ... import validate
from ...engine.limit import Limit
from .grid import Coupling, Field


class PoissonField(Field):
    """lap phi = 4 pi G (rho - mean rho) in a periodic box, solved by Fourier's transform.

    Of ``FieldForce(field, coupling="mass")`` it makes gravity by a mesh (Hockney and Eastwood
    1981): of all images, of N particles and M nodes in N + M log M, and softened over about two
    spacings. The mean is left out, without which no periodic box has a potential. On the grid the
    Laplacian is that of differences, of second order. The transform is NumPy's, on the host. Where
    bodies are to feel each other as near as they come, :class:`Gravity` has methods of its own.

    Args:
        lower, upper: Corners of the box of ``Scene(periodic=...)``.
        spacing: Of the nodes [length].
        constant: G: positive attracts, and -k repels charges of one sign.

    Example:
        >>> PoissonField((0, 0, 0), (1, 1, 1), spacing=1 / 32).nodes((True,) * 3).tolist()
        [32, 32, 32]
    """

    conservative = True

    def __init__(self, lower: Any, upper: Any, spacing: float, *, constant: float = 1.0):
        super().__init__(lower, upper, spacing)
        self.constant = validate.number(type(self).__name__, "constant", constant)

    def live(self, coupling: Coupling) -> LivePotential:
        """What is solved in a simulation."""
        return LivePotential(coupling)


class LivePotential:
    """The potentials of all worlds.

    Args:
        coupling: With the grids.
    """

    part = 0.5  # of q u that is energy: every pair is in it twice

    def __init__(self, coupling: Coupling):
        self.coupling, self.u = coupling, coupling.zeros()
        for field in coupling.fields:
            if not np.array_equal(np.array(list(coupling.model.periodic)), field.active):
                raise validate.fail(
                    coupling.owner, "field", "be periodic along all its axes with a PoissonField",
                    field.active.tolist(), "give Scene(periodic=...)",
                )  # fmt: skip
        self.own = wp.zeros_like(coupling.shares())

    def settle(self) -> None:
        """The potential of what particles have put on it."""
        coupling, sums = self.coupling, self.coupling.sums.numpy()
        result = np.zeros(coupling.rows)
        for w in range(coupling.model.world_count):
            rows = slice(int(coupling.first[w]), int(coupling.first[w + 1]))
            rho = sums[rows].reshape(coupling.nodes[w]) / coupling.columns["scale"][w]
            waves = np.fft.rfftn(rho) * self._weights[w]
            phi = np.fft.irfftn(waves, s=rho.shape, axes=(0, 1, 2))
            result[rows] = phi.ravel()
        self.u.assign(result.astype(coupling.model.precision.numpy))

    @functools.cached_property
    def _weights(self) -> list[np.ndarray]:
        """-4 pi G / (V K^2) by wave, of the volume V of a node; 0 of the mean."""
        coupling, found = self.coupling, []
        for w, field in enumerate(coupling.fields):
            assert isinstance(field, PoissonField)
            n, h = coupling.nodes[w], coupling.steps[w]
            squares = [
                (2.0 / step * np.sin(np.pi * np.fft.fftfreq(count))) ** 2
                for count, step in zip(n, h, strict=True)
            ]
            squares[2] = squares[2][: n[2] // 2 + 1]
            total = squares[0][:, None, None] + squares[1][:, None] + squares[2]
            volume = float(np.where(field.active, h, 1.0).prod())
            with np.errstate(divide="ignore"):
                weight = -4.0 * np.pi * field.constant / (volume * total)
            found.append(np.where(total > 0, weight, 0.0))
        return found

    def advance(self, dt: float) -> None:
        """It follows at once."""

    def reset(self, worlds: Any) -> None:
        """It keeps nothing."""

    def energy(self) -> wp.array:
        """All of it is the particles'."""
        return self.own

    def persistent(self) -> dict[str, wp.array]:
        """Nothing: it is found anew from where the particles are."""
        return {}

    def limits(self, part: str) -> list[Limit]:
        """None of its own."""
        return []
