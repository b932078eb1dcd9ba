"""Launches packed for native code, and what native code knows of arrays and grids."""

import ctypes
from types import SimpleNamespace

import numpy as np
import pytest
import warp as wp

from particlesim.kernels import warp_internals as internals
from particlesim.kernels import warp_native as inside
from particlesim.kernels.precision import function, kernel, native

# Packed launches --------------------------------------------------------------------------------


@wp.struct
class Mixed:
    """Fields whose sizes ask for padding."""

    flag: wp.int32
    values: wp.array(dtype=wp.vec3d)
    scale: wp.float64


@kernel
def scaled(
    first: int, mixed: Mixed, shift: wp.float32, box: wp.mat33d, out: wp.array(dtype=wp.vec3d)
):
    i = first + wp.tid()
    out[i] = box * mixed.values[i] * mixed.scale + wp.vec3d(wp.float64(shift))
    if mixed.flag != 7:
        out[i] = wp.vec3d()


def scaled_launch():
    """A launch of rows 2 to 4 of 5, its output and what it is to be."""
    mixed, x = Mixed(), np.arange(15.0).reshape(5, 3)
    mixed.flag, mixed.values, mixed.scale = 7, wp.array(x, dtype=wp.vec3d, device="cpu"), 0.25
    out = wp.zeros(5, dtype=wp.vec3d, device="cpu")
    inputs = [2, mixed, 0.5, wp.mat33d(*np.diag([1.0, 2.0, 4.0]).ravel()), out]
    expected = np.where(np.arange(5)[:, None] < 2, 0.0, x * [0.25, 0.5, 1.0] + 0.5)
    return wp.launch(scaled, 3, inputs, device="cpu", record_cmd=True), out, expected


def test_a_packed_launch_is_the_launch():
    command, out, expected = scaled_launch()
    packed = internals.Packed(command)
    packed.function()()
    assert out.numpy().tolist() == expected.tolist()
    out.zero_()
    entry, bounds, arguments = packed.addresses
    ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p)(entry)(bounds, arguments)
    assert out.numpy().tolist() == expected.tolist()


def test_native_code_runs_a_packed_launch():
    command, out, expected = scaled_launch()

    def run_it(launches: wp.array(dtype=wp.uint64)): ...

    words = internals.elements("launches", "unsigned long long")
    snippet = f"const unsigned long long* packed = {words}; {internals.RUN_PACKED};"
    act = native(run_it, snippet)

    @kernel
    def run_packed(launches: wp.array(dtype=wp.uint64)):
        act(launches)

    packed = internals.Packed(command)
    launches = wp.array(packed.addresses, dtype=wp.uint64, device="cpu")
    wp.launch(run_packed, 1, [launches], device="cpu")
    assert out.numpy().tolist() == expected.tolist()


def test_a_kernel_without_an_entry_point_is_an_error():
    command, _, _ = scaled_launch()
    for nothing in (None, ctypes.CFUNCTYPE(None)(0)):
        command.hooks = SimpleNamespace(forward=nothing)
        with pytest.raises(RuntimeError, match=r"scaled.* must have an entry point, got none; "):
            internals.Packed(command)


# Native code ------------------------------------------------------------------------------------


def test_arrays_in_native_code(precision):
    real, vec3, c = {
        "float32": (wp.float32, wp.vec3f, "float"), "float64": (wp.float64, wp.vec3d, "double"),
    }[precision]  # fmt: skip

    def pick(v: wp.array(dtype=vec3), table: wp.array2d(dtype=real), i: int) -> vec3: ...

    snippet = f"""
    const {c}* numbers = {internals.elements("v", c)};
    const {c} corner = {internals.elements("table", c)}[{internals.columns("table")} + 1];
    {internals.vector(3, c)} result;
    result[0] = numbers[3 * i + 2]; result[1] = corner; result[2] = {internals.columns("table")};
    return result + {internals.vector(3, c)}(0, 0, 1);
"""
    act = native(pick, snippet)

    @kernel
    def pick_rows(v: wp.array(dtype=vec3), table: wp.array2d(dtype=real), o: wp.array(dtype=vec3)):
        i = wp.tid()
        o[i] = act(v, table, i)

    v = wp.array(np.arange(6.0).reshape(2, 3), dtype=vec3, device="cpu")
    table = wp.array(np.arange(8.0).reshape(2, 4), dtype=real, device="cpu")
    out = wp.zeros(2, dtype=vec3, device="cpu")
    wp.launch(pick_rows, 2, [v, table, out], device="cpu")
    assert out.numpy().tolist() == [[2.0, 5.0, 5.0], [5.0, 5.0, 5.0]]


