"""One source for both precisions: the types of a precision, and laws translated to it.

Float literals and ``float`` annotations mean float32 to Warp. :func:`translate` rewrites a law
written in plain Python for the precision at hand, so that one law serves both.
"""

from __future__ import annotations

import ast
import functools
import hashlib
import inspect
import linecache
import math
import re
import textwrap
import types
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import warp as wp
from warp._src.codegen import Struct

from .extremes import larger, smaller, within

# Generic names that a law may use, and what they become in float64.
_DOUBLE = {
    name: getattr(wp, f"{name}d")
    for name in ("vec2", "vec3", "vec4", "mat22", "mat33", "mat44", "quat")
}
_DOUBLE["float32"] = wp.float64
# What laws call in place of Warp's own, so that their derivatives vectorise.
_EXTREMES = {"max": larger, "min": smaller, "clamp": within}


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

    Attributes that are numbers (``math.pi``) become literals, so that a law's source says all.
    """

    def __init__(self, precision: Precision, scope: dict[str, Any]):
        self.double, self.scope = precision is FLOAT64, scope

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
        owner = self._meaning(node.value)
        value = getattr(owner, node.attr, None)
        if isinstance(value, float | int):
            # Infinities and NaN have no literal, and are the same in both precisions.
            known = ast.copy_location(ast.Constant(value), node) if math.isfinite(value) else node
            return self._number(known) if isinstance(value, float) else known
        if self.double and owner is wp and node.attr in _DOUBLE:
            return _name(f"_{node.attr}_double", node)
        if owner is wp and node.attr in _EXTREMES:
            return _name(f"_{node.attr}_derived", node)
        return node if owner is not None else self.generic_visit(node)

    def _meaning(self, node: ast.AST) -> Any:
        """What a dotted name stands for outside the law, or None."""
        if isinstance(node, ast.Attribute):
            return getattr(self._meaning(node.value), node.attr, None)
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
) -> wp.Function:
    """Make a Warp function of ``func`` in ``precision``.

    ``resolve`` maps global and closure values that the law refers to (other laws) to what the
    Warp function should call. The native name is a hash of the source, so that native snippets
    can call it by name and the kernel cache on disk is found again by the next process.
    """
    cells = dict(zip(func.__code__.co_freevars, func.__closure__ or (), strict=True))
    scope = {**func.__globals__, **{name: cell.cell_contents for name, cell in cells.items()}}
    source = _rewritten(func, precision, scope)
    names = func.__globals__.keys() & set(func.__code__.co_names) - {func.__name__}
    used = {name: constant(resolve(scope[name]), precision) for name in [*sorted(names), *cells]}
    extra = {
        "_float64": wp.float64,
        **{f"_{k}_double": v for k, v in _DOUBLE.items()},
        **{f"_{k}_derived": v for k, v in _EXTREMES.items()},
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
    digest = _digest(source, precision.name, *hints.values(), *used.values())
    return _made_once(
        copy,
        f"law_{func.__name__}_{digest}",
        # A law that calls what is derived inside comes behind the adjoints too.
        "grad" in func.__code__.co_names
        or any(isinstance(v, wp.Function) and v.adj.uses_grad_call for v in used.values()),
        module=wp.get_module(func.__module__),
        overloaded_annotations=hints,
        source=source,
    )


_FUNCTIONS: dict[tuple[Any, ...], wp.Function] = {}


def _made_once(
    func: Callable[..., Any], native_func: str, after_gradients: bool = False, **options: Any
) -> wp.Function:
    """The Warp function of that native name, the same one for the same name.

    A kernel that calls what is one function by content gets its definition once, also where two
    users made it, each for themselves.
    """
    key = (native_func, func.__module__, after_gradients)
    if key not in _FUNCTIONS:
        made = wp.Function(
            func, key=func.__name__, namespace="", native_func=native_func, **options
        )
        made.adj.uses_grad_call = after_gradients
        _FUNCTIONS[key] = made
    return _FUNCTIONS[key]


def _rewritten(func: Callable[..., Any], precision: Precision, scope: dict[str, Any]) -> str:
    """The source of ``func`` in ``precision``, without decorators."""
    tree = ast.parse(textwrap.dedent(inspect.getsource(func)))
    definition = tree.body[0]
    if isinstance(definition, ast.FunctionDef):
        definition.decorator_list = []
    return ast.unparse(_Rewriter(precision, scope).visit(tree))


def _digest(*parts: Any) -> str:
    """Hash of values by what they are, the same in every process."""

    def text(value: Any) -> str:
        if isinstance(value, wp.Function):
            return value.native_func
        if isinstance(value, Struct):
            return value.key + value.hash.hex()
        if isinstance(value, wp.array):
            return f"array{value.ndim} of {text(value.dtype)}"
        if hasattr(value, "_wp_scalar_type_") and isinstance(value, type):
            # Vector types of any length and precision share one Python name.
            kind = (value._wp_generic_type_str_, value._wp_scalar_type_, value._shape_)
            return f"{kind[0]} of {kind[1].__name__} {kind[2]}"
        return str(getattr(value, "__qualname__", value))

    return hashlib.sha256("|".join(map(text, parts)).encode()).hexdigest()[:12]


def function(func: Callable[..., Any], after_gradients: bool = False) -> wp.Function:
    """Register ``func``, annotated with Warp types, under a native name that repeats in every run.

    ``wp.func`` numbers its native names by the order of creation; functions that native snippets
    call by name would then miss the kernel cache whenever that order changes. The name hashes
    the source and the closure, by the native names of the functions in it.

    ``after_gradients`` has Warp emit it together with the functions that use ``wp.grad``, which
    it may then call.
    """
    cells = [c.cell_contents for c in func.__closure__ or ()]
    digest = _digest(inspect.getsource(func), *cells, *func.__annotations__.values())
    return _made_once(
        func,
        f"{func.__name__}_{digest}",
        after_gradients,
        module=wp.get_module(func.__module__),
    )


def native(stub: Callable[..., Any], snippet: str, after_gradients: bool = True) -> wp.Function:
    """A function whose body is C++, named after its content like :func:`function`.

    ``after_gradients`` has Warp emit it together with the functions that use ``wp.grad``, behind
    the adjoints that those call, so that the snippet may call a derived law by name.
    """
    digest = _digest(snippet, *stub.__annotations__.values())
    return _made_once(
        stub,
        f"{stub.__name__}_{digest}",
        after_gradients,
        module=wp.get_module(stub.__module__),
        native_snippet=snippet,
        # Warp honours the return type only where it reads its own decorator in the source.
        source="@wp.func_native()\n" + textwrap.dedent(inspect.getsource(stub)),
    )


KERNELS: list[wp.Kernel] = []  # every kernel built in this process that CUDA can run

kernel = functools.partial(wp.kernel, enable_backward=False, module="unique")


def register(func: Callable[..., Any], cpu_only: bool = False) -> wp.Kernel:
    """Make a kernel without a backward pass, in a module of its own, and remember it.

    ``cpu_only`` ones hold C++ for the CPU's vector units or threads; CUDA never runs them.
    """
    made = kernel(func)
    if not cpu_only:
        KERNELS.append(made)
    return made


def structure(name: str, fields: dict[str, Any]) -> Any:
    """A ``wp.struct`` of the given fields."""
    return wp.struct(type(name, (), {"__annotations__": dict(fields), "__module__": __name__}))


def function_from_source(
    source: str, namespace: dict[str, Any], after_gradients: bool = False
) -> wp.Function:
    """Make a Warp function of generated source; ``namespace`` holds the names it refers to."""
    name = re.search(r"def (\w+)\(", source).group(1)
    digest = _digest(source, *namespace.keys(), *namespace.values())
    filename = f"<particlesim {name} {digest}>"
    scope = dict(namespace)
    exec(compile(source, filename, "exec"), scope)
    # Warp reads the source back through inspect, which asks linecache.
    linecache.cache[filename] = (len(source), None, source.splitlines(keepends=True), filename)
    module = wp.get_module(__name__)
    return _made_once(scope[name], f"{name}_{digest}", after_gradients, module=module)
