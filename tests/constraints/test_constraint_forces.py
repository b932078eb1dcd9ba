"""Constraints on tuples: breaking, and the same law as a force."""

import functools

import numpy as np
import pytest

import particlesim as ps

RNG = np.random.default_rng(7)


@pytest.fixture
def simulate(simulate):
    """In float32, unless told otherwise."""
    return functools.partial(simulate, precision="float32")


# Breaking -------------------------------------------------------------------------------------


def test_what_breaks_stays_broken_until_the_reset(device, simulate):
    """A link that carries more than it can is gone; the others hold; a reset heals it."""
    scene = ps.Scene()
    x = np.stack([0 * np.arange(4.0), -np.arange(4.0), 0 * np.arange(4.0)], axis=1)
    scene.add_particles(x, mass=[1, 1, 1, 10.0], pinned=[True, False, False, False])
    scene.add_interaction(ps.UniformGravity((0, -10, 0)))
    limits = [1000.0, 105.0, 1000.0]  # the second link carries 110
    chain = scene.add_constraint(
        ps.Distance([(2, 3), (1, 2), (0, 1)], 1.0, compliance=1e-4, break_force=limits)
    )
    sim = simulate(scene, device, dt=0.01, substeps=10, precision="float64")
    sim.step()
    assert not sim.broken(chain).any()
    sim.run(100)
    assert sim.broken(chain).tolist() == [False, True, False]
    assert sim.position[1, 1] > -1.2  # holds
    assert sim.position[2, 1] < -4  # falls
    assert np.linalg.norm(sim.position[3] - sim.position[2]) == pytest.approx(1, abs=1e-2)
    assert "broken" in sim.constraints[0].persistent()
    sim.reset()
    assert not sim.broken(chain).any()
    assert np.allclose(sim.position, x)


def test_broken_are_restored_by_the_snapshot(device, simulate, pair):
    """Going back to the start of a frame undoes what broke in it."""
    scene = pair(pinned=[True, False], velocity=[(0, 0, 0), (10, 0, 0)])
    rod = scene.add_constraint(ps.Distance([(0, 1)], 1.0, break_force=1.0))
    sim = simulate(scene, device)
    sim.step()
    assert sim.broken(rod).all()
    sim.frames.snapshot.restore()
    assert not sim.broken(rod).any()


def test_force_of_every_world(device, simulate):
    """Forces are listed in the order of the tuples, world by world, or by the scene's own."""
    scenes, springs = [], []
    for mass in (1.0, 2.0):
        scene = ps.Scene()
        scene.add_particles([(0, 0, 0), (0, -1, 0), (0, -2, 0)], mass=mass,
                            pinned=[True, False, False])  # fmt: skip
        scene.add_interaction(ps.UniformGravity((0, -10, 0)))
        springs.append(scene.add_constraint(ps.Distance([(1, 2), (0, 1)], 1.0, compliance=1e-3)))
        scenes.append(scene)
    sim = simulate(scenes, device, dt=1.0, substeps=50, precision="float64")
    sim.run(20)
    assert np.allclose(sim.constraints[0].force, [10, 20, 20, 40], rtol=1e-6)
    assert np.allclose(sim.force(springs[0]), [10, 20], rtol=1e-6)
    assert np.allclose(sim.force(springs[1]), [20, 40], rtol=1e-6)
    copies = simulate(scenes[0], device, dt=1.0, substeps=50, precision="float64")
    copies.run(20)
    assert copies.force(springs[0]).shape == (2,)


def test_force_needs_a_simulation():
    """What was never simulated cannot be read."""
    with pytest.raises(ValueError, match=r"write sim.force\(part\)"):
        _ = ps.Distance([(0, 1)]).force


# As a force -----------------------------------------------------------------------------------


def test_as_force_is_the_spring(precision, device, simulate, cloth):
    """Distance as a force equals Springs of stiffness 1 / alpha, and reports the same energy."""
    x, pairs = cloth()
    v = RNG.normal(0, 0.1, x.shape)
    found = []
    for interaction in (
        ps.Distance(pairs, 0.1, compliance=1e-3, damping=2.0).as_force(),
        ps.Springs(pairs, stiffness=1e3, rest_length=0.1, damping=2.0),
    ):
        scene = ps.Scene()
        scene.add_particles(x, velocity=v)
        scene.add_interaction(interaction)
        sim = simulate(scene, device, precision=precision)
        sim.forces(0.01)
        told = sim.diagnostics()
        found.append((sim.get("force"), told.potential, told.virial))
    # Relative rounding of a stretch of 0.02 out of 0.1, and of sums over six springs.
    relative = 100 * np.finfo(precision).eps
    for a, b in zip(*found, strict=True):
        assert np.allclose(a, b, rtol=0, atol=relative * np.abs(b).max())


@pytest.mark.parametrize(
    ("name", "size", "parameters"),
    [("angle", 3, {"rest_angle": 1.1}), ("volume", 4, {"rest_volume": 0.3})],
)
def test_as_force_conserves_energy(name, size, parameters, device, simulate, laws):
    """Forces of three- and four-particle laws are minus the gradient of the energy reported."""
    scene = ps.Scene()
    x = [(0.6, 0, 0), (0, 0, 0), (0, 0.7, 0), (0, 0.1, 0.8)][:size]
    scene.add_particles(x, velocity=RNG.normal(0, 0.1, (size, 3)))
    force = ps.Constraint(
        getattr(laws, name), np.arange(size)[None], compliance=0.1, **parameters
    ).as_force()
    scene.add_interaction(force)
    drift = {}
    for substeps in (100, 200):
        sim = simulate(scene, device, dt=0.5, substeps=substeps, precision="float64",
                       integrator="velocity_verlet")  # fmt: skip
        start = sim.diagnostics().energy[0]
        sim.step()
        end = sim.diagnostics()
        drift[substeps] = abs(end.energy[0] - start)
        assert np.abs(end.momentum - sim.model.column("velocity").sum(axis=0)).max() < 1e-13
    assert start > 0.01
    assert drift[100] / drift[200] == pytest.approx(4, rel=0.1)  # second order, so conservative


def test_inequality_as_force_acts_below_zero(device, simulate):
    """One pair too near, one far: only the first is pushed."""
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0), (0.5, 0, 0), (0, 1, 0), (1.5, 1, 0)])
    scene.add_interaction(
        ps.Distance([(0, 1), (2, 3)], 1.0, compliance=0.1, inequality=True).as_force()
    )
    sim = simulate(scene, device)
    sim.forces(0.01)
    assert np.allclose(sim.get("force")[:, 0], [-5, 5, 0, 0])
