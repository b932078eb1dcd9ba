"""Simulation: what is read, written and reset."""

import numpy as np
import pytest

import particlesim as ps
from cases.simulation import drifting

# Diagnostics ------------------------------------------------------------------------------------


def test_diagnostics_are_the_sums(precision, device):
    rng = np.random.default_rng(0)
    scene = ps.Scene()
    x, v, m = rng.normal(size=(700, 3)), rng.normal(size=(700, 3)), rng.uniform(1, 2, 700)
    x, v, m = (a.astype(np.float32).astype(float) for a in (x, v, m))
    scene.add_particles(x, velocity=v, mass=m)
    scene.add_particles([(5, 5, 5)], velocity=(1, 1, 1), mass=100, pinned=True)
    sim = ps.Simulation(scene, ps.Settings(precision=precision), device=device)
    found = sim.diagnostics()
    # Sums of 700 terms in float64.
    assert found.mass[0] == pytest.approx(m.sum() + 100, rel=1e-13)
    np.testing.assert_allclose(found.momentum[0], m @ v, atol=1e-12)
    np.testing.assert_allclose(found.angular_momentum[0], m @ np.cross(x, v), atol=1e-12)
    assert found.kinetic[0] == pytest.approx(0.5 * m @ (v**2).sum(axis=1), rel=1e-13)
    assert found.potential[0] == 0
    assert found.energy[0] == found.kinetic[0]


def test_looking_does_not_disturb(liquid, device):
    # Diagnostics bring lists up to date themselves, and may find a row full; the run must go on
    # as if nobody had looked.
    def run(look):
        rng = np.random.default_rng(5)
        x = rng.uniform(-9, 9, (700, 3))
        scene = ps.Scene()
        scene.add_particles(x, velocity=-x)
        scene.add_interaction(ps.PairPotential(spread, cutoff=2.0, reach=2.0))
        sim = ps.Simulation(scene, ps.Settings(dt=0.02, substeps=2), device=device)
        start = sim.neighbors.lists[0].capacity
        for _ in range(30):
            if look:
                sim.diagnostics()
            sim.step()
        assert sim.neighbors.lists[0].capacity > start
        return sim.position

    np.testing.assert_array_equal(run(True), run(False))


@ps.law
def spread(r: float, reach: float):
    return 0.01 * (r - reach) * (r - reach)


# Reading and writing ----------------------------------------------------------------------------


def test_what_is_read_is_a_copy(device):
    sim = ps.Simulation(drifting(), device=device)
    x = sim.get("position")
    x[:] = 0
    assert sim.position[-1, 2] == 8


def test_a_copy_cannot_be_written_to_by_mistake(device):
    """What would change nothing is refused; arithmetic and assignments are as ever."""
    sim = ps.Simulation(drifting(), device=device)
    for target in (sim.position, sim.velocity, sim.world(0).position, sim.world(0).velocity):
        with pytest.raises(ValueError, match="read-only"):
            target[0] = (5, 5, 5)
    before = sim.position.copy()
    sim.position += 1
    sim.world(0).position -= 2
    np.testing.assert_array_equal(sim.position, before - 1)
    before[0] = 3  # a copy of the copy is one's own
    assert type(sim.position + 1) is np.ndarray


def test_writing(precision, device):
    sim = ps.Simulation(drifting(), ps.Settings(dt=1.0, precision=precision), device=device)
    sim.step()
    sim.position = np.ones((3, 3))
    sim.velocity = (0, 2, 0)
    sim.step()
    np.testing.assert_allclose(sim.position, [(1, 3, 1)] * 3, rtol=1e-6)
    for wrong in (np.ones((2, 3)), np.nan, "there"):
        with pytest.raises(ValueError, match=r"Simulation\.set: position"):
            sim.position = wrong
    np.testing.assert_allclose(sim.position, [(1, 3, 1)] * 3, rtol=1e-6)


def test_a_new_mass_is_felt(device):
    scene = drifting()
    scene.add_particles([(9, 9, 9)], pinned=True)
    scene.add_interaction(ps.ConstantForce((0, 6, 0)))
    scene.add_interaction(ps.UniformGravity((0, 0, 1)))
    sim = ps.Simulation(scene, ps.Settings(dt=1.0, substeps=1), device=device)
    sim.set("mass", [1, 2, 3, 4])
    sim.step()
    np.testing.assert_allclose(sim.velocity[:, 1], [6, 3, 2, 0], rtol=1e-6)
    with pytest.raises(ValueError, match=r"Simulation\.set: mass must be above 0"):
        sim.set("mass", [1, 0, 1, 1])
    np.testing.assert_array_equal(sim.get("mass"), [1, 2, 3, 4])


