"""Controls that are the ready scenes, as they are and in other settings."""

from functools import partial

import numpy as np

from particlesim.commands.scene_files import load_scene, ready_scenes

from ..ready import LONG, SMALL
from .judge import Row, whole

FRAMES = {"three_body": 20, "triple_pendulum": 20}
# Of which the other sweeps over ready scenes would tell first.
ELSEWHERE = {"dam_break", "gas_in_a_box", "plummer_sphere", "sod_tube", "wave_field"}


def sane(done):
    """All is finite and nobody has left the scene by a hundred times its size."""
    size = np.ptp(done.x[0], axis=0).max()
    return whole(np.abs(done.x - done.x[0]).max() / (100 * size))


def rows():
    for name in ready_scenes():
        module = load_scene(name)
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
                slow=bool(knobs) or name in LONG | ELSEWHERE,
            )
