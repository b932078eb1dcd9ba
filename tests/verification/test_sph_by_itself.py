"""What a fluid and a box do by themselves, with nothing set by hand."""

import pathlib
import re

import numpy as np
import pytest

import particlesim as ps
from particlesim.interactions.fluid.smoothing import SMOOTHING
from particlesim.scenes import dam_break

pytestmark = pytest.mark.slow

README = (pathlib.Path(__file__).parents[2] / "README.md").read_text()


@pytest.mark.parametrize("smoothing", SMOOTHING)
def test_a_weightless_block_stays_as_it_is(smoothing):
    """The equation of state takes the lattice's own sum for rest: nothing presses at any h."""
    spacing = 0.025
    x = ps.sample.box((0, 0, 0), (0.25, 0.25, 0.25), spacing)
    for ratio in (1.2, 1.4, 1.6, 1.8, 2.0):
        scene = ps.Scene()
        scene.add_particles(x, mass=1000 * spacing**3)
        scene.add_interaction(
            ps.SPH(smoothing_length=ratio * spacing, rest_density=1000.0, smoothing=smoothing,
                   equation_of_state=ps.Tait(45.0))
        )  # fmt: skip
        sim = ps.Simulation(scene, ps.Settings(substeps=40), device="cpu")
        sim.run(60)
        assert np.ptp(sim.position, axis=0) == pytest.approx(np.full(3, 0.225), rel=0.01)


def left_on_walls(sim, x_most, y_least):
    """Part of the particles that are near a wall, above the water by far, and hardly move."""
    x, v = sim.position, np.linalg.norm(sim.velocity, axis=1)
    return float(((x[:, 0] < x_most) & (x[:, 1] > y_least) & (v < 0.3)).mean())


@pytest.mark.parametrize("spacing", [0.025, 0.0106])
def test_no_curtain_stays_on_the_wall(spacing):
    """Two seconds after the dam broke, of 8 000 and of 100 000 equal drops."""
    scene = dam_break.build(spacing=spacing)
    substeps = int(np.ceil(dam_break.settings.substeps * 0.025 / spacing))
    sim = ps.Simulation(scene, dam_break.settings.replace(substeps=substeps), device="cpu")
    sim.run(120)
    # The water stands 0.1 m deep on average, and sloshes.
    assert left_on_walls(sim, 0.1, 0.4) < 1e-3


def test_the_ten_lines_of_the_readme_are_its_picture():
    """Mean height within 5 % of that of the scene, which makes the picture."""
    (lines,) = re.findall(r"## Ten lines\n\n```python\n(.*?)```", README, re.DOTALL)
    lines = lines.replace("ps.Settings(dt=1 / 60, substeps=24))", "SETTINGS, device='cpu')")
    lines = lines.split("sim.run(")[0]
    names = {"SETTINGS": ps.Settings(dt=1 / 60, substeps=24)}
    exec(lines, names)
    own, ready = names["sim"], ps.Simulation(dam_break.build(), dam_break.settings, device="cpu")
    heights = []
    for sim in (own, ready):
        sim.run(100)
        height = 0.0
        for _ in range(40):  # over the slosh
            sim.step()
            height += sim.position[:, 1].mean() / 40
        heights.append(height)
    assert heights[0] == pytest.approx(heights[1], rel=0.05)
    assert heights[1] == pytest.approx(0.1, rel=0.3)  # at rest it is half of 0.2
