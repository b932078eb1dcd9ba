"""The machine: what figures were measured on, without which they say little."""

from __future__ import annotations

import os
import platform
import re
import shutil
import subprocess
from importlib import metadata
from pathlib import Path
from typing import Any

import warp as wp

from ...engine.execution.executors import available_threads

BUSY = 0.25  # load a core, before anything has started, from which figures are worth little


def machine() -> dict[str, Any]:
    """Processor, cores, system, devices and versions."""
    names = ("particlesim", "warp-lang", "numpy")
    return {
        "processor": _processor(),
        "cores": available_threads(),
        "load": os.getloadavg()[0] if hasattr(os, "getloadavg") else None,
        "system": platform.platform(),
        "python": platform.python_version(),
        "devices": [f"{each.alias} {each.name}" for each in wp.get_devices() if each.is_cuda],
        "versions": {name: version_of(name) for name in names},
    }


def describe(facts: dict[str, Any]) -> str:
    """The machine in a few lines."""
    versions = ", ".join(f"{name} {version}" for name, version in facts["versions"].items())
    devices = "".join(f", {each}" for each in facts["devices"])
    load = "" if facts["load"] is None else f", load {facts['load']:.1f} at the start"
    lines = [
        f"{facts['processor']}, {facts['cores']} cores{devices}{load}",
        f"Python {facts['python']}, {versions}",
    ]
    if (facts["load"] or 0.0) > BUSY * facts["cores"]:
        lines.append("others are at work here: threads that wait for each other suffer most")
    return "\n".join(lines)


def _processor() -> str:
    """Its name, where the system tells it."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        lines = []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor() or platform.machine()


def version_of(need: str) -> str:
    """The version of an installed package or program; empty if it does not tell."""
    try:
        return metadata.version(need)
    except metadata.PackageNotFoundError:
        pass
    if shutil.which(need) is None:
        return ""
    told = subprocess.run([need, "--version"], capture_output=True, check=False)
    text = (told.stdout + told.stderr).decode(errors="replace")
    found = re.search(r"version\W*(\S*\d\S*)", text, re.IGNORECASE)
    return found.group(1) if found else ""
