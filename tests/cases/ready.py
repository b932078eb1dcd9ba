"""Ready scenes as the sweeps over all of them take them."""

import pytest

from particlesim.commands.scene_files import load_scene, ready_scenes

# Options that make scenes small; the others are.
SMALL = {
    "balloon": {"subdivisions": 1},
    "cloth_drape": {"cells": 12},
    "dam_break": {"spacing": 0.05},
    "elastic_rings": {"spacing": 0.25},
    "elliptical_drop": {"across": 20},
    "floating_block": {"spacing": 0.05},
    "freezing": {"cells": 5},
    "galaxy_collision": {"count": 240, "softening": 0.2},
    "gas_in_a_box": {"count": 300},
    "hydrostatic_tank": {"spacing": 0.1},
    "jelly_stack": {"cubes": 2, "spacing": 0.15},
    "lj_melt": {"cells": 4},
    "molten_salt": {"edge": 4, "tolerance": 1e-4},
    "phase_transition": {"cells": 4},
    "pile": {"count": 100},
    "plummer_sphere": {"count": 240},
    "polymer_melt": {"edge": 6},
    "polytrope": {"count": 300},
    "rain_on_cloth": {"spacing": 0.05},
    "rigid_stack": {"boxes": 3},
    "rising_bubble": {"across": 12},
    "rope_bridge": {"planks": 12},
    "sand_column": {"across": 5, "aspect": 1.0},
    "sedov_blast": {"side": 10},
    "sloshing_tank": {"spacing": 0.05},
    "sod_tube": {"count": 90},
    "splash": {"spacing": 0.05},
    "standing_wave": {"spacing": 1 / 16},
    "star_collision": {"count": 120},
    "taylor_green": {"count": 20},
    "toy_star": {"count": 250},
    "wrecking_ball": {"rows": 3, "columns": 3},
}

# What others stand for in every run: sod_tube for gases with heat, dam_break for SPH with walls,
# plummer_sphere for gravity, lj_melt for liquids, pile for contacts, spring_lattice for solids;
# these themselves are swept in the long one.
LONG = {
    "balloon", "cantilever", "catenary", "cloth_drape", "elastic_rings", "elliptical_drop",
    "floating_block", "freezing", "galaxy_collision", "hydrostatic_tank", "jelly_stack",
    "molten_salt", "newtons_cradle", "phase_transition", "poiseuille", "polymer_melt", "polytrope",
    "rain_on_cloth", "rigid_stack", "rising_bubble", "rope_bridge", "sand_column", "sedov_blast",
    "sloshing_tank", "splash", "standing_wave", "star_collision", "taylor_green", "toy_star",
    "wrecking_ball",
}  # fmt: skip
# Whose kernels nobody shares, and take long to make: all that is done with them is for that run.
LATER = {
    "balloon", "cantilever", "catenary", "cloth_drape", "floating_block", "jelly_stack",
    "newtons_cradle", "poiseuille", "rigid_stack", "rising_bubble", "rope_bridge", "sand_column",
    "sloshing_tank", "splash", "wrecking_ball",
}  # fmt: skip


def every():
    """All ready scenes, as parameters of a test that no other stands for."""
    for name in ready_scenes():
        yield pytest.param(name, marks=[pytest.mark.slow] * (name in LATER))


def swept():
    """All ready scenes, as parameters of a test."""
    for name in ready_scenes():
        yield pytest.param(name, marks=[pytest.mark.slow] * (name in LONG))


def small(name, **options):
    """The module of a ready scene, and its scene as small as tests want it, or with options."""
    module = load_scene(name)
    return module, module.build(**SMALL.get(name, {}) | options)
