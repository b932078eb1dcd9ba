"""The command ``particlesim tradeoff``: its words as arguments of the function."""

from __future__ import annotations

import inspect
import sys
import warnings
from collections.abc import Sequence
from pathlib import Path
from types import ModuleType
from typing import Any

from ..accuracy.judging import ERRORS
from ..accuracy.tradeoff import output, plot
from ..accuracy.tradeoff.sweep import tradeoff
from ..accuracy.tradeoff.table import Tradeoff
from ..output.progress import Meter
from .scene_files import label, parse_options, split_options


def parse_vary(assignments: Sequence[str]) -> dict[str, list[Any]]:
    """``["substeps=1,2,5", ...]`` as a dict of lists; a value is what it is in ``--set``.

    Raises:
        ValueError: No ``=``, no name, no value, or a name given twice.
    """
    vary: dict[str, list[Any]] = {}
    for assignment in assignments:
        name, equals, text = assignment.partition("=")
        name = name.strip().replace("-", "_")
        words = [word.strip() for word in split_list(text)]
        if not equals or not name.isidentifier() or not all(words):
            raise ValueError(
                f"--vary must be NAME=VALUE,VALUE,..., got {assignment!r}; "
                "write --vary substeps=1,2,5."
            )
        if name in vary:
            raise ValueError(f"--vary must name a knob once, got {name!r} twice; join the lists.")
        vary[name] = [parse_options([f"{name}={word}"])[name] for word in words]
    return vary


def split_list(text: str) -> list[str]:
    """Split at the commas that are outside brackets."""
    words, depth = [""], 0
    for sign in text:
        depth += (sign in "([{") - (sign in ")]}")
        if sign == "," and depth == 0:
            words.append("")
        else:
            words[-1] += sign
    return words


def check_outputs(files: dict[str, Path | None], overwrite: bool) -> None:
    """Find out before a long sweep what would stop it from being written."""
    for option, path in files.items():
        if path is None:
            continue
        formats = plot.FORMATS if option == "--plot" else output.FORMATS
        if path.suffix.lower() not in formats:
            raise ValueError(
                f"{option} must end in {', '.join(formats)}, got {str(path)!r}; "
                "choose one of these."
            )
        if path.exists() and not overwrite:
            raise ValueError(
                f"{option} must be a new file, got {str(path)!r}, which exists; "
                "choose another or give --overwrite."
            )
        if option == "--plot":
            plot.figure_class()


def sweep(
    module: ModuleType,
    assignments: Sequence[str],
    vary: Sequence[str],
    error: str | None,
    reference: Sequence[str],
    meter: Meter,
    **arguments: Any,
) -> Tradeoff:
    """Run the sweep that the command line describes.

    Args:
        module: The scene's.
        assignments: ``NAME=VALUE`` of what does not vary.
        vary: ``NAME=VALUE,VALUE,...`` of what does.
        error: Name of the error, or None.
        reference: ``NAME=VALUE`` of the reference.
        meter: Counts the frames.
        **arguments: Of :func:`tradeoff`.
    """
    if error is not None and error not in ERRORS:
        raise ValueError(
            f"--error must be one of {', '.join(ERRORS)}, got {error!r}; choose one of these."
        )
    varied = parse_vary(vary)
    if not varied:
        raise ValueError(
            "--vary must be given, got nothing; write --vary substeps=1,2,5, and repeat it for "
            "further knobs."
        )
    fixed = parse_options(assignments)
    # An option that build needs is set by being varied.
    needed = [name for name in inspect.signature(module.build).parameters if name in varied]
    options, knobs = split_options(module, {**{n: varied[n][0] for n in needed}, **fixed})
    counted = meter.count(label(module), at_last="reference")
    with counted as progress, warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        table = tradeoff(
            module.build,
            varied,
            error=error,
            reference=parse_options(reference) or None,
            settings=module.settings.replace(**knobs),
            options={name: value for name, value in options.items() if name in fixed},
            progress=progress,
            **arguments,
        )
    for warning in caught:
        print(f"warning: {' '.join(str(warning.message).split())}", file=sys.stderr)
    return table


def write(table: Tradeoff, picture: Path | None, file: Path | None) -> None:
    """Write what was asked for; that it may be replaced has been checked."""
    if file is not None:
        table.save(file, overwrite=True)
    if picture is not None:
        table.plot(picture, overwrite=True)
