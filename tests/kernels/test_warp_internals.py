"""Each private fact about Warp that something rests on; a new Warp fails here first."""

import ctypes
import inspect
import re
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import warp as wp

import particlesim
from particlesim.kernels import warp_internals as internals
from particlesim.kernels.engine.loops import Periodicity
from particlesim.kernels.engine.rows import row_functions
from particlesim.kernels.precision import (
    FLOAT64,
    function,
    function_from_source,
    kernel,
    native,
    structure,
    translate,
)

OPEN = Periodicity()
ROOT = Path(particlesim.__file__).parents[1]
PRIVATE = (
    r"warp\._src|wp\._[a-z]|_wp_\w+_\b|\._shape_|\bnative_func\b|native_snippet|input_types"
    r"|\.adj\b|\.hooks\b|uses_grad_call|linecache|overloaded_annotations|wp\.Function\(|\._dim_"
    r"|wp::|command\.params"
)


def square(x: float):
    return 1.5 * x * x


def square_here(precision=FLOAT64):
    return translate(square, precision)


@pytest.mark.parametrize("folder", ["particlesim", "kernels", "scenes"])
def test_only_one_module_knows_warp_from_inside(folder):
    found = [
        f"{path.relative_to(ROOT)}:{number}: {line.strip()}"
        for path in sorted((ROOT / folder).rglob("*.py"))
        if path.name != "warp_internals.py"
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1)
        if re.search(PRIVATE, line)
    ]
    assert not found


# Functions by name ------------------------------------------------------------------------------


def run(evaluate, values=(0.5, 3.0)):
    """A function of one number at these values, by a kernel on the CPU."""

    @kernel
    def evaluate_rows(x: wp.array(dtype=wp.float64), y: wp.array(dtype=wp.float64)):
        i = wp.tid()
        y[i] = evaluate(x[i])

    x = wp.array(values, dtype=wp.float64, device="cpu")
    y = wp.zeros_like(x)
    wp.launch(evaluate_rows, len(x), [x, y], device="cpu")
    return y.numpy().tolist()


def test_a_name_is_the_native_name_and_one_function():
    law = square_here()
    assert re.fullmatch(r"law_square_[0-9a-f]{12}", internals.native_name(law))
    assert square_here() is law
    assert run(law) == [0.375, 13.5]


def test_native_code_calls_a_law_by_name_without_anybody_else_calling_it():
    law = square_here()

    def twice(x: wp.float64) -> wp.float64:
        law(x)

    snippet = f"return 2.0 * {internals.native_name(law)}(x);"
    assert run(native(twice, snippet, after_gradients=False)) == [0.75, 27.0]


def test_native_code_calls_a_derivative_by_name():
    slope = function_from_source(
        "def slope(x: real):\n    return wp.grad(law)(x)\n",
        {"wp": wp, "law": square_here(), "real": wp.float64},
    )

    def thrice(x: wp.float64) -> wp.float64:
        slope(x)

    assert run(native(thrice, f"return 3.0 * {internals.native_name(slope)}(x);")) == [4.5, 27.0]


def test_what_is_emitted_after_gradients_may_call_a_derivative():
    law = square_here()

    def slope_of(x: wp.float64):
        return wp.grad(law)(x)

    slope = function(slope_of)

    def one_more(x: wp.float64):
        return slope(x) + wp.float64(1.0)

    assert run(function(one_more, after_gradients=True)) == [2.5, 10.0]


def test_what_was_written_in_python():
    def stub(x: wp.float64) -> wp.float64: ...

    assert internals.written_in_python(function(square)) is square
    assert internals.written_in_python(native(stub, "return x;")) is None
    assert internals.written_in_python(wp.sin) is None
    assert internals.written_in_python(square) is None
    assert internals.argument_names(square_here()) == ("x",)


def test_generated_source_can_be_read_again():
    made = internals.compiled("def plus_one(x: float):\n    return x + 1.0\n", "plus_one", {})
    assert "return x + 1.0" in inspect.getsource(made)
    assert made(1.0) == 2.0


