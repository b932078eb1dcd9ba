"""What rests on Warp's insides, all of it: elsewhere only Warp's public interface is used.

Every function says which private facts of ``WRITTEN_FOR`` it rests on. Each fact has a test, which
fails first on a Warp that has changed it (tests/kernels/test_warp_*.py), and
:mod:`particlesim.kernels.self_check` tries the fast ways that are built on them once a process.
"""

from __future__ import annotations

import ctypes
import functools
import hashlib
import inspect
import linecache
import textwrap
import threading
from collections.abc import Callable, Mapping
from typing import Any

import warp as wp

WRITTEN_FOR = "1.19"  # of warp-lang


_FUNCTIONS: dict[tuple[Any, ...], wp.Function] = {}


def named_function(
    func: Callable[..., Any],
    name: str,
    *,
    annotations: Mapping[str, Any] | None = None,
    source: str | None = None,
    snippet: str | None = None,
    adjoint: str | None = None,
    after_gradients: bool = False,
) -> wp.Function:
    """The Warp function of that name in native code, the same one for the same name.

    A kernel that calls what is one function by content gets its definition once, also where two
    users made it, each for themselves. ``wp.func`` would number its native names by the order of
    creation: native code could not call them, and the cache of kernels on disk would miss whenever
    that order changed.

    Rests on: the arguments of ``wp.Function``; that ``native_func`` is the name of the generated
    C++ function, unchanged; that a function's module emits C++ forward functions first, then
    adjoints, then the functions marked ``adj.uses_grad_call``, each group in the order in which
    they were first called; that a native function's stub is read like any body, so that what it
    calls is emitted before it; that its return type counts only where its source begins with
    Warp's decorator.

    Args:
        func: Python function; of a native one the stub, which calls what the snippet calls.
        name: Name in native code. It must tell apart what differs, as a hash of the content does.
        annotations: Types of the arguments, in place of those written.
        source: What Warp reads in place of the function's own source.
        snippet: C++ in place of a body. adjoint: And of its derivative.
        after_gradients: Emitted with the functions that use ``wp.grad``, behind the adjoints that
            those call: needed by whoever calls one of them by name.
    """
    key = (name, func.__module__, after_gradients)
    if key not in _FUNCTIONS:
        if snippet is not None:
            source = "@wp.func_native()\n" + textwrap.dedent(inspect.getsource(func))
        made = wp.Function(
            func, key=func.__name__, namespace="", native_func=name, native_snippet=snippet,
            adj_native_snippet=adjoint, module=wp.get_module(func.__module__),
            overloaded_annotations=annotations,
            source=source,
        )  # fmt: skip
        made.adj.uses_grad_call = after_gradients
        _FUNCTIONS[key] = made
    return _FUNCTIONS[key]


def is_after_gradients(value: Any) -> bool:
    """Whether it is a function emitted behind the adjoints. Rests on: ``adj.uses_grad_call``."""
    return getattr(getattr(value, "adj", None), "uses_grad_call", False)


def native_name(function: wp.Function) -> str:
    """Name of a function in native code. Rests on: ``Function.native_func``."""
    return function.native_func


def written_in_python(value: Any) -> Callable[..., Any] | None:
    """The Python function that a Warp function was made of, or None.

    Rests on: ``Function.func`` and ``Function.native_snippet``.
    """
    own = isinstance(value, wp.Function) and value.native_snippet is None
    return value.func if own else None


def returned_types(function: wp.Function) -> list[Any] | None:
    """Types of what a function returns, found by generating its code; None: it is generic.

    Rests on: ``type_is_generic``; ``Function.build`` without a builder, with the options of a
    module; that it sets ``adj.return_var``, whose entries have a ``type``, and builds what the
    function calls. Raises many kinds of errors where the code cannot be generated.
    """
    if any(wp._src.types.type_is_generic(kind) for kind in function.input_types.values()):
        return None
    function.build(None, wp.get_module(__name__).options)
    return [each.type for each in function.adj.return_var or ()]


