"""Ready scenes as the sweeps over all of them take them."""

import pytest

from particlesim.commands.scene_files import ready_scenes

# What others stand for in every run: sod_tube for gases with heat, plummer_sphere for gravity,
# lj_melt for liquids, pile for contacts; these themselves are swept in the long one.
LONG = {
    "galaxy_collision", "molten_salt", "phase_transition", "polymer_melt", "rising_bubble",
    "sedov_blast", "star_collision",
}  # fmt: skip


def swept():
    """All ready scenes, as parameters of a test."""
    for name in ready_scenes():
        yield pytest.param(name, marks=[pytest.mark.slow] * (name in LONG))
