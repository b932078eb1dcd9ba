"""One source for both precisions: the types of a precision, and laws translated to it.

Float literals and ``float`` annotations mean float32 to Warp. :func:`translate` rewrites a law
written in plain Python for the precision at hand, so that one law serves both.
"""

from __future__ import annotations

import ast
import functools
import inspect
import math
import re
import textwrap
import types
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import warp as wp

from .choices import derivable, passed, taken
from .error_function import complement
from .exponential import exponential
from .extremes import larger, smaller, within
from .warp_internals import compiled, digest, is_after_gradients, named_function

# Generic names that a law may use, and what they become in float64.
_DOUBLE = {
    name: getattr(wp, f"{name}d")
    for name in ("vec2", "vec3", "vec4", "mat22", "mat33", "mat44", "quat")
}
_VECTORS = (*_DOUBLE.values(), *(getattr(wp, name) for name in _DOUBLE))
_DOUBLE["float32"] = wp.float64
# What laws call in place of Warp's own, so that they and their derivatives vectorise.
_EXTREMES = {
    "max": larger, "min": smaller, "clamp": within, "exp": exponential, "erfc": complement,
}  # fmt: skip
_CHOICES = {"taken": taken, "passed": passed}


# Coincident particles part along this direction, or with its components' signs turned.
APART = (0.48, 0.6, 0.64)


@dataclass(frozen=True)
class Precision:
    """Scalar and vector types of one floating point precision."""

    name: str
    scalar: type
    vec3: type
    mat33: type
    numpy: type
    c: str  # the scalar's name in native code

    def vector(self, length: int) -> type:
        """Vector type of ``length`` scalars of this precision."""
        return wp.types.vector(length=length, dtype=self.scalar)


FLOAT32 = Precision("float32", wp.float32, wp.vec3f, wp.mat33f, np.float32, "float")
FLOAT64 = Precision("float64", wp.float64, wp.vec3d, wp.mat33d, np.float64, "double")
PRECISIONS = {"float32": FLOAT32, "float64": FLOAT64}


class _Rewriter(ast.NodeTransformer):
    """Rewrites a law's numbers and Warp's short names for a precision.

    Attributes that are numbers (``math.pi``) become literals, and those that are functions or
    vectors names of their own, in ``found``, so that the source and what it names say all.
    """

    def __init__(
        self, precision: Precision, scope: dict[str, Any], resolve: Callable[[Any], Any]
    ) -> None:
        self.precision, self.scope, self.resolve = precision, scope, resolve
        self.double = precision is FLOAT64
        self.found: dict[str, Any] = {}

    def _number(self, node: ast.AST) -> ast.AST:
        if not self.double:
            return node
        call = ast.Call(func=_name("_float64", node), args=[node], keywords=[])
        return ast.copy_location(call, node)

    def visit_Constant(self, node: ast.Constant) -> ast.AST:
        return self._number(node) if isinstance(node.value, float) else node

    def visit_Name(self, node: ast.Name) -> ast.AST:
        return _name("_float64", node) if self.double and node.id == "float" else node

    def visit_Attribute(self, node: ast.Attribute) -> ast.AST:
        owner = self.meaning(node.value)
        value = getattr(owner, node.attr, None)
        if isinstance(value, float | int):
            # Infinities and NaN have no literal, and are the same in both precisions.
            known = ast.copy_location(ast.Constant(value), node) if math.isfinite(value) else node
            return self._number(known) if isinstance(value, float) else known
        if self.double and owner is wp and node.attr in _DOUBLE:
            return _name(f"_{node.attr}_double", node)
        if owner is wp and node.attr in _EXTREMES:
            return _name(f"_{node.attr}_derived", node)
        if owner is None:
            return self.generic_visit(node)
        known = value if owner is wp else constant(self.resolve(value), self.precision)
        if owner is wp or not isinstance(known, (wp.Function, *_VECTORS)):
            return node
        name = f"_{ast.unparse(node).replace('.', '_')}"
        self.found[name] = known
        return _name(name, node)

    def meaning(self, node: ast.AST) -> Any:
        """What a dotted name stands for outside the law, or None."""
        if isinstance(node, ast.Attribute):
            return getattr(self.meaning(node.value), node.attr, None)
        return self.scope.get(node.id) if isinstance(node, ast.Name) else None

    def visit_arguments(self, node: ast.arguments) -> ast.AST:
        return node  # annotations are mapped by value, see `annotation`


def _name(name: str, node: ast.AST) -> ast.AST:
    return ast.copy_location(ast.Name(id=name, ctx=ast.Load()), node)


def constant(value: Any, precision: Precision) -> Any:
    """A number or vector that a law refers to by name, in ``precision``; else the value itself."""
    if precision is FLOAT32 or isinstance(value, int):
        return value
    if isinstance(value, float | wp.float32):
        return wp.float64(float(value))
    for name, double in _DOUBLE.items():
        if type(value) is getattr(wp, name):
            return double(*np.asarray(value, dtype=np.float64).ravel())
    return value


def annotation(kind: Any, precision: Precision) -> Any:
    """The type that ``kind``, as written in a law, has in ``precision``."""
    if kind in (float, wp.float32, inspect.Parameter.empty, "float"):
        return precision.scalar
    if precision is FLOAT64:
        for name, double in _DOUBLE.items():
            if kind is getattr(wp, name):
                return double
    return kind


