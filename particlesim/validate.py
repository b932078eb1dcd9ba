"""Checks of arguments, with errors in one form.

``<Class>: <argument> must <condition> [unit], got <value>; <what to do>.``
"""

from __future__ import annotations

import difflib
import importlib
from collections.abc import Iterable
from typing import Any

import numpy as np


def undefined(part: Any, method: str) -> NotImplementedError:
    """The error for a subclass without a method that it must have; ``method``: with arguments."""
    name = method.partition("(")[0]
    return NotImplementedError(
        f"{type(part).__name__}: {name} must be defined by the class, got none; "
        f"write def {method} in it."
    )


def fail(owner: str, argument: str, condition: str, value: Any, remedy: str) -> ValueError:
    """The error of the house form, for the caller to raise."""
    text = np.array2string(value, threshold=6) if isinstance(value, np.ndarray) else repr(value)
    text = text if len(text) <= 80 else text[:77] + "..."
    return ValueError(f"{owner}: {argument} must {condition}, got {text}; {remedy}.")


def number(
    owner: str,
    argument: str,
    value: Any,
    *,
    minimum: float | None = None,
    above: float | None = None,
    maximum: float | None = None,
    unit: str = "",
    infinite: bool = False,
) -> float:
    """``value`` as a finite float within bounds."""
    suffix = f" [{unit}]" if unit else ""
    try:
        if isinstance(value, str | bytes):  # which float() would read
            raise TypeError
        result = float(value)
    except (TypeError, ValueError):
        raise fail(owner, argument, f"be a number{suffix}", value, "give one number") from None
    if np.isnan(result) or (np.isinf(result) and not infinite):
        raise fail(owner, argument, f"be finite{suffix}", result, "look for what made it so")
    if minimum is not None and result < minimum:
        raise fail(owner, argument, f"be at least {minimum:g}{suffix}", result, "give a larger one")
    if above is not None and result <= above:
        raise fail(owner, argument, f"be above {above:g}{suffix}", result, "give a larger one")
    if maximum is not None and result > maximum:
        raise fail(owner, argument, f"be at most {maximum:g}{suffix}", result, "give a smaller one")
    return result


def table(owner: str, argument: str, value: Any, **bounds: Any) -> float | np.ndarray:
    """``value`` as a number, or as an array of numbers within bounds."""
    if np.ndim(value) == 0:
        return number(owner, argument, value, **bounds)
    given = np.asarray(value)
    if given.ndim > 2 or given.dtype.kind not in "iuf":
        raise fail(owner, argument, "be a number, or numbers by kinds", value, "give one number")
    for each in given.ravel():
        number(owner, argument, each, **bounds)
    return given.astype(np.float64)


def whole(owner: str, argument: str, value: Any, *, minimum: int = 0) -> int:
    """``value`` as an int of at least ``minimum``."""
    if isinstance(value, bool) or not isinstance(value, int | np.integer) or value < minimum:
        raise fail(
            owner, argument, f"be a whole number of at least {minimum}", value, "give one such"
        )
    return int(value)


def vector(owner: str, argument: str, value: Any, *, unit: str = "") -> np.ndarray:
    """``value`` as three finite floats."""
    suffix = f" [{unit}]" if unit else ""
    result = _array(owner, argument, value)
    if result.shape != (3,):
        raise fail(owner, argument, f"have shape (3,){suffix}", value, "give three numbers")
    _finite(owner, argument, result)
    return result


def rows(owner: str, argument: str, value: Any, count: int | None, width: int | None) -> np.ndarray:
    """``value`` as a finite (count, width) or, for width None, (count,) array.

    One value stands for all: a number, or (width,) of a vector; 0 is a vector of zeros. Nothing
    else is broadcast: a list of one is one row, whatever the count.
    """
    result = _array(owner, argument, value).copy()
    if count is None:
        if result.ndim != 2 or result.shape[1] != width:
            if result.size == 0:
                return np.zeros((0, width or 1))
            raise fail(
                owner, argument, f"have shape (n, {width})", result, "give one row a particle"
            )
    else:
        shape: tuple[int, ...] = (count,) if width is None else (count, width)
        zero = result.ndim == 0 and not result.any()
        if result.shape not in (shape, shape[1:]) and not zero:
            raise fail(
                owner,
                argument,
                f"have shape {shape[1:] or '()'} or {shape}",
                np.shape(value) if np.ndim(value) else value,
                "give one value for all, or one a particle",
            )
        result = np.broadcast_to(result, shape).copy()
    _finite(owner, argument, result)
    return result


