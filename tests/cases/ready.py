"""Ready scenes as the sweeps over all of them take them."""

import pytest

from particlesim.commands.scene_files import ready_scenes

# What others stand for in every run: sod_tube for gases with heat, dam_break for SPH with walls,
# plummer_sphere for gravity, lj_melt for liquids, pile for contacts; these themselves are swept in
# the long one.
LONG = {
    "elliptical_drop", "galaxy_collision", "molten_salt", "phase_transition", "poiseuille",
    "polymer_melt", "polytrope", "sedov_blast", "standing_wave", "star_collision", "taylor_green",
    "toy_star",
}  # fmt: skip


def swept():
    """All ready scenes, as parameters of a test."""
    for name in ready_scenes():
        yield pytest.param(name, marks=[pytest.mark.slow] * (name in LONG))