def source_lines(function: wp.Function) -> tuple[list[str], int]:
    """What Warp reads of a function, and which line, from 1, no code could be generated of.

    Rests on: ``adj.source_lines`` and ``adj.lineno``.
    """
    return function.adj.source_lines, (function.adj.lineno or 0) + 1


def arguments(function: wp.Function) -> dict[str, Any]:
    """Types of a function's arguments by name. Rests on: ``Function.input_types``."""
    return dict(function.input_types)


def compiled(source: str, name: str, scope: dict[str, Any]) -> Callable[..., Any]:
    """The function ``name`` of generated source. Rests on: Warp asks ``inspect`` for sources."""
    filename = f"<particlesim {name} {digest(source)}>"
    scope = dict(scope)
    exec(compile(source, filename, "exec"), scope)
    linecache.cache[filename] = (len(source), None, source.splitlines(keepends=True), filename)
    return scope[name]


def digest(*parts: Any) -> str:
    """Hash of values by what they are, the same in every process.

    Rests on: ``Struct.key`` and ``Struct.hash``; that vector and matrix types share one Python
    name, and tell their length and precision by ``_wp_scalar_type_`` and ``_shape_``.
    """

    def text(value: Any) -> str:
        if isinstance(value, wp.Function):
            return native_name(value)
        if wp.types.type_is_struct(value):
            return value.key + value.hash.hex()
        if isinstance(value, wp.array):
            return f"array{value.ndim} of {text(value.dtype)}"
        if hasattr(value, "_wp_scalar_type_") and isinstance(value, type):
            kind = (value._wp_generic_type_str_, value._wp_scalar_type_, value._shape_)
            return f"{kind[0]} of {kind[1].__name__} {kind[2]}"
        return str(getattr(value, "__qualname__", value))

    return hashlib.sha256("|".join(map(text, parts)).encode()).hexdigest()[:12]


# C++: run the launch whose three addresses ``packed`` points to.
RUN_PACKED = "((void (*)(void*, void*))packed[0])((void*)packed[1], (void*)packed[2])"


class Packed:
    """A recorded CPU launch as three addresses: entry point, bounds and arguments.

    Rests on: ``Launch.hooks.forward``, a ctypes function of two pointers that returns nothing;
    ``Launch.params``, the bounds and then the arguments as ctypes; that the second pointer is to a
    struct of those arguments in the order of ``kernel.adj.args``. ``command`` is that of
    ``wp.launch(..., device="cpu", record_cmd=True)``.

    Raises:
        RuntimeError: The kernel is not loaded: it has no entry point.
    """

    def __init__(self, command: wp.Launch):
        bounds, *values = command.params
        names = [argument.label for argument in command.kernel.adj.args]
        kinds = list(zip(names, map(type, values), strict=True))
        arguments = type("Arguments", (ctypes.Structure,), {"_fields_": kinds})(*values)
        entry = command.hooks.forward and ctypes.cast(command.hooks.forward, ctypes.c_void_p).value
        if not entry:
            raise RuntimeError(
                f"Launch: kernel {command.kernel.key} must have an entry point, got none; Warp has "
                "not loaded its module: clear Warp's kernel cache and start again."
            )
        self.addresses = (entry, ctypes.addressof(bounds), ctypes.addressof(arguments))
        self._kept = (command, bounds, arguments)  # what the addresses point to

    def function(self) -> Callable[[], None]:
        """The launch as a function to call, which lets go of Python's lock."""
        entry, bounds, arguments = self.addresses
        call = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p)(entry)

        def run(_kept: Any = self._kept) -> None:
            call(bounds, arguments)

        return run


# How native functions that do device work begin; others allocate and ask.
WORK = tuple(
    f"wp_{each}"
    for each in "memcpy memset memtile array_ cuda_launch_kernel cpu_launch_kernel hash_grid_up "
    "bvh_re mesh_re mesh_set radix_sort segmented_sort runlength bsr_".split()
)


