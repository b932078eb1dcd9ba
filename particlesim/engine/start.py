"""Starting Warp, which by itself says much that nobody asked for."""

from __future__ import annotations

import os
import sys
import tempfile

import warp as wp

# Printed by Warp's C code past every log level; without such a driver there is nothing to mend.
NEEDLESS = "Could not find or load the NVIDIA CUDA driver"


_started = False


def start_warp(verbose: bool = False) -> None:
    """Start Warp without its banner and a line for each module it loads; warnings are shown.

    Only the first call does something. Who has chosen ``wp.config.log_level`` before, or asks by
    ``PARTICLESIM_VERBOSE=1`` in the environment, is shown what was chosen, or all.

    Args:
        verbose: Let it say what it says.
    """
    global _started
    if _started:
        return
    _started = True
    if verbose or os.environ.get("PARTICLESIM_VERBOSE", "0") not in ("", "0"):
        wp.init()
        return
    if wp.config.log_level == wp.LOG_INFO and not getattr(wp.config, "verbose", False):
        wp.config.log_level = wp.LOG_WARNING
    try:
        stream = os.dup(2)
    except OSError:  # a program without a stream for errors
        wp.init()
        return
    with tempfile.TemporaryFile() as printed:
        os.dup2(printed.fileno(), 2)
        try:
            wp.init()
        finally:
            os.dup2(stream, 2)
            os.close(stream)
            printed.seek(0)
            for line in printed.read().decode(errors="replace").splitlines():
                if NEEDLESS not in line:
                    print(line, file=sys.stderr)
