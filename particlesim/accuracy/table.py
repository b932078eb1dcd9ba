"""Tables of sweeps: their text, their numbers, and the files they are written to."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ..output.files import whole


def shown(value: Any, digits: int = 3) -> str:
    """A value as text; ``digits`` of a float."""
    return f"{value:.{digits}g}" if isinstance(value, float) else str(value)


def assignments(values: Mapping[str, Any], digits: int) -> str:
    """Values as ``substeps=5, precision=float32``."""
    return ", ".join(f"{name}={shown(value, digits)}" for name, value in values.items())


def amount(value: float, step: int = 1000) -> str:
    """A number with a prefix, as ``1.23 M``."""
    if not math.isfinite(value):
        return "-"
    for prefix in ("", "k", "M", "G"):
        if abs(value) < 999.5 or prefix == "G":
            break
        value /= step
    binary = "i" if prefix and step == 1024 else ""
    return f"{value:.3g} {prefix.upper() if binary else prefix}{binary}"


def duration(seconds: float) -> str:
    """Seconds with a unit, as ``12.3 us``."""
    if not math.isfinite(seconds):
        return "-"
    for unit, size in (("s", 1.0), ("ms", 1e-3), ("us", 1e-6)):
        if abs(seconds) >= 0.9995 * size:
            return f"{seconds / size:.3g} {unit}"
    return f"{seconds / 1e-9:.3g} ns"


def write(owner: str, path: Path, content: bytes) -> None:
    """Write a file at once or not at all."""
    with whole(owner, path, "What was there before is left as it is.") as part:
        part.write_bytes(content)
