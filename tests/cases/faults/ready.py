"""Controls that are the ready scenes, as they are and in other settings."""

import importlib
from functools import partial

import numpy as np

from particlesim.commands.scene_files import ready_scenes

from ..ready import LONG
from .judge import Row, whole

SMALL = {
    "dam_break": {"spacing": 0.06},
    "star_collision": {"count": 120},
    "sod_tube": {"count": 90},
    "sedov_blast": {"side": 10},
    "plummer_sphere": {"count": 240},
    "galaxy_collision": {"count": 240, "softening": 0.2},
    "freezing": {"cells": 4},
    "lj_melt": {"cells": 4},
    "molten_salt": {"edge": 4, "tolerance": 1e-4},
    "phase_transition": {"cells": 4},
    "gas_in_a_box": {"count": 300},
    "polymer_melt": {"edge": 6},
    "sloshing_tank": {"spacing": 0.05},
}
FRAMES = {"three_body": 20, "triple_pendulum": 20}


def sane(done):
    """All is finite and nobody has left the scene by a hundred times its size."""
    size = np.ptp(done.x[0], axis=0).max()
    return whole(np.abs(done.x - done.x[0]).max() / (100 * size))


def rows():
    for name in ready_scenes():
        module = importlib.import_module(f"particlesim.scenes.{name}")
        for short, knobs in (
            ("", {}),
            (", in double precision", {"precision": "float64"}),
            (", in twice the substeps", {"substeps": 2 * module.settings.substeps}),
        ):
            settings = {**module.settings.plain, **knobs}
            if knobs.get("precision") == module.settings.precision:
                continue
            yield Row(
                f"{name}{short}",
                partial(module.build, **SMALL.get(name, {})),
                sane,
                FRAMES.get(name, 40),
                settings,
                slow=bool(knobs) or name in LONG,
            )
