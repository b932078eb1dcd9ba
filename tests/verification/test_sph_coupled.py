"""Fluids and what constraints hold together, against known answers."""

import numpy as np
import pytest

import particlesim as ps
from particlesim.scenes import floating_block, rain_on_cloth

pytestmark = pytest.mark.slow


@pytest.mark.parametrize("spacing", [0.02, 0.01])
def test_a_block_floats_as_deep_as_archimedes_says(spacing):
    """Half as dense as the water, within 3 % of its draught, half of a spacing of 0.01 or less."""
    settings = floating_block.settings
    # A sweep over the distances hands on what each does to the next: more links ask for more.
    finer = round(0.02 / spacing)
    settings = settings.replace(
        substeps=settings.substeps * finer, iterations=settings.iterations * finer
    )
    sim = ps.Simulation(floating_block.build(spacing), settings, device="cpu")
    sim.run(180)
    found = []
    for _ in range(60):  # it bobs once a second, by some per cent still
        sim.step()
        found.append(floating_block.draught(sim))
    assert np.mean(found) == pytest.approx(0.5 * floating_block.HEIGHT, rel=0.03)
    _, wood = sim.scenes[0].groups
    x = sim.position[wood.slice]
    assert np.ptp(x, axis=0)[:2] == pytest.approx([0.4 - spacing, 0.2 - spacing], rel=2e-3)


def test_rain_stays_in_the_cloth():
    """Nothing falls through, and the corners bear it all in the end.

    The cloth's corners are pinned: what they bear is what the rest does not fall by.
    """
    scene = rain_on_cloth.build()
    sim = ps.Simulation(scene, rain_on_cloth.settings, device="cpu")
    sim.run(rain_on_cloth.frames)
    assert rain_on_cloth.error(sim) == 0.0
    moving = scene.mass[~scene.pinned]
    before = (moving @ sim.velocity[~scene.pinned])[1]
    sim.run(30)
    after = (moving @ sim.velocity[~scene.pinned])[1]
    weight = moving.sum() * rain_on_cloth.GRAVITY
    assert abs(after - before) / 0.5 < 0.05 * weight
    # It lies flat: no puddle deeper in the cloth than the drops were high.
    assert sim.diagnostics().kinetic[0] < 1e-3 * weight * 0.3