def triangles(owner: str, value: Any, count: int, *, proper: bool = True) -> np.ndarray:
    """``value`` as (t, 3) int64 indices of ``count`` points.

    ``proper``: at least one triangle, and three different corners each.
    """
    array = np.asarray(value)
    if array.size == 0 and not proper:
        return np.zeros((0, 3), dtype=np.int64)
    shaped = array.ndim == 2 and array.shape[1] == 3 and len(array) > 0
    if not shaped or not np.issubdtype(array.dtype, np.integer):
        raise fail(
            owner, "triangles", "be whole numbers of shape (t, 3)", value, "give three a triangle"
        )
    if array.min() < 0 or array.max() >= count:
        worst = array.max() if array.max() >= count else array.min()
        raise fail(
            owner, "triangles", f"hold indices from 0 to {count - 1}", int(worst),
            "count the points from 0",
        )  # fmt: skip
    turned = np.roll(array, 1, axis=1)
    if proper and (array == turned).any():
        at = int(np.argmax((array == turned).any(axis=1)))
        raise fail(
            owner, f"triangles[{at}]", "have three different corners", array[at].tolist(),
            "leave it out",
        )  # fmt: skip
    return array.astype(np.int64)


def grid(owner: str, argument: str, value: Any, axes: int) -> np.ndarray:
    """``value`` as finite numbers at the nodes of a grid, 2 or more along each of its axes."""
    result = _array(owner, argument, value).copy()
    if result.ndim != axes or min(result.shape) < 2:
        raise fail(
            owner, argument, f"have {axes} axes of 2 nodes or more", result, "sample a whole grid"
        )
    _finite(owner, argument, result)
    return result


def _array(owner: str, argument: str, value: Any) -> np.ndarray:
    if hasattr(value, "numpy"):
        value = value.numpy()
    try:
        given = np.asarray(value)
        if given.dtype.kind in "US":  # which NumPy would read as numbers
            raise TypeError
        return given.astype(np.float64)
    except (TypeError, ValueError):
        raise fail(owner, argument, "be numbers", value, "give an array of floats") from None


def _finite(owner: str, argument: str, array: np.ndarray) -> None:
    bad = ~np.isfinite(array)
    if bad.any():
        at = tuple(int(k) for k in np.argwhere(bad)[0])
        where = f"{argument}[{', '.join(map(str, at))}]" if at else argument
        raise fail(owner, where, "be finite", float(array[at]), "look for what made it so")


def choice(owner: str, argument: str, value: Any, allowed: Iterable[str]) -> str:
    """``value`` if it is one of ``allowed``."""
    names = list(allowed)
    if value not in names:
        raise fail(owner, argument, f"be one of {', '.join(names)}", value, suggest(value, names))
    return value


def known(owner: str, given: Iterable[str], names: Iterable[str], what: str = "argument") -> None:
    """Refuse keywords that are not among ``names``, and list those that are."""
    names = list(names)
    for name in given:
        if name not in names:
            allowed = ", ".join(names) or "(none)"
            raise TypeError(
                f"{owner}: {what} must be one of {allowed}, got {name!r}; {suggest(name, names)}."
            )


def installed(owner: str, module: str, extra: str) -> Any:
    """A module of an optional package, which the extra of this name installs.

    Raises:
        ImportError: It is not there.
    """
    package = module.partition(".")[0]
    try:
        importlib.import_module(package)
        return importlib.import_module(module)
    except ImportError:
        raise ImportError(
            f"{owner}: {package} must be installed, got none; pip install 'particlesim[{extra}]'."
        ) from None


def suggest(value: Any, names: list[str]) -> str:
    """What was probably meant."""
    close = difflib.get_close_matches(str(value), names, n=1)
    return f"did you mean {close[0]!r}" if close else "choose one of these"
