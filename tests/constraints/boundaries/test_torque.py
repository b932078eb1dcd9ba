"""Forces and torques on boundaries: moments of weights, and what angular momentum is lost."""

import numpy as np
import pytest

import particlesim as ps

G = 9.81


def test_weights_beside_the_pivot(device, simulate, scene_of):
    """Two weights at rest on a table: sum (x - pivot) x m g, world by world."""
    masses, places = np.array([2.0, 3.0]), np.array([(1, 0.1, 0), (0, 0.1, -2.0)])
    table = ps.PlaneBoundary((0.5, 0, 0), (0, 1, 0))
    scene = scene_of(places, table, radius=0.1, mass=masses, gravity=True)
    sim = simulate(scene, device)
    sim.run(3)
    weights = -G * masses[:, None] * np.array([0, 1.0, 0])
    expected = np.cross(places - [0.5, 0, 0], weights).sum(axis=0)
    # Places are held to round-off, over h^2.
    assert np.allclose(sim.torque(table), expected, rtol=1e-9, atol=1e-9)
    assert np.allclose(sim.force(table), weights.sum(axis=0), rtol=1e-9, atol=1e-9)
    assert sim.torque(sim.constraints[0]).shape == (3,)


@pytest.mark.slow
def test_fluid_presses_beside_the_pivot(device):
    """What the walls bear of torque is what the fluid loses of angular momentum."""
    size, h = 0.1, 0.2
    rng = np.random.default_rng(1)
    x = ps.sample.box((0, 0, 0), (0.6, 0.6, 0.6), size) + rng.uniform(-0.02, 0.02, (216, 3))
    scene = ps.Scene()
    scene.add_particles(x, mass=1100 * size**3)  # compressed
    scene.add_interaction(
        ps.SPH(smoothing_length=h, rest_density=1000.0, equation_of_state=ps.Tait(20.0))
    )
    floor = scene.add_constraint(ps.PlaneBoundary((-1.0, 0, 0.2), (0, 1, 0)))
    sim = ps.Simulation(scene, ps.Settings(dt=1e-5, substeps=1, precision="float64"), device=device)
    force, f = sim.force(floor), sim.get("force")
    assert np.allclose(force, -f.sum(axis=0), rtol=1e-9)
    # Pairs of particles exert no torque on themselves; so this is what the floor takes.
    torque = -np.cross(sim.position - [-1.0, 0, 0.2], f).sum(axis=0)
    # A pair presses where its line to the image crosses the floor, and is counted in its middle:
    # off by less than h / 2 for each, of either sign. Of some 60 pairs a particle 1/10 is left.
    assert np.allclose(sim.torque(floor), torque, atol=0.05 * h * abs(force[1]))


def test_refusals(device, simulate):
    scene = ps.Scene(periodic=((0, None, 0), (4, None, 4)))
    scene.add_particles([(1, 1, 1), (2, 1, 1)])
    floor = scene.add_constraint(ps.PlaneBoundary((0, 0, 0), (0, 1, 0)))
    link = scene.add_constraint(ps.Distance([(0, 1)]))
    sim = simulate(scene, device)
    with pytest.raises(ValueError, match="torque: scene must be open"):
        sim.torque(floor)
    with pytest.raises(ValueError, match="torque: boundary must be a boundary"):
        sim.torque(link)
