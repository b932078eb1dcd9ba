"""particlesim: a general particle-physics framework on NVIDIA Warp.

A scene is particles, interactions and constraints; a simulation moves it. The rooms, from the
ground up, each of which knows only those below it:

    kernels         Warp functions and kernels, by the same subjects
    scene           what there is: particles, abstract parts, laws, settings, samples; NumPy only
    engine          model, state, neighbour lists, the loop, integrators, how frames are run
    interactions    forces and heat baths, one file a kind, with what limits its step
    constraints     XPBD, one file a kind, with what limits its step
    instruments     what measures and watches: diagnostics, ledger, watchdog, stability
    output          files: recordings, USD and its tools, histories, surfaces, checkpoints
    pictures        stills, films and the live view
    simulation      Simulation: a face over all of these, and running with a recording
    accuracy        speed against accuracy: trade-offs, tuning, measured numbers, stress
    commands        the command line

Public names are listed in ``__init__.pyi`` and loaded when first used.
"""

import sys
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path

import lazy_loader


def _adopt(name: str) -> None:
    """In a plain checkout kernels and scenes lie beside this folder: import them from there."""
    folder = Path(__file__).parent.parent / name
    if (Path(__file__).parent / name).is_dir() or not folder.is_dir():
        return
    spec = spec_from_file_location(
        f"{__name__}.{name}", folder / "__init__.py", submodule_search_locations=[str(folder)]
    )
    assert spec is not None and spec.loader is not None
    module = sys.modules[spec.name] = module_from_spec(spec)
    spec.loader.exec_module(module)
    globals()[name] = module


_adopt("kernels")
_adopt("scenes")

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
