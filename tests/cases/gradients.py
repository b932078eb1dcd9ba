"""Forces against the energy that they are to be the gradient of."""

import numpy as np
import pytest

STEP = 1e-6


def assert_gradient(sim, x, force, i, axis):
    """Force along an axis on a particle of the places x, against differences of the energy."""
    energy = []
    for sign in (1, -1):
        moved = x.copy()
        moved[i, axis] += sign * STEP
        sim.set("position", moved)
        energy.append(sim.diagnostics().potential[0])
    # Differences of the second order, about (step / h)^2, and of 1e-16 of the energy over it.
    expected = -(energy[0] - energy[1]) / (2 * STEP)
    assert force[i, axis] == pytest.approx(expected, abs=1e-6 * np.abs(force).max())
