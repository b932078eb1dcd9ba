"""Ready scenes as the sweeps over all of them take them."""

import pytest

from particlesim.commands.scene_files import ready_scenes

# What others stand for in every run: sod_tube for gases with heat, plummer_sphere for gravity,
# lj_melt for liquids, pile for contacts; these themselves are swept in the long one.
LONG = {
    "galaxy_collision", "molten_salt", "phase_transition", "polymer_melt", "sedov_blast",
    "sloshing_tank", "star_collision",
}  # fmt: skip
# Whose kernels nobody shares, and take long to make: all that is done with them is for that run.
LATER = {"sloshing_tank"}


def every():
    """All ready scenes, as parameters of a test that no other stands for."""
    for name in ready_scenes():
        yield pytest.param(name, marks=[pytest.mark.slow] * (name in LATER))


def swept():
    """All ready scenes, as parameters of a test."""
    for name in ready_scenes():
        yield pytest.param(name, marks=[pytest.mark.slow] * (name in LONG))
