"""Laws: plain Python functions that become Warp functions in either precision."""

from __future__ import annotations

import ast
import functools
import inspect
import textwrap
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import warp as wp

from .. import validate
from ..kernels.precision import Precision, definition, translate
from ..kernels.warp_internals import digest, written_in_python
from .law_errors import check

UNROLLED = 16  # rounds up to which Warp writes a loop out


class Law:
    """A law of physics as one function; made by :func:`law`.

    The function stays callable from Python. Its parameters without annotation are floats.
    """

    def __init__(self, func: Callable[..., Any]):
        functools.update_wrapper(self, func)
        self.func = func
        self.source = _source(func)  # as it is now: files and notebooks go on being written
        if func.__name__ == "<lambda>" or not self.source:
            raise TypeError(
                f"law: func must be a def in a file or notebook, got {func!r}; Warp reads its "
                "source."
            )
        signature = inspect.signature(func, eval_str=True)
        self.parameters: dict[str, Any] = {}
        self.defaults: dict[str, Any] = {}
        self.returns = signature.return_annotation
        for name, parameter in signature.parameters.items():
            if parameter.kind not in (parameter.POSITIONAL_OR_KEYWORD, parameter.POSITIONAL_ONLY):
                raise TypeError(
                    f"law: parameter {name!r} of {func.__name__} must be positional, got "
                    f"{parameter.kind.description}; write each parameter by name."
                )
            self.parameters[name] = parameter.annotation
            if parameter.default is not parameter.empty:
                self.defaults[name] = parameter.default
        self._functions: dict[tuple[str, str, Any], wp.Function] = {}

    def __call__(self, *args: Any, **kwargs: Any) -> Any:
        return self.func(*args, **kwargs)

    @property
    def name(self) -> str:
        """Name of the function."""
        return self.func.__name__

    @property
    def key(self) -> Key:
        """The same for laws of the same content, each made anew as they may be."""
        cells = [cell.cell_contents for cell in self.func.__closure__ or ()]
        known = (value.key if isinstance(value, Law) else repr(value) for value in cells)
        signature = f"{self.name}({', '.join(self.parameters)})"
        return Key(self.content, signature, tuple(known), self.func.__module__)

    @property
    def content(self) -> str:
        """Hash of the source and of what it names at present, other laws with theirs."""
        values = (f"{name} {_content(value, self)}" for name, value in self._named())
        return digest(self._text, self.func.__defaults__, *self.parameters.values(), *values)

    @functools.cached_property
    def _text(self) -> str:
        """The source without decorators, comments and line breaks."""
        return ast.unparse(definition(self.source))

    @functools.cached_property
    def _names(self) -> list[tuple[str, ...]]:
        """Names and dotted names of the body, of which some are the law's own."""
        found = set()
        for statement in definition(self.source).body[0].body:
            for node in ast.walk(statement):
                if isinstance(node, ast.Name | ast.Attribute):
                    text = ast.unparse(node)
                    if text.replace(".", "").isidentifier():
                        found.add(tuple(text.split(".")))
        return sorted(found)

    def _named(self) -> Iterator[tuple[str, Any]]:
        """What the law names outside itself, and what that stands for."""
        scope = _scope(self.func)
        for first, *rest in self._names:
            if first in scope and first not in self.func.__code__.co_varnames:
                value = functools.reduce(
                    lambda each, name: getattr(each, name, None), rest, scope[first]
                )
                yield ".".join([first, *rest]), value

    def check_derivable(self, owner: str) -> None:
        """Refuse loops that Warp does not write out: it derives them wrongly, and silently.

        Raises:
            ValueError: A ``while``, or a ``for`` whose rounds are not known in advance or over 16.
        """
        scope = _scope(self.func)
        for node in ast.walk(definition(self.source)):
            if isinstance(node, ast.While | ast.For) and not _is_unrolled(node, self.func, scope):
                raise validate.fail(
                    owner, f"law {self.name}",
                    f"loop at most {UNROLLED} rounds known in advance, to be derived",
                    ast.unparse(node).partition("\n")[0], "unroll it, or give the force itself",
                )  # fmt: skip
        for name in {*self.func.__code__.co_names, *self.func.__code__.co_freevars}:
            helper = _as_law(scope.get(name))
            if isinstance(helper, Law) and helper.func is not self.func:
                helper.check_derivable(owner)

    def function(
        self, precision: Precision, owner: str = "law", returns: Any = None
    ) -> wp.Function:
        """The Warp function in ``precision``, of what the law names at present.

        Args:
            precision: Its floats and vectors are of it.
            owner: For errors, whoever uses the law.
            returns: What it must return, float or a vector type; None: anything.

        Raises:
            ValueError: Warp cannot compile it, or it returns something else.
        """
        key = precision.name, self.content, returns
        if key not in self._functions:

            def helper(value: Any) -> Any:
                value = _as_law(value)
                return value.function(precision, owner) if isinstance(value, Law) else value

            made = translate(self.func, precision, helper, self.source)
            check(owner, self.source, made, precision, returns)
            self._functions[key] = made
        return self._functions[key]


