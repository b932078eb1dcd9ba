"""C++ that names what is inside of Warp's matrices and structs; see :mod:`.warp_internals`."""

from typing import Any

import warp as wp


def matrix(rows: int, columns: int, c: str) -> str:
    """C++: type of a matrix. Rests on: its name."""
    return f"wp::mat_t<{rows},{columns},{c}>"


def entry(name: str, row: int, column: int) -> str:
    """C++: a number of a matrix. Rests on: ``mat_t::data``."""
    return f"{name}.data[{row}][{column}]"


def numbers(struct: Any) -> list[str]:
    """C++: the numbers in a struct of numbers and vectors, each by its place in it.

    Rests on: ``Struct.vars``, whose entries have a ``type``; ``_length_`` of vectors, and ``c``.
    """
    places = []
    for name, field in struct.vars.items():
        vector = wp.types.type_is_vector(field.type)
        places += [f"{name}.c[{k}]" for k in range(field.type._length_)] if vector else [name]
    return places
