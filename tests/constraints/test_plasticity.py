"""Rods, ropes, hinges and wires that yield: what stays of a strain, and how fast it came."""

import numpy as np
import pytest

import particlesim as ps

from ..cases.worlds import equal_alone, goes_on_after_reset_and_save


def lengths(sim):
    x = sim.position
    return np.linalg.norm(x[1::2] - x[::2], axis=1)


def pairs(strains, **particles):
    """Pairs along x of these strains, for a length of 1."""
    scene = ps.Scene()
    ends = [(x, 2 * n, 0) for n, each in enumerate(strains) for x in (0.0, 1.0 + each)]
    scene.add_particles(ends, **particles)
    return scene, np.arange(len(ends)).reshape(-1, 2)


def damped(rows, **plastic):
    """Rods that come to rest within seconds: critically damped, of reduced mass 1/2, k = 1."""
    return ps.Distance(rows, 1.0, compliance=1.0, damping=np.sqrt(2), **plastic)


def test_a_rod_that_is_left_alone(simulate):
    """Pulled or pressed by 3 %, with a yield of 1 %, 2 % stay; of less than the yield nothing."""
    strains = [0.03, -0.03, 0.009, 0.5]
    scene, rows = pairs(strains)
    scene.add_constraint(damped(rows, yield_strain=0.01, creep=1e6, largest_strain=0.1))
    sim = simulate(scene)
    sim.run(3000)  # 21 decay times
    # It yields at the end of the first substep, when the strain is a part k dt^2 / mu = 2e-4 less.
    assert lengths(sim) == pytest.approx([1.02, 0.98, 1.0, 1.1], abs=2e-4 * 0.03)


@pytest.mark.filterwarnings("ignore:.*(pins|Distance) must")
def test_how_fast_it_flows(simulate):
    """Held at a strain: (s - y) (1 - exp(-creep t)), whatever the substep."""
    scene, rows = pairs([0.03, -0.2, 0.5], pinned=True)
    yields = np.array([0.01, 0.05, 0.0])
    scene.add_constraint(damped(rows, yield_strain=yields, creep=3.0, largest_strain=0.4))
    sim = simulate(scene)
    sim.run(7)
    expected = np.array([0.02, -0.15, 0.5]) * (1 - np.exp(-3.0 * 0.07))
    assert sim.constraints[0].permanent.numpy() == pytest.approx(expected, rel=1e-12)
    sim.run(1000)
    assert sim.constraints[0].permanent.numpy() == pytest.approx([0.02, -0.15, 0.4], rel=1e-12)


def test_what_cannot_yield(refused):
    with refused(r"compliance\[0\]"):
        ps.Distance([(0, 1)], 1.0, yield_strain=0.1)
    with refused("yield_strain"):
        damped([(0, 1)], yield_strain=-0.1)
    with refused("creep"):
        damped([(0, 1)], yield_strain=0.1, creep=-1.0)
    with refused("largest_angle"):
        ps.Bending([(0, 1, 2, 3)], 0.0, compliance=1.0, yield_angle=0.1, largest_angle=-1.0)
    with refused("yield_strain"):
        damped([(0, 1)], yield_strain=0.1).as_force()


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:.*pins must")
def test_ropes_and_struts_yield_one_way(simulate):
    """A rope as it is pulled and a strut as it is pressed; not while they are loose."""
    for option, expected in (("tension_only", [0.02, 0.0]), ("inequality", [0.0, -0.02])):
        scene, rows = pairs([0.03, -0.03], pinned=True)
        rod = damped(rows, yield_strain=0.01, creep=1e3, **{option: True})
        scene.add_constraint(rod)
        sim = simulate(scene)
        sim.run(10)
        found = sim.constraints[0].permanent.numpy()
        assert found[np.argsort(sim.constraints[0].tuples.order)] == pytest.approx(expected)


@pytest.mark.slow
def test_a_torn_one_flows_no_more(simulate):
    scene, rows = pairs([0.03, 0.5])
    scene.add_constraint(damped(rows, yield_strain=0.01, creep=1e6, break_force=0.2))
    sim = simulate(scene)
    sim.run(10)
    assert sim.constraints[0].broken.tolist() == [False, True]
    # It tears at the end of the first substep, before it flows.
    assert sim.constraints[0].permanent.numpy() == pytest.approx([0.02, 0.0], abs=2e-4 * 0.03)


@pytest.mark.slow
@pytest.mark.parametrize("start, left", [(1.0, 0.7), (-1.0, -0.7), (0.25, 0.0)])
def test_a_bent_sheet_keeps_a_fold(simulate, start, left):
    """The free wing of a hinge, whose other three particles are held; moment of inertia 1."""
    x = [(0, 0, 0), (0, 0, 1), (0, -1, 0.5), (-np.sin(start), np.cos(start), 0.5)]
    scene = ps.Scene()
    scene.add_particles(x, pinned=[True, True, True, False])
    scene.add_constraint(
        ps.Bending([(0, 1, 2, 3)], 0.0, compliance=1.0, damping=2.0, yield_angle=0.3, creep=1e6)
    )
    sim = simulate(scene)
    sim.run(3000)  # 30 decay times
    fold = ps.Bending.quantity(sim.position[None])[0]
    assert fold == pytest.approx(left, abs=1e-4)  # it yields k dt^2 = 1e-4 late


@pytest.mark.slow
def test_a_paper_clip(simulate):
    """A wire wound by a moving end about a held one, and let go: an angle stays."""
    bent = 2.0
    scene = ps.Scene()
    scene.add_particles(
        [(-1, 0, 0), (0, 0, 0), (np.cos(bent), np.sin(bent), 0)], pinned=[True, True, False]
    )
    wire = ps.Angle([(0, 1, 2)], np.pi, compliance=1.0, damping=2.0, yield_angle=0.5, creep=1e6)
    scene.add_constraint(wire)
    sim = simulate(scene)
    sim.run(3000)
    kept = np.pi - ps.Angle.quantity(sim.position[None])[0]
    assert kept == pytest.approx(bent - 0.5, abs=2e-4)  # k dt^2 of 2 rad


@pytest.mark.slow
def test_same_bits(simulate, device, tmp_path):
    """A world alone or in a batch, after a reset and from a checkpoint."""

    def build(yield_strain):
        scene, rows = pairs([0.03, -0.03, 0.2], velocity=(0.1, 0, 0))
        scene.add_constraint(damped(rows, yield_strain=yield_strain, creep=20.0))
        return scene

    scenes = [build(0.01), build(0.05)]
    equal_alone(simulate, scenes, device, 20)
    goes_on_after_reset_and_save(simulate, scenes, device, tmp_path / "run.npz")