@dataclass(frozen=True)
class Key:
    """What makes a law that law: its content. The rest describes it (see ``fingerprint``)."""

    content: str
    signature: str = field(compare=False)
    closure: tuple[Any, ...] = field(compare=False)
    module: str = field(compare=False)


def _content(value: Any, owner: Law) -> str:
    """What a value that a law names is, the same in every process; other objects by their type."""
    value = _as_law(value)
    if isinstance(value, Law):
        return "itself" if value.func is owner.func else value.content
    if isinstance(value, wp.Function | type):
        return digest(value)
    known = isinstance(value, int | float | str | tuple | np.generic)
    return (
        repr(value) if known or type(value).__module__.startswith("warp") else type(value).__name__
    )


def _as_law(value: Any) -> Any:
    """Warp functions written in Python are read as laws."""
    func = written_in_python(value)
    return _law_of(func) if func else value


def _scope(func: Callable[..., Any]) -> dict[str, Any]:
    """What the names of a function mean that are not its own."""
    cells = zip(func.__code__.co_freevars, func.__closure__ or (), strict=True)
    return {**func.__globals__, **{name: cell.cell_contents for name, cell in cells}}


def _is_unrolled(node: ast.While | ast.For, func: Callable[..., Any], scope: dict) -> bool:
    """Whether Warp writes this loop out: a range of known bounds, few rounds and no break."""
    if isinstance(node, ast.While) or not isinstance(node.iter, ast.Call):
        return False
    bounds = []
    for bound in node.iter.args:
        value = bound.value if isinstance(bound, ast.Constant) else None
        if isinstance(bound, ast.Name) and bound.id not in func.__code__.co_varnames:
            value = scope.get(bound.id)
        if not isinstance(value, int):
            return False
        bounds.append(value)
    breaks = any(isinstance(inner, ast.Break) for inner in ast.walk(node))
    return not breaks and len(range(*bounds)) <= UNROLLED


def _source(func: Callable[..., Any]) -> str:
    """Its text, empty where there is none."""
    try:
        return textwrap.dedent(inspect.getsource(func))
    except (OSError, TypeError):
        return ""


@functools.cache
def _law_of(func: Callable[..., Any]) -> Law:
    """One law for one function, so that a kernel does not get it twice."""
    return Law(func)


def law(func: Callable[..., Any]) -> Law:
    """Declare a law: a function of floats and vectors, written once for both precisions.

    The body is Warp's subset of Python (``wp.sqrt``, ``wp.length``, branches, loops). Float
    literals, ``float`` and ``wp.vec3`` take the precision of the simulation, and so do the numbers
    and vectors that it names outside itself, read whenever a Simulation is made; a number that
    meets them is written ``2.0``, not ``2``. ``int`` parameters stay whole. A law may call other
    laws and Warp functions. A law of pairs that chooses by ``wp.where``, ``wp.max``, ``wp.min`` or
    ``wp.clamp`` rather than by ``if`` runs on the CPU's vector units, its derivative too: that of
    the branch that is taken, whatever the other would give, ``wp.where(r < 1.0, wp.sqrt(1.0 - r),
    0.0)``; name what only a branch needs once, or write it in the branch. What the
    first parameters mean is up to who uses the law (see ``PairForce``, ``ParticleForce``,
    ``Constraint``); the others are given by keyword there.

    Example:
        >>> @law
        ... def spring(r: float, stiffness: float, length: float):
        ...     return 0.5 * stiffness * (r - length) ** 2.0
        >>> list(spring.parameters)
        ['r', 'stiffness', 'length']
    """
    if isinstance(func, Law):
        return func
    func = written_in_python(func) or func
    if not inspect.isfunction(func):
        raise TypeError(f"law: func must be a function, got {func!r}; decorate a def.")
    return Law(func)