def translate(
    func: Callable[..., Any],
    precision: Precision,
    resolve: Callable[[Any], Any] = lambda value: value,
    source: str | None = None,
) -> wp.Function:
    """Make a Warp function of ``func`` in ``precision``, with what it names as it is now.

    ``resolve`` maps global and closure values that the law refers to (other laws) to what the
    Warp function should call. The native name is a hash of the source and of those values, so that
    native snippets can call it by name, the kernel cache on disk is found again by the next
    process, and nothing is made twice. ``source`` is the function's, None: as it is in its file.
    """
    cells = dict(zip(func.__code__.co_freevars, func.__closure__ or (), strict=True))
    scope = {**func.__globals__, **{name: cell.cell_contents for name, cell in cells.items()}}
    tree = definition(inspect.getsource(func) if source is None else source)
    rewriter = _Rewriter(precision, scope, resolve)
    tree = rewriter.visit(derivable(tree, lambda node: rewriter.meaning(node) is wp.where))
    source = ast.unparse(tree)
    named = {node.id for node in ast.walk(tree) if isinstance(node, ast.Name)}
    names = func.__globals__.keys() & named - {func.__name__, *func.__code__.co_varnames}
    used = {name: constant(resolve(scope[name]), precision) for name in [*sorted(names), *cells]}
    used |= rewriter.found
    extra = {
        "_float64": wp.float64,
        **{f"_{k}_double": v for k, v in _DOUBLE.items()},
        **{f"_{k}_derived": v for k, v in (_EXTREMES | _CHOICES).items()},
    }
    copy = types.FunctionType(
        func.__code__,
        {**func.__globals__, **used, **extra},
        func.__name__,
        func.__defaults__,
        tuple(types.CellType(used[name]) for name in cells) or None,
    )
    copy.__module__ = func.__module__
    copy.__annotations__ = {}
    hints = {
        name: annotation(parameter.annotation, precision)
        for name, parameter in inspect.signature(func, eval_str=True).parameters.items()
    }
    name = f"law_{func.__name__}_{digest(source, precision.name, *hints.values(), *used.values())}"
    # A law that calls what is derived inside comes behind the adjoints too.
    derives = "grad" in func.__code__.co_names or any(map(is_after_gradients, used.values()))
    return named_function(copy, name, annotations=hints, source=source, after_gradients=derives)


def definition(source: str) -> ast.Module:
    """The syntax of a function's source, without decorators."""
    tree = ast.parse(textwrap.dedent(source))
    if isinstance(tree.body[0], ast.FunctionDef):
        tree.body[0].decorator_list = []
    return tree


def function(func: Callable[..., Any], after_gradients: bool = False) -> wp.Function:
    """Register ``func``, annotated with Warp types, under a native name that repeats in every run.

    The name hashes the source and the closure, by the native names of the functions in it.
    ``after_gradients`` is for functions that call what uses ``wp.grad``, see ``named_function``;
    those that call one of these are too.
    """
    cells = [c.cell_contents for c in func.__closure__ or ()]
    after_gradients = after_gradients or any(map(is_after_gradients, cells))
    content = digest(inspect.getsource(func), *cells, *func.__annotations__.values())
    name = f"{func.__name__}_{content}"
    return named_function(func, name, after_gradients=after_gradients)


def native(
    stub: Callable[..., Any], snippet: str, after_gradients: bool = True,
    adjoint: str | None = None,
) -> wp.Function:  # fmt: skip
    """A function whose body is C++, named after its content like :func:`function`.

    The stub calls the functions that the snippet calls by name: Warp then emits them before it.
    With ``after_gradients`` they may be derived laws. ``adjoint`` is the body of its derivative.
    """
    name = f"{stub.__name__}_{digest(snippet, *stub.__annotations__.values())}"
    return named_function(
        stub, name, snippet=snippet, adjoint=adjoint, after_gradients=after_gradients
    )


def function_from_source(
    source: str, namespace: dict[str, Any], after_gradients: bool = False
) -> wp.Function:
    """Make a Warp function of generated source; ``namespace`` holds the names it refers to."""
    name = re.search(r"def (\w+)\(", source).group(1)
    content = digest(source, *namespace.keys(), *namespace.values())
    after_gradients = after_gradients or any(map(is_after_gradients, namespace.values()))
    func = compiled(source, name, {**namespace, "__name__": __name__})
    return named_function(func, f"{name}_{content}", after_gradients=after_gradients)


KERNELS: list[wp.Kernel] = []  # every kernel built in this process that CUDA can run

kernel = functools.partial(wp.kernel, enable_backward=False, module="unique")


def register(func: Callable[..., Any], cpu_only: bool = False, flags: str = "") -> wp.Kernel:
    """Make a kernel without a backward pass, in a module of its own, and remember it.

    ``cpu_only`` ones hold C++ for the CPU's vector units or threads; CUDA never runs them.
    ``flags`` are for the CPU's compiler, beside those of all kernels.
    """
    options = {}
    if flags:
        all_flags = f"{wp.config.cpu_compiler_flags} {flags}"
        options = {"module_options": {"cpu_compiler_flags": all_flags}}
    made = kernel(func, **options)
    if not cpu_only:
        KERNELS.append(made)
    return made


_STRUCTURES: dict[str, Any] = {}


def structure(name: str, fields: dict[str, Any]) -> Any:
    """A ``wp.struct`` of the given fields, one for the same ones, so kernels are reused."""
    key = digest(name, *fields.keys(), *fields.values())
    if key not in _STRUCTURES:
        plain = type(name, (), {"__annotations__": dict(fields), "__module__": __name__})
        _STRUCTURES[key] = wp.struct(plain)
    return _STRUCTURES[key]
