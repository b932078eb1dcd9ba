"""USD: recordings of simulations, and tools for what is in such files.

``recorder`` and ``drawing`` say what of a simulation is shown, and ``writing`` puts it into files.
``recording`` reads any USD file; ``info``, ``pack`` and ``checking`` are made of it.
"""

import importlib

from ..interrupts import Deferred

# USD swallows what a handler of signals raises while its libraries are being loaded.
with Deferred():
    for name in ("UsdGeom", "UsdUtils"):
        importlib.import_module(f"pxr.{name}")
