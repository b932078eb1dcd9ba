"""The command ``particlesim tune``: its words as arguments of the function."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Sequence
from types import ModuleType
from typing import Any

from ..accuracy.judging import ERRORS
from ..accuracy.tune.report import Trial, Tuned
from ..accuracy.tune.tuning import tune
from ..output.progress import Meter
from .scene_files import parse_options, split_options
from .tradeoff import parse_vary


def search(
    module: ModuleType,
    assignments: Sequence[str],
    vary: Sequence[str],
    by: str | None,
    meter: Meter,
    **arguments: Any,
) -> Tuned:
    """Run the search that the command line describes; every trial is a line on stderr.

    Args:
        module: The scene's.
        assignments: ``NAME=VALUE`` of what does not vary, and of where to start.
        vary: ``NAME=VALUE,VALUE,...`` of what does.
        by: Name of the error, or None.
        meter: Counts the trials.
        **arguments: Of :func:`tune`.
    """
    if by is not None and by not in ERRORS:
        raise ValueError(
            f"--by must be one of {', '.join(ERRORS)}, got {by!r}; choose one of these."
        )
    options, knobs = split_options(module, parse_options(assignments))

    def show(trial: Trial) -> None:
        meter.done = meter.frames = meter.done + 1
        print(trial, file=sys.stderr, flush=True)

    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        found = tune(
            module.build, by=by, vary=parse_vary(vary), settings=module.settings.replace(**knobs),
            options=options, progress=show, **arguments,
        )  # fmt: skip
    for warning in caught:
        print(f"warning: {' '.join(str(warning.message).split())}", file=sys.stderr)
    return found
