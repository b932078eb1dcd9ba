"""Laws asked at chosen arguments, apart from any simulation."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import warp as wp

from ...engine.model import Model
from ...kernels.interactions.calls import SQUARED
from ...kernels.interactions.values import values_kernel
from ...kernels.precision import FLOAT64, Precision, annotation, structure
from .arguments import QUANTITIES, Arguments


def values(
    arguments: Arguments, given: Mapping[str, np.ndarray], count: int, *, vector: bool = False,
    by: str | None = None, precision: Precision = FLOAT64,
) -> np.ndarray:  # fmt: skip
    """A law's values in a precision, (k,) or of a law of vectors (k, 3), as float64.

    Args:
        arguments: Of the law.
        given: The law's parameters by name, (k,) or (k, 3); those left out have their own values.
        count: k.
        vector: They are vectors.
        by: The parameter by which the law is to be derived; None: not at all.
        precision: In which it is computed.
    """
    law = arguments.law
    kinds = {name: annotation(kind, precision) for name, kind in law.parameters.items()}
    kinds = {name: wp.int32 if kind is int else kind for name, kind in kinds.items()}
    Params = structure(f"TrialValues_{precision.name}", kinds)
    host = np.zeros(count, dtype=Params.numpy_dtype())
    with np.errstate(over="ignore", under="ignore"):
        for name in kinds:
            host[name] = given[name] if name in given else arguments.values[name]
    returns = precision.vec3 if vector else precision.scalar
    at = None if by is None else list(kinds).index(by)
    kernel = values_kernel(law.function(precision), tuple(kinds), Params, returns, at)
    found = wp.empty(count, dtype=returns, device="cpu")
    wp.launch(kernel, count, [wp.array(host, dtype=Params, device="cpu")], [found], device="cpu")
    return found.numpy().astype(np.float64)


def quantity(model: Model, rows: np.ndarray, name: str) -> np.ndarray:
    """A quantity of these particles at the start; what is not known before a step is 1."""
    if name in model.attributes or name in QUANTITIES - {"density"}:
        return model.column(name)[rows]
    return np.ones(len(rows))


def of_pairs(
    arguments: Arguments, r: np.ndarray, pairs: Mapping[str, np.ndarray], *, order: str = "ij",
    force: bool = False, derived: bool = False, precision: Precision = FLOAT64,
) -> np.ndarray:  # fmt: skip
    """A pair's law at distances r, or minus its derivative: the force of a potential.

    Args:
        arguments: Of the law, the distance left out.
        r: (k,) [length].
        pairs: Quantities of both by name, (k, 2) or (k, 2, 3).
        order: What the first and the second particle are called.
        force: It is the law of a force, if it is not derived.
        derived: By the distance.
        precision: In which it is computed.
    """
    distance = next(iter(arguments.law.parameters))
    squared = distance == SQUARED
    given = {distance: r**2 if squared else r}
    for name, (kind, source) in zip(arguments.names, arguments.sources, strict=True):
        if kind != "parameter":
            given[name] = pairs[source][:, order.index(kind[-1])]
    by = distance if derived else None
    found = values(arguments, given, len(r), by=by, precision=precision)
    if derived:
        return (-2.0 * r if squared else -1.0) * found
    return r * found if squared and force else found


def of_particles(
    arguments: Arguments, model: Model, rows: np.ndarray, x: np.ndarray, *, derived: bool = False,
    precision: Precision = FLOAT64,
) -> np.ndarray:  # fmt: skip
    """The force on particles by a law of it, or by that of a potential, as if they were at x.

    Args:
        arguments: Of the law.
        model: With the particles.
        rows: Which, (k,).
        x: Where, (k, 3) [length].
        derived: It is the law of a potential, which takes ``position``.
        precision: In which it is computed.
    """
    given = {
        name: x if source == "position" else quantity(model, rows, source)
        for name, (kind, source) in zip(arguments.names, arguments.sources, strict=True)
        if kind != "parameter"
    }
    by = "position" if derived else None
    found = values(arguments, given, len(rows), vector=True, by=by, precision=precision)
    return -found if derived else found