@pytest.mark.parametrize("method", ["symplectic_euler", "velocity_verlet"])
def test_after_writing_forces_and_neighbours_are_those_of_the_new_place(method, device):
    def build(x):
        scene = ps.Scene()
        scene.add_particles(x)
        scene.add_interaction(ps.LennardJones(cutoff=2.5))
        settings = ps.Settings(dt=0.01, substeps=2, precision="float64", integrator=method)
        return ps.Simulation(scene, settings, device=device)

    rng = np.random.default_rng(0)
    x = ps.sample.lattice("sc", (4, 4, 4), 1.1) + rng.uniform(-0.05, 0.05, (64, 3))
    fresh = build(x)
    moved = build(x[::-1] + 50.0)
    moved.step()
    moved.position, moved.velocity = x, 0.0
    for sim in (fresh, moved):
        sim.step()
    np.testing.assert_array_equal(moved.position, fresh.position)


def test_arrays_that_are_not_there(refused):
    sim = ps.Simulation(drifting(), device="cpu")
    for read in (lambda: sim.get("density"), lambda: sim.state.density, lambda: sim.state["dense"]):
        with refused("State: name must be one of position", kind=AttributeError):
            read()
    assert not hasattr(sim.state, "density")


@pytest.mark.parametrize("method", ["symplectic_euler", "velocity_verlet"])
def test_reset_repeats_the_run(method, liquid, device):
    sim = ps.Simulation(
        liquid(cells=6), ps.Settings(dt=0.05, substeps=10, integrator=method), device=device
    )
    sim.run(5)
    first, t = sim.position, sim.time
    sim.reset()
    assert sim.time == 0
    np.testing.assert_array_equal(sim.position, sim.state.start("position")
                                  .astype(np.float32))  # fmt: skip
    sim.run(5)
    assert sim.time == t
    np.testing.assert_array_equal(sim.position, first)


def test_what_the_scene_gives_can_always_be_read_and_written(device):
    """Masses, radii and attributes, whether a part asks for them or not."""
    scene = ps.Scene()
    scene.add_particles(np.eye(3), mass=[1.0, 2.0, 3.0], radius=0.5, charge=[1.0, 0.0, -1.0])
    scene.add_interaction(ps.ConstantForce((1, 0, 0)))
    sim = ps.Simulation(scene, ps.Settings(dt=1.0, substeps=1), device=device)
    np.testing.assert_array_equal(sim.get("mass"), [1, 2, 3])
    np.testing.assert_array_equal(sim.get("charge"), [1, 0, -1])
    assert "mass" not in sim.state  # looking makes no array
    sim.set("mass", [2.0, 2.0, 2.0])
    sim.step()
    np.testing.assert_array_equal(sim.velocity[:, 0], 0.5)
    assert sim.diagnostics().mass[0] == 6
    with pytest.raises(ValueError, match="mass must be above 0"):
        sim.set("mass", 0.0)


@pytest.mark.parametrize("integrator", ["symplectic_euler", "velocity_verlet"])
def test_what_forces_leave_behind_is_there_before_the_first_step(integrator, device):
    """Forces and densities of the start, by name: looking at them changes not one bit."""

    def made():
        scene = ps.Scene()
        x = ps.sample.box((0, 0, 0), (0.4, 0.4, 0.4), spacing=0.1)
        scene.add_particles(x, mass=1.0)
        scene.add_interaction(
            ps.SPH(smoothing_length=0.13, rest_density=1000.0,
                   equation_of_state=ps.Tait(sound_speed=10.0, negative_pressure=True))
        )  # fmt: skip
        settings = ps.Settings(dt=1e-3, substeps=2, integrator=integrator)
        return ps.Simulation(scene, settings, device=device)

    sim, plain = made(), made()
    sim.explain()  # records a frame, and runs none
    density, force = sim.get("density"), sim.world(0).get("force")
    assert density.min() > 1000 / 8 and density.max() < 1200  # a corner sees an eighth of all
    assert np.abs(force).max() > 0
    sim.position = sim.position * np.float32(2.0)
    assert sim.get("density").max() < 0.5 * density.max()  # of where they are now
    sim.reset()
    np.testing.assert_array_equal(sim.get("density"), density)
    for each in (sim, plain):
        each.run(3)
    np.testing.assert_array_equal(sim.position, plain.position)
    np.testing.assert_array_equal(sim.get("density"), plain.get("density"))


@pytest.mark.parametrize("integrator", ["symplectic_euler", "velocity_verlet"])
def test_a_world_that_is_placed_has_the_forces_of_where_it_is(integrator, device):
    """Those of its start after a reset of its own; the other world keeps what its step has left."""
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0), (1.5, 0, 0)])
    scene.add_interaction(ps.Springs([(0, 1)], stiffness=4.0, rest_length=1.0))
    settings = ps.Settings(dt=0.1, substeps=1, integrator=integrator)
    sim = ps.Simulation(scene, settings, device=device, worlds=2)
    start = sim.get("force")
    sim.run(2)
    left = sim.get("force")
    assert not np.array_equal(left, start)
    sim.reset([1])
    np.testing.assert_array_equal(sim.world(1).get("force"), start[2:])
    np.testing.assert_array_equal(sim.world(0).get("force"), left[:2])
    sim.world(0).position = [(0, 0, 0), (2, 0, 0)]
    np.testing.assert_array_equal(sim.get("force")[0], (4, 0, 0))  # k (2 - 1)
