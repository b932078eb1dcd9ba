"""Rigid clusters on a floor: what touches it are their members, and the whole follows."""

import numpy as np
import pytest

import particlesim as ps


@pytest.mark.slow
@pytest.mark.parametrize(("lean", "falls"), [(17, False), (20, True)])
def test_a_block_tips_over_its_edge(lean, falls, simulate, scene_of):
    """Two masses wide and four high, it leans on its edge without speed: its centre is over the
    edge at atan(0.05 / 0.15) = 18.4 degrees.
    """
    x = ps.sample.box((0, 0, 0), (0.2, 0.4, 0.2), 0.1)
    a = np.radians(lean)
    turn = np.array([[np.cos(a), np.sin(a), 0], [-np.sin(a), np.cos(a), 0], [0, 0, 1]])
    y = (x - x[0]) @ turn.T
    y[:, 1] += 0.05 - y[:, 1].min()
    floor = ps.PlaneBoundary((0, 0, 0), (0, 1, 0), friction=0.8)
    body = ps.ShapeMatching([range(len(x))])
    sim = simulate(scene_of(y, body, floor, gravity=True, radius=0.05), dt=1 / 60, substeps=20)
    sim.run(180)
    height = np.ptp(sim.position[:, 1])
    # A floor holds its members off one by one, after the body: g dt^2 = 7e-6 m.
    assert height == pytest.approx(0.1 if falls else 0.3, abs=2e-3)
