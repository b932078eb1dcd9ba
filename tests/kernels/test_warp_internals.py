"""Each private fact about Warp that something rests on; a new Warp fails here first."""

import inspect
import re
import subprocess
import sys
from pathlib import Path

import pytest
import warp as wp

import particlesim
from particlesim.kernels import warp_internals as internals
from particlesim.kernels.engine.loops import Periodicity
from particlesim.kernels.engine.neighbors.rows import row_functions
from particlesim.kernels.precision import (
    FLOAT32,
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


SQUARE = translate(square, FLOAT64)


def slope_of_square(x: float):
    return wp.grad(SQUARE)(x)


def twice_the_slope(x: float):
    return 2.0 * slope_of_square(x)


def law_of(value):
    """What a law that names another function calls."""
    return translate(value, FLOAT64) if value is slope_of_square else value


@pytest.mark.parametrize("folder", ["particlesim", "kernels", "scenes"])
def test_only_two_modules_know_warp_from_inside(folder):
    found = [
        f"{path.relative_to(ROOT)}:{number}: {line.strip()}"
        for path in sorted((ROOT / folder).rglob("*.py"))
        if path.name not in ("warp_internals.py", "warp_native.py")
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
    assert re.fullmatch(r"law_square_[0-9a-f]{12}", internals.native_name(SQUARE))
    assert translate(square, FLOAT64) is SQUARE
    assert run(SQUARE) == [0.375, 13.5]


def test_native_code_calls_a_law_by_name_without_anybody_else_calling_it():
    def twice(x: wp.float64) -> wp.float64:
        SQUARE(x)

    snippet = f"return 2.0 * {internals.native_name(SQUARE)}(x);"
    assert run(native(twice, snippet, after_gradients=False)) == [0.75, 27.0]


def test_native_code_calls_a_derivative_by_name():
    slope = function_from_source(
        "def slope(x: real):\n    return wp.grad(law)(x)\n",
        {"wp": wp, "law": SQUARE, "real": wp.float64},
    )

    def thrice(x: wp.float64) -> wp.float64:
        slope(x)

    assert run(native(thrice, f"return 3.0 * {internals.native_name(slope)}(x);")) == [4.5, 27.0]


def test_what_is_emitted_after_gradients_may_call_a_derivative():
    slope = translate(slope_of_square, FLOAT64)

    def one_more(x: wp.float64):
        return slope(x) + wp.float64(1.0)

    assert run(function(one_more, after_gradients=True)) == [2.5, 10.0]


def test_a_law_that_calls_a_derived_one_is_emitted_behind_it():
    inner, outer = translate(slope_of_square, FLOAT64), translate(twice_the_slope, FLOAT64, law_of)
    assert internals.is_after_gradients(inner)
    assert internals.is_after_gradients(outer)
    assert not internals.is_after_gradients(SQUARE)
    assert not internals.is_after_gradients(wp.sin)
    assert run(outer) == [3.0, 18.0]


def test_what_was_written_in_python():
    def stub(x: wp.float64) -> wp.float64: ...

    assert internals.written_in_python(function(square)) is square
    assert internals.written_in_python(native(stub, "return x;")) is None
    assert internals.written_in_python(wp.sin) is None
    assert internals.written_in_python(square) is None
    assert list(internals.arguments(SQUARE)) == ["x"]


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
        *(translate(square, precision) for precision in (FLOAT32, FLOAT64)),
        1.0, 2.0, wp.float32, wp.float64,
    ]  # fmt: skip
    assert len({internals.digest(part) for part in parts}) == len(parts)
    assert structure("Digested", dict(fields)) is structure("Digested", fields)


def test_names_are_the_same_in_every_process():
    code = (
        "import warp as wp; wp.config.log_level = wp.LOG_WARNING\n"
        "from particlesim.kernels.engine.neighbors.rows import row_functions\n"
        "from particlesim.kernels.precision import FLOAT64\n"
        "from particlesim.kernels.engine.loops import Periodicity\n"
        "from particlesim.kernels.warp_internals import native_name\n"
        "made = row_functions(FLOAT64, Periodicity())\n"
        "print(*map(native_name, made))\n"
    )
    here = [internals.native_name(each) for each in row_functions(FLOAT64, OPEN)]
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT
    )
    assert done.stdout.split() == here


def fails(x: float):
    y = 2.0 * x
    return wp.no_such_function(y)


def two(x: float, v: wp.vec3):
    return x, v


def test_code_is_generated_to_find_what_is_returned_and_what_is_wrong():
    assert internals.returned_types(SQUARE) == [wp.float64]
    found = internals.returned_types(translate(two, FLOAT32))
    assert [internals.digest(each) for each in found] == [
        internals.digest(each) for each in (wp.float32, wp.vec3)
    ]
    made = translate(fails, FLOAT32)
    with pytest.raises(AttributeError, match="no_such_function"):
        internals.returned_types(made)
    lines, at = internals.source_lines(made)
    line = lines[at - 1]
    assert line.strip() == "return wp.no_such_function(y)"