def doors() -> list[tuple[Any, str, str]]:
    """Where all work that is asked of Warp passes: owner, name, and what goes through.

    ``launch`` and ``write`` are to be recorded, ``native`` is an object of all native functions,
    the others are what a user has written.

    Rests on: Warp looks up ``launch`` and ``copy`` in ``warp`` or ``warp._src.context``, launches
    on a CPU by ``invoke`` there, and calls native functions as members of ``runtime.core``; arrays
    take data of the host by ``_init_from_data``.
    """
    context = wp._src.context
    kinds = dict.fromkeys([*wp.array.__mro__, *wp.indexedarray.__mro__])
    reads = ("numpy", "list", "__dlpack__", "__array_interface__", "__cuda_array_interface__")
    return [
        *[(owner, "launch", "launch") for owner in (wp, context)],
        *[(owner, "copy", "write") for owner in (wp, context)],
        *[(k, n, "write") for k in kinds for n in ("zero_", "fill_") if n in vars(k)],
        *[(k, n, f"array.{n}") for k in kinds for n in reads if n in vars(k)],
        (wp.array, "_init_from_data", "an array made of data"),
        *[
            (context, name, "a launch that cannot be recorded")
            for name in ("invoke", "invoke_cpu_blocks")
        ],
        (context.runtime, "core", "native"),
    ]


class _OfThread:
    """An attribute that each thread has for itself; None where it has not been set."""

    def __init__(self) -> None:
        self.values = threading.local()

    def __get__(self, owner: Any, kind: type) -> Any:
        return getattr(self.values, "value", None)

    def __set__(self, owner: Any, value: Any) -> None:
        self.values.value = value


@functools.cache
def part_captures() -> None:
    """From now on a capture on a CPU holds what its own thread launches, and no other's.

    Rests on: Warp tells a capture under way by ``runtime._apic_capture`` and ``_apic_graph``, of
    all threads; its native code keeps them apart.
    """
    for name in ("_apic_capture", "_apic_graph"):
        setattr(type(wp._src.context.runtime), name, _OfThread())


def elements(array: str, c: str) -> str:
    """C++: pointer to an array's numbers, without gaps. Rests on: ``array_t::data``; vectors."""
    return f"(({c}*){array}.data)"


def columns(array: str) -> str:
    """C++: length of the rows of a two-dimensional array. Rests on: ``array_t::shape``."""
    return f"{array}.shape[1]"


def vector(width: int, c: str) -> str:
    """C++: type of a vector, made of its components and read by ``[]``. Rests on: its name."""
    return f"wp::vec_t<{width},{c}>"


def pointed(array: str, data: str, stride: str) -> str:
    """C++: have an array point to other data. Rests on: ``array_t::data`` and ``strides``."""
    return f"{array}.data = decltype({array}.data)({data}); {array}.strides[0] = {stride};"


def array_fields(kind: Any) -> list[tuple[str, Any]]:
    """Fields of a struct that are arrays of one dimension, with what they hold, or structs.

    Rests on: ``Struct.vars``, whose entries have a ``type``.
    """
    found = []
    for name, each in kind.vars.items():
        if wp.types.type_is_struct(each.type):
            found.append((name, each.type))
        elif isinstance(each.type, wp.array) and each.type.ndim == 1:
            found.append((name, each.type.dtype))
    return found


def numbers_in(kind: Any, scalar: Any) -> int:
    """How many numbers of that type a number or vector is made of; 0: it is something else.

    Rests on: that vector types tell by ``_wp_scalar_type_`` and ``_length_``.
    """
    if kind is scalar:
        return 1
    return kind._length_ if getattr(kind, "_wp_scalar_type_", None) is scalar else 0


def grid_shape(grid: wp.HashGrid) -> tuple[int, int, int]:
    """Cells of a hash grid along its axes. Rests on: ``HashGrid._dim_x`` and so on."""
    return grid._dim_x, grid._dim_y, grid._dim_z
