"""Gradients of constraints against finite differences."""

from __future__ import annotations

from typing import Any

import numpy as np
import warp as wp

from .. import validate
from ..engine.execution.launch import launch
from ..engine.model import Model
from ..kernels.constraints.constraints import positions_type
from ..kernels.constraints.gradients import gradient_kernel
from ..scene.scene import Scene
from ..scene.settings import Settings
from .constraint import Constraint

# Of the size of a tuple: differences are then exact to STEP^2 and to 2^-52 / STEP.
STEP = float(np.finfo(np.float64).eps ** (1 / 3))


def check_gradient(constraint: Any, points: Any, *, start: Any = None, **parameters: Any) -> float:
    """How far the gradient of a constraint is from central differences of it, in float64.

    Where the law is smooth on the scale of its tuples this is 1e-9 or less: differences themselves
    are no better. More tells of a kink, of a law that Warp derives wrongly, or of a mistake in a
    gradient that is written by hand.

    Args:
        constraint: A constraint on tuples of particles, or a law C(x_0, ..., x_(k-1), ...) as
            :class:`Constraint` takes it.
        points: Positions [length]: (n, 3) of the particles that the constraint names; of a law
            (k, 3), or (m, k, 3) to try it at m places.
        start: Positions at the start, (n, 3) [length], of which a constraint takes what it keeps;
            None: the points.
        **parameters: Of the law, by keyword.

    Returns:
        The largest |derived - difference| of a component, over the largest component of its
        tuple; inf where the constraint or its gradient is not finite.

    Raises:
        ValueError: Points of another shape, or too few for what the constraint names.
        TypeError: Parameters beside a constraint, which has its own.

    Example:
        >>> import warp as wp
        >>> from particlesim import law
        >>> @law
        ... def distance(a: wp.vec3, b: wp.vec3, rest_length: float):
        ...     return wp.length(b - a) - rest_length
        >>> check_gradient(distance, [(0, 0, 0), (1, 2, 3)], rest_length=1.0) < 1e-9
        True
    """
    part, places = _described(constraint, points, parameters)
    if len(part.particles) and part.particles.max() >= len(places):
        raise validate.fail(
            "check_gradient", "points", f"hold {part.particles.max() + 1} points or more",
            len(places), "give the positions of all particles that the constraint names",
        )  # fmt: skip
    x = places[part.particles]
    m, k, _ = x.shape
    if m == 0:
        return 0.0
    size = np.linalg.norm(x - x.mean(axis=1, keepdims=True), axis=2).max(axis=1)
    step = STEP * np.where(size > 0, size, np.maximum(np.abs(x).max(axis=(1, 2)), 1.0))
    moves = np.concatenate([np.eye(3 * k), -np.eye(3 * k)]).reshape(1, 6 * k, k, 3)
    moved = x[:, None] + moves * step[:, None, None, None]
    C, G = _evaluated(
        part, places if start is None else start, np.concatenate([x[:, None], moved], axis=1)
    )
    up, down = C[:, 1 : 3 * k + 1], C[:, 3 * k + 1 :]
    with np.errstate(invalid="ignore"):
        difference = (up - down) / (2.0 * step[:, None])
        derived = G[:, 0].reshape(m, 3 * k)
        scale = np.maximum(np.abs(difference), np.abs(derived)).max(axis=1)
        error = np.abs(derived - difference).max(axis=1) / np.where(scale > 0, scale, 1.0)
    return float(np.nan_to_num(error, nan=np.inf).max())


def _described(
    given: Any, points: Any, parameters: dict[str, Any]
) -> tuple[Constraint, np.ndarray]:
    """The constraint, and the positions of its particles, (n, 3)."""
    if isinstance(given, Constraint):
        validate.known("check_gradient", parameters, (), f"parameter beside {given.name}")
        return given, validate.rows("check_gradient", "points", points, None, 3)
    array = np.asarray(points)
    if array.ndim not in (2, 3) or array.shape[-1] != 3 or array.shape[-2] == 0:
        raise validate.fail(
            "check_gradient", "points", "have shape (k, 3) or (m, k, 3)", array.shape,
            "give the law's k positions",
        )  # fmt: skip
    places = validate.rows("check_gradient", "points", array.reshape(-1, 3), None, 3)
    tuples = np.arange(len(places)).reshape(-1, array.shape[-2])
    return Constraint(given, tuples, **parameters), places


def _evaluated(part: Constraint, start: Any, places: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """C (m, n) and gradients (m, n, k, 3) at n places of each of m tuples."""
    m, n, k, _ = places.shape
    scene = Scene()
    scene.add_particles(validate.rows("check_gradient", "start", start, None, 3))
    model = Model([scene], Settings(precision="float64"), "cpu")
    Item, items = model.parameters("ConstraintItem", part.columns(model, 0))
    evaluate = part.evaluation(model, Item)
    Positions = positions_type(model.precision, k)
    C = wp.zeros(m * n, dtype=wp.float64, device=model.device)
    G = wp.zeros(m * n, dtype=Positions, device=model.device)
    inputs = [
        model.array(places.reshape(m * n, k, 3), Positions),
        model.array(np.repeat(np.arange(m), n).astype(np.int32), wp.int32), items, C, G,
    ]  # fmt: skip
    kernel = gradient_kernel(evaluate, model.precision, k, Item)
    launch(kernel, m * n, inputs, model.device)
    return C.numpy().reshape(m, n), G.numpy().reshape(m, n, k, 3)
