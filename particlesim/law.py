"""Laws: plain Python functions that become Warp functions in either precision."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable
from typing import Any

import warp as wp

from .kernels.precision import Precision, translate


class Law:
    """A law of physics as one function; made by :func:`law`.

    The function stays callable from Python. Its parameters without annotation are floats.
    """

    def __init__(self, func: Callable[..., Any]):
        functools.update_wrapper(self, func)
        self.func = func
        signature = inspect.signature(func, eval_str=True)
        self.parameters: dict[str, Any] = {}
        self.defaults: dict[str, Any] = {}
        for name, parameter in signature.parameters.items():
            if parameter.kind not in (parameter.POSITIONAL_OR_KEYWORD, parameter.POSITIONAL_ONLY):
                raise TypeError(
                    f"law: parameter {name!r} of {func.__name__} must be positional, got "
                    f"{parameter.kind.description}; write each parameter by name."
                )
            self.parameters[name] = parameter.annotation
            if parameter.default is not parameter.empty:
                self.defaults[name] = parameter.default
        self._functions: dict[str, wp.Function] = {}

    def __call__(self, *args: Any, **kwargs: Any) -> Any:
        return self.func(*args, **kwargs)

    @property
    def name(self) -> str:
        """Name of the function."""
        return self.func.__name__

    def function(self, precision: Precision) -> wp.Function:
        """The Warp function in ``precision``, translated on first use."""
        if precision.name not in self._functions:
            self._functions[precision.name] = translate(
                self.func,
                precision,
                lambda value: value.function(precision) if isinstance(value, Law) else value,
            )
        return self._functions[precision.name]


def law(func: Callable[..., Any]) -> Law:
    """Declare a law: a function of floats and vectors, written once for both precisions.

    The body is Warp's subset of Python (``wp.sqrt``, ``wp.length``, branches, loops). Float
    literals, ``float`` and ``wp.vec3`` take the precision of the simulation. A law may call other
    laws. What the first parameters mean is up to who uses the law (see ``PairForce``,
    ``ParticleForce``, ``Constraint``); the others are given by keyword there.

    Example:
        >>> @law
        ... def spring(r: float, stiffness: float, length: float):
        ...     return 0.5 * stiffness * (r - length) ** 2.0
        >>> list(spring.parameters)
        ['r', 'stiffness', 'length']
    """
    if isinstance(func, Law):
        return func
    if not callable(func):
        raise TypeError(f"law: func must be a function, got {func!r}; decorate a def.")
    return Law(func)