@wp.struct
class Fields:
    """Arrays of one dimension and of two, a number and a struct of arrays."""

    x: wp.array(dtype=wp.vec3d)
    table: wp.array2d(dtype=wp.float64)
    count: wp.int32


@wp.struct
class Outer:
    """A struct that holds another one."""

    part: Fields
    mark: wp.array(dtype=wp.int32)


def test_arrays_of_structs_are_known():
    assert internals.array_fields(Fields) == [("x", wp.vec3d)]
    (name, kind), mark = internals.array_fields(Outer)
    assert name == "part" and internals.array_fields(kind) == [("x", wp.vec3d)]
    assert mark == ("mark", wp.int32)
    vec5 = wp.types.vector(5, wp.float64)
    kinds = (wp.float64, wp.vec3d, vec5, wp.float32, wp.vec3f, wp.int32)
    assert [internals.numbers_in(kind, wp.float64) for kind in kinds] == [1, 3, 5, 0, 0, 0]


def test_an_array_may_point_to_what_native_code_has_made():
    def second(i: int, a: wp.array(dtype=wp.vec3d)) -> wp.vec3d:
        return a[i]

    read = function(second)

    def copied(given: wp.array(dtype=wp.vec3d)) -> wp.vec3d:
        read(0, given)

    snippet = f"""
    double copy[6];
    for (int k = 0; k < 6; ++k) copy[k] = 10.0 * {internals.elements("given", "double")}[k];
    auto local = given;
    {internals.pointed("local", "copy", "3 * sizeof(double)")}
    return {internals.native_name(read)}(1, local);
"""
    act = native(copied, snippet)

    @kernel
    def look(given: wp.array(dtype=wp.vec3d), out: wp.array(dtype=wp.vec3d)):
        out[0] = act(given)

    given = wp.array(np.arange(6.0).reshape(2, 3), dtype=wp.vec3d, device="cpu")
    out = wp.zeros(1, dtype=wp.vec3d, device="cpu")
    wp.launch(look, 1, [given, out], device="cpu")
    assert out.numpy().tolist() == [[30.0, 40.0, 50.0]]


# Matrices and structs ---------------------------------------------------------------------------


@wp.struct
class Item:
    """Numbers and a vector between them."""

    before: wp.float64
    side: wp.vec3d
    after: wp.float64


def test_native_code_reads_matrices_and_structs_number_by_number():
    Two = wp.types.matrix((2, 3), wp.float64)
    places = inside.numbers(Item)
    assert places == ["before", "side.c[0]", "side.c[1]", "side.c[2]", "after"]
    total = " + ".join(f"{n + 1} * given.data[0].{place}" for n, place in enumerate(places))

    def sum_of(
        given: wp.array(dtype=Item), m: wp.types.matrix((2, 3), wp.float64)
    ) -> wp.float64: ...

    snippet = f"""
    {inside.matrix(2, 3, "double")} twice;
    {inside.entry("twice", 1, 2)} = 2.0 * {inside.entry("m", 1, 2)};
    return {total} + twice.data[1][2];
"""
    function = native(sum_of, snippet)

    @kernel
    def look(given: wp.array(dtype=Item), out: wp.array(dtype=wp.float64)):
        m = Two()
        m[1, 2] = wp.float64(50.0)
        out[0] = function(given, m)

    item = Item()
    item.before, item.side, item.after = 1.0, wp.vec3d(2.0, 3.0, 4.0), 5.0
    out = wp.zeros(1, dtype=wp.float64, device="cpu")
    wp.launch(look, 1, [wp.array([item], dtype=Item, device="cpu"), out], device="cpu")
    assert out.numpy().tolist() == [1.0 + 2 * 2.0 + 3 * 3.0 + 4 * 4.0 + 5 * 5.0 + 100.0]
