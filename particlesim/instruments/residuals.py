"""By how much the constraints of a simulation are missed."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np
import warp as wp

from ..constraints.boundaries.solid import SolidBoundary
from ..constraints.constraint import Constraint
from ..constraints.contact import Contact
from ..constraints.fluids.density import FluidDensity
from ..engine.execution.launch import launch
from ..engine.source import Source
from ..kernels.instruments import residual as kernels

UNMET = 0.01  # of a tuple's extent: what it may be off by


def residuals(constraint: Any, sim: Source) -> tuple[np.ndarray, np.ndarray] | None:
    """By how much a constraint is missed at the present positions.

    Args:
        constraint: One of ``sim.constraints``.
        sim: The simulation; the constraints' neighbour lists are up to date.

    Returns:
        (values, worlds), one a row: C of each tuple [C], where an inequality counts below 0 only
        and a broken tuple not at all; how deep each particle is in a boundary, or in the particle
        it overlaps most [length]; by what part a place in a fluid is filled more than once. None:
        not known for this kind.
    """
    return _residuals(constraint, sim)


def off(constraint: Constraint, sim: Source) -> tuple[np.ndarray, np.ndarray] | None:
    """How far the particles of tuples are off, in parts of their extent, (m,), and the worlds.

    |C + alpha (F + beta dC/dt)| / |grad C|, F the force of the last substep's multiplier, over the
    largest distance from the first particle; infinite where C is not 0 and has no gradient.
    """
    if not constraint.count:
        return None
    kernel = kernels.off_kernel(constraint.tuples.solved(constraint, sim.state))
    inputs = [sim.model.box, constraint.struct, constraint.bodies]
    return _run(kernel, constraint.count, inputs, sim), constraint.tuples.world


def worst(sim: Source) -> np.ndarray:
    """The largest :func:`off` of all tuples of each world, or by what part a fluid is too dense,
    (worlds,); not a number without any of both.
    """
    found = np.full(sim.model.world_count, np.nan)
    for constraint in sim.constraints:
        missed = off(constraint, sim) if isinstance(constraint, Constraint) else None
        if isinstance(constraint, FluidDensity):
            missed = residuals(constraint, sim)
        if missed is not None:
            np.fmax.at(found, missed[1], missed[0])
    return found


@functools.singledispatch
def _residuals(constraint: Any, sim: Source) -> tuple[np.ndarray, np.ndarray] | None:
    return None


@_residuals.register(Constraint)
def _of_tuples(constraint: Constraint, sim: Source) -> tuple[np.ndarray, np.ndarray] | None:
    if not constraint.count:
        return None
    kernel = kernels.tuples_kernel(constraint.tuples.solved(constraint, sim.state))
    inputs = [sim.model.box, constraint.struct, constraint.bodies]
    return _run(kernel, constraint.count, inputs, sim), constraint.tuples.world


@_residuals.register(SolidBoundary)
def _of_boundary(constraint: SolidBoundary, sim: Source) -> tuple[np.ndarray, np.ndarray] | None:
    if not constraint.count:
        return None
    constraint.follow()
    kernel = kernels.boundary_kernel(constraint.form)
    inputs = [constraint.params, constraint.held, constraint.bodies]
    return _run(kernel, constraint.count, inputs, sim), constraint.held.world.numpy()


@_residuals.register(FluidDensity)
def _of_fluid(constraint: FluidDensity, sim: Source) -> tuple[np.ndarray, np.ndarray] | None:
    if not constraint.count:
        return None
    error, world = constraint.errors()
    return np.maximum(error, 0.0), world


@_residuals.register(Contact)
def _of_contacts(constraint: Contact, sim: Source) -> tuple[np.ndarray, np.ndarray] | None:
    if not constraint.count:
        return None
    model, pairs = sim.model, constraint.pairs.pairs
    kernel = kernels.contact_kernel(model.precision, model.periodic)
    inputs = [pairs, model.box, constraint.apart, constraint.bodies, constraint.radius]
    return _run(kernel, constraint.count, inputs, sim), pairs.world.numpy()


def _run(kernel: wp.Kernel, count: int, inputs: list[Any], sim: Source) -> np.ndarray:
    out = wp.zeros(count, dtype=sim.model.precision.scalar, device=sim.model.device)
    launch(kernel, count, [*inputs, out], sim.model.device)
    return out.numpy().astype(np.float64)
