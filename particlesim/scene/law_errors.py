"""What is wrong with a law, told by its own line when a simulation is made."""

from __future__ import annotations

import ast
from typing import Any

import warp as wp

from .. import validate
from ..kernels.precision import Precision, annotation, definition
from ..kernels.warp_internals import digest, returned_types, source_lines

LONGEST = 160  # of what is passed on of Warp's words
# What to do about what Warp says.
REMEDIES = {
    "must be the same": "a number beside floats is written 2.0, not 2",
    "overload": "a number beside floats is written 2.0, not 2, and a vector wp.vec3(...)",
    "Could not find function": "call Warp's functions, as wp.sqrt, and laws",
    "undefined symbol": "define the name before, or give it as a parameter",
}


def check(
    owner: str, source: str, function: wp.Function, precision: Precision, returns: Any = None
) -> None:
    """Refuse a law that Warp cannot compile, or that returns something else.

    Args:
        owner: For errors, whoever uses the law.
        source: Of the law, as it was written.
        function: The same, translated to ``precision``.
        returns: float or a vector type; None: whatever it is.

    Raises:
        ValueError: It shows the line that is wrong; what Warp raised is its cause.
    """
    body = definition(source).body[0]
    assert isinstance(body, ast.FunctionDef)
    name = f"law {body.name}"
    if not _returns(body.body):
        raise validate.fail(
            owner, name, "return a value in every case", _line(source, body.body[-1]),
            "end it with a return",
        )  # fmt: skip
    try:
        found = returned_types(function)
    except Exception as error:  # Warp raises as many kinds as Python
        raise validate.fail(
            owner, name, "be what Warp compiles", _failing(source, function), _reason(error)
        ) from error
    wanted = None if returns is None else annotation(returns, precision)
    if None not in (wanted, found) and list(map(digest, found)) != [digest(wanted)]:
        last = [node for node in ast.walk(body) if isinstance(node, ast.Return)][-1]
        kinds = ", ".join(_word(each) for each in found)
        remedy = "write whole numbers as 2.0" if found == [wp.int32] else f"it returns {kinds}"
        raise validate.fail(owner, name, f"return {_word(wanted)}", _line(source, last), remedy)


def _returns(body: list[ast.stmt]) -> bool:
    """Whether a value is returned however the body is passed through."""
    last = body[-1]
    if isinstance(last, ast.If):
        return _returns(last.body) and bool(last.orelse) and _returns(last.orelse)
    return isinstance(last, ast.Return) and last.value is not None


def _line(source: str, node: ast.AST) -> str:
    return source.splitlines()[getattr(node, "lineno", 1) - 1].strip()


def _failing(source: str, function: wp.Function) -> str:
    """The line of the source that stands where Warp failed in what it was translated to."""
    lines, at = source_lines(function)
    written, read = (
        [node for node in ast.walk(ast.parse(text)) if isinstance(node, ast.stmt)]
        for text in (source, "\n".join(lines))
    )
    for ours, theirs in zip(written, read, strict=True):
        if theirs.lineno <= at <= (theirs.end_lineno or at) and not hasattr(theirs, "body"):
            return _line(source, ours)
    heads = [ours for ours, theirs in zip(written, read, strict=True) if theirs.lineno == at]
    return _line(source, heads[0] if heads else written[0])


def _reason(error: Exception) -> str:
    """What Warp says about the line itself, and what to do about it."""
    said = str(error.args[0] if error.args else error).split("\n;")[-1]
    said = said.partition("\n")[0].partition(". ")[0].rstrip(".")
    remedy = next((text for words, text in REMEDIES.items() if words in said), "")
    said = said if len(said) <= LONGEST else said[: LONGEST - 3] + "..."
    return f"{remedy} (Warp: {said})" if remedy else f"Warp says: {said}"


def _word(kind: Any) -> str:
    """A type as it is written in a law."""
    names = {wp.float32: "a number", wp.float64: "a number", wp.int32: "a whole number"}
    if wp.types.type_is_vector(kind):
        return f"wp.vec{len(kind())}"
    return names.get(kind, getattr(kind, "__name__", str(kind)))
