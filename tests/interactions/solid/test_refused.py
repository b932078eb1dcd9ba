"""What is no elastic solid is refused or told, and nobody is one."""

import warnings

import numpy as np
import pytest

import particlesim as ps
from cases.solids import DENSITY, SPACING, block, body, simulation


@pytest.mark.parametrize(
    ("options", "match"),
    [
        ({"poissons_ratio": 0.5}, "poissons_ratio must be below 0.5"),
        ({"poissons_ratio": -1.0}, "poissons_ratio must be above -1"),
        ({"youngs_modulus": 0.0}, "youngs_modulus must be above 0"),
        ({"dimension": 1}, "dimension must be 2 or 3"),
    ],
)
def test_what_is_no_solid(options, match, refused):
    with refused(match):
        body(block(3), **options)


@pytest.mark.parametrize(
    ("x", "options", "match"),
    [
        (block(3, (4, 4, 1), jitter=0.0), {}, "particle 0 has 8 others, none or all in a plane"),
        (block(3, (4, 1, 1), jitter=0.0), {"dimension": 2}, "particle 0 has 2 others.* in a line"),
        (block(3), {"smoothing_length": 0.4 * SPACING}, "particle 0 has 0 others"),
        (np.zeros((1, 3)), {"rest_density": None}, "particle 0 has 0 others"),
        (block(3), {"dimension": 2}, "a plane of constant z"),
        (np.repeat(block(3), 2, axis=0), {}, r"particles \[0, 1\] in one place"),
        (block(3), {"periodic": ((-1, -1, -0.1), (1, 1, 0.4))}, "at most a quarter of the box"),
    ],
    ids=["sheet", "line", "sparse", "one", "not flat", "twice", "narrow"],
)
def test_what_has_no_strain(x, options, match, refused):
    with refused(match):
        simulation(body(x, **options))


def test_a_density_that_does_not_fit_is_told():
    x = block(3, jitter=0.0)
    with pytest.warns(ps.StabilityWarning, match="they fill 0.25 of space; give about 1000"):
        simulation(body(x, rest_density=4 * DENSITY)).run(1)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        simulation(body(x)).run(1)


def test_nobody_and_nobody_free():
    for scene in (body(np.zeros((0, 3))), body(block(3), pinned=True)):
        sim = simulation(scene)
        sim.run(1)
        assert sim.diagnostics().potential[0] == 0.0