def test_a_digest_tells_apart_what_differs():
    fields = {"x": wp.array(dtype=wp.vec3f)}
    parts = [
        *(wp.types.vector(length=n, dtype=t) for n in (4, 5) for t in (wp.float32, wp.float64)),
        *(wp.types.matrix(shape=(n, 3), dtype=wp.float32) for n in (2, 3)),
        wp.array(dtype=wp.vec3f), wp.array(dtype=wp.vec3d), wp.array2d(dtype=wp.vec3f),
        structure("Digested", fields), structure("Digested", {"y": wp.array(dtype=wp.vec3f)}),
        structure("Digested", {"x": wp.array(dtype=wp.vec3d)}),
        *(square_here(precision) for precision in (FLOAT64, particlesim.kernels.precision.FLOAT32)),
        1.0, 2.0, wp.float32, wp.float64,
    ]  # fmt: skip
    assert len({internals.digest(part) for part in parts}) == len(parts)
    assert structure("Digested", dict(fields)) is structure("Digested", fields)


def test_names_are_the_same_in_every_process():
    code = (
        "import warp as wp; wp.config.log_level = wp.LOG_WARNING\n"
        "from particlesim.kernels.engine.rows import row_functions\n"
        "from particlesim.kernels.precision import FLOAT64\n"
        "from particlesim.kernels.engine.loops import Periodicity\n"
        "from particlesim.kernels.warp_internals import native_name\n"
        "made = row_functions(FLOAT64, Periodicity(), True)\n"
        "print(*map(native_name, made))\n"
    )
    here = [internals.native_name(each) for each in row_functions(FLOAT64, OPEN, True)]
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT
    )
    assert done.stdout.split() == here


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


@pytest.mark.parametrize("shape", [(16, 16, 16), (5, 3, 2), (1, 1, 1)])  # most wrap around
def test_runs_of_a_grid_are_its_query(shape):
    def walk(grid: wp.uint64, u: wp.vec3d, row: int, seen: wp.array2d(dtype=int)) -> wp.int32: ...

    visit = "for (int k = begin; k < end; ++k) found[n++] = k;"
    snippet = f"""
    int* found = {internals.elements("seen", "int")} + row * {internals.columns("seen")};
    int n = 0;
    {internals.grid_runs("grid", "u", "double", visit)}
    return n;
"""
    act = native(walk, snippet, after_gradients=False)

    @kernel
    def both(
        grid: wp.uint64, x: wp.array(dtype=wp.vec3d), runs: wp.array2d(dtype=int),
        queried: wp.array2d(dtype=int), count: wp.array2d(dtype=int),
    ):  # fmt: skip
        i = wp.tid()
        count[i, 0] = act(grid, x[i], i, runs)
        for k in range(count[i, 0]):
            runs[i, k] = wp.hash_grid_point_id(grid, runs[i, k])
        n = int(0)
        for j in wp.hash_grid_query(grid, x[i], wp.float64(1.0)):
            queried[i, n] = j
            n += 1
        count[i, 1] = n

    host = np.random.default_rng(0).uniform(-4.0, 9.0, (300, 3))
    x = wp.array(host, dtype=wp.vec3d, device="cpu")
    grid = wp.HashGrid(*shape, device="cpu", dtype=wp.float64)
    grid.build(x, 1.0)
    assert internals.grid_shape(grid) == shape
    runs, queried = (wp.full((300, 300), -1, dtype=int, device="cpu") for _ in range(2))
    count = wp.zeros((300, 2), dtype=int, device="cpu")
    wp.launch(both, 300, [grid.id, x, runs, queried, count], device="cpu")
    assert (count.numpy()[:, 0] == count.numpy()[:, 1]).all()
    assert count.numpy().min() > 0
    # Where cells wrap, the runs begin at another of the same cells.
    np.testing.assert_array_equal(np.sort(runs.numpy()), np.sort(queried.numpy()))
