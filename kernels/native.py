"""C++ in files of its own: bodies of native functions, and what stands before them."""

from collections.abc import Mapping
from pathlib import Path

from .precision import Precision
from .warp_internals import elements

HERE = Path(__file__).parent


def body(
    path: str, precision: Precision, numbers: Mapping[str, object], arrays: Mapping[str, str],
    macros: Mapping[str, str] | None = None,
) -> str:  # fmt: skip
    """The body of a native function.

    Args:
        path: Of the file, from this folder.
        precision: ``real`` is its scalar.
        numbers: Constants by name: whole numbers, and lists of them or of ``real``s.
        arrays: By the name of a pointer the array that it points to: one of ``real``s, or of what
            the name is written with, as in ``"int* count"``.
        macros: By name and arguments.
    """
    lines = [f"typedef {precision.c} real;"]
    for name, value in numbers.items():
        if isinstance(value, list | tuple):
            kind = "int" if all(isinstance(each, int) for each in value) else "real"
            held = ", ".join(f"({kind}){each!r}" for each in value)
            lines.append(f"static constexpr {kind} {name}[{len(value)}] = {{{held}}};")
        else:
            lines.append(f"constexpr int {name} = {int(value)};")
    for name, array in arrays.items():
        kind, _, short = name.rpartition("* ")
        kind = kind or "real"
        lines.append(f"{kind}* {short} = {elements(array, kind)};")
    names = [name.partition("(")[0] for name in macros or {}]
    lines += [f"#define {name} {text}" for name, text in (macros or {}).items()]
    ends = [f"#undef {name}" for name in names]
    return "\n".join([*lines, (HERE / path).read_text(), *ends, ""])
