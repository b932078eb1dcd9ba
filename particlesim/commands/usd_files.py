"""The commands ``particlesim usd info | check | pack``."""

from __future__ import annotations

from pathlib import Path

from ..output.usd.checking.check import check
from ..output.usd.info import info
from ..output.usd.pack import pack


def show(path: Path) -> str:
    """What is inside a file, as text."""
    return str(info(path))


def complaints(path: Path) -> list[str]:
    """One line a fault."""
    return [str(fault) for fault in check(path)]


def packed(path: Path, out: Path, overwrite: bool) -> str:
    """Pack, and say what was done."""
    frames = pack(path, out, overwrite=overwrite)
    return f"{frames} frames of {path} written to {out}, {out.stat().st_size:,} bytes"
