"""The command ``particlesim stress``: its words as arguments of the function."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from types import ModuleType
from typing import Any

from ..accuracy.stress.sweep import stress
from ..accuracy.stress.table import Stress
from .scene_files import parse_options, split_options


def sweep(
    module: ModuleType,
    assignments: Sequence[str],
    show: Callable[[int, int, str], None],
    **how: Any,
) -> Stress:
    """Stress the scene of a module, with ``--set`` words; ``show`` is called before each case."""
    options, knobs = split_options(module, parse_options(assignments))
    settings = module.settings.replace(**knobs)
    return stress(lambda: module.build(**options), settings, progress=show, **how)
