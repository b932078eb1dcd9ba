"""Worlds: each goes in a batch as it goes alone, bit for bit, whatever becomes of the others."""

import numpy as np
import pytest
import warp as wp

import particlesim as ps
from cases.worlds import same, screened

SETTINGS = {
    "symplectic_euler": ps.Settings(dt=0.02, substeps=4),
    "velocity_verlet": ps.Settings(dt=0.02, substeps=4, integrator="velocity_verlet"),
}


@ps.law
def swing(position: wp.vec3, time: float, stiffness: float):
    return -stiffness * wp.sin(3.0 * time) * position


def fluid(count, side, seed, epsilon=1.0):
    """A periodic box of atoms with everything that acts on them."""
    rng = np.random.default_rng(seed)
    edge = int(np.ceil(count ** (1 / 3)))
    x = ps.sample.lattice("sc", (edge,) * 3, side / edge)[rng.permutation(edge**3)[:count]]
    scene = ps.Scene(periodic=((0, 0, 0), (side, side, side)))
    atoms = scene.add_particles(
        x + rng.uniform(-0.05, 0.05, x.shape), velocity=rng.normal(0, 1, x.shape), charge=0.3
    )
    scene.add_interaction(ps.LennardJones(atoms, epsilon, cutoff=2.5))
    scene.add_interaction(ps.PairPotential(screened, cutoff=1.5, screening=0.7))
    scene.add_interaction(ps.UniformGravity((0, -0.1 * seed, 0)))
    scene.add_interaction(ps.Drag(0.1, 0.2))
    return scene


def cloud(count, seed, constant=1.0):
    """Particles in open space that attract each other, with some springs."""
    rng = np.random.default_rng(seed)
    scene = ps.Scene()
    scene.add_particles(rng.normal(0, 2, (count, 3)), mass=rng.uniform(0.5, 1, count))
    scene.add_interaction(ps.Gravity(None, constant, 0.3))
    pairs = [(k, (k + 1) % count) for k in range(0, count, 3)]
    scene.add_interaction(ps.Springs(pairs, 5.0 + seed, damping=0.1 * seed))
    scene.add_interaction(ps.ParticleForce(swing, stiffness=0.2 * seed))
    return scene


# Sizes looked through directly and by grid (limit 512 on the CPU), in boxes of their own.
FLUIDS = [(60, 5.2), (700, 9.5), (216, 6.4), (1000, 10.5), (1, 5.0)]


def fluids():
    return [fluid(n, side, seed, 1 + 0.1 * seed) for seed, (n, side) in enumerate(FLUIDS)]


def clouds():
    return [cloud(n, seed, 1 + 0.1 * seed) for seed, n in enumerate((30, 4, 77))]


@pytest.mark.parametrize("precision", ["float64", pytest.param("float32", marks=pytest.mark.slow)])
@pytest.mark.parametrize("method", SETTINGS)
@pytest.mark.parametrize("build", [fluids, clouds])
def test_a_world_goes_as_it_goes_alone(build, method, precision, device):
    settings = SETTINGS[method].replace(precision=precision)
    batch = ps.Simulation(build(), settings, device=device)
    batch.run(8)
    together = batch.diagnostics()
    for w, scene in enumerate(build()):
        alone = ps.Simulation(scene, settings, device=device)
        alone.run(8)
        same(batch.world(w), alone)
        # Sums are made in blocks that start anew in each world.
        separate = alone.diagnostics()
        for name in ("mass", "momentum", "angular_momentum", "kinetic", "potential", "virial"):
            np.testing.assert_array_equal(
                getattr(together, name)[w], getattr(separate, name)[0], err_msg=name
            )


def test_copies_of_one_scene(device):
    # 300 worlds in one place: they overlap exactly, and never feel each other.
    scene = cloud(5, 1)
    alone = ps.Simulation(scene, SETTINGS["symplectic_euler"], device=device)
    batch = ps.Simulation(scene, SETTINGS["symplectic_euler"], device=device, worlds=300)
    for sim in (alone, batch):
        sim.run(5)
    assert batch.world_count == 300
    np.testing.assert_array_equal(batch.position, np.tile(alone.position, (300, 1)))


PARAMETERS = {
    "LennardJones": lambda k: ps.LennardJones(epsilon=k, sigma=1 + 0.1 * k, cutoff=2 + 0.2 * k),
    "PairPotential": lambda k: ps.PairPotential(screened, cutoff=1.0 + k, screening=k),
    "Gravity": lambda k: ps.Gravity(G=k, softening=0.1 * k),
    "Springs": lambda k: ps.Springs([(0, 1), (1, 2), (0, 2)][:k], 1.0 + k, 0.5 * k, 0.1 * k),
    "UniformGravity": lambda k: ps.UniformGravity((0, -k, 0)),
    "ConstantForce": lambda k: ps.ConstantForce((k, 0, 0)),
    "Drag": lambda k: ps.Drag(0.1 * k, 0.2 * k, flow=(k, 0, 0)),
    "ParticleForce": lambda k: ps.ParticleForce(swing, stiffness=k, time=0.1 * k),
}


@pytest.mark.parametrize("name", PARAMETERS)
def test_every_world_has_its_own_parameters(name, device):
    def build(k):
        scene = ps.Scene()
        scene.add_particles([(0, 0, 0), (1.1, 0.2, 0), (0.4, 0.9, 0.3)], velocity=(0, 1, 0),
                            charge=1.0)  # fmt: skip
        scene.add_interaction(PARAMETERS[name](k))
        return scene

    settings = ps.Settings(precision="float64")
    batch = ps.Simulation([build(k) for k in (1, 2, 3)], settings, device=device)
    batch.forces(0.0)
    forces = []
    for w, k in enumerate((1, 2, 3)):
        alone = ps.Simulation(build(k), settings, device=device)
        alone.forces(0.0)
        forces.append(batch.world(w).get("force"))
        np.testing.assert_array_equal(forces[-1], alone.get("force"))
    assert not np.array_equal(forces[0], forces[1])
    assert not np.array_equal(forces[1], forces[2])


# What becomes of one world is nothing to the others --------------------------------------------


@pytest.mark.parametrize("build", [fluids, clouds])
def test_nan_in_one_world_stays_there(build, device):
    sim = ps.Simulation(build(), SETTINGS["symplectic_euler"], device=device)
    twin = ps.Simulation(build(), SETTINGS["symplectic_euler"], device=device)
    x = sim.get("position")
    x[sim.world(1).rows] = np.nan
    sim.state.position.assign(x)
    for each in (sim, twin):
        for _ in range(20):
            each.substep(0.005)
    for w in (0, *range(2, sim.world_count)):
        same(sim.world(w), twin.world(w))
    assert np.isnan(sim.world(1).position).all()


def test_one_world_explodes_and_is_healed(device):
    # One of eight worlds cannot be integrated; its error names it. Reset, with its particles
    # told to stay apart, it goes on; the others have noticed nothing.
    def build(k):
        scene = ps.Scene()
        x = ps.sample.lattice("sc", (3, 3, 3), 1.1)
        x = x if k != 5 else np.vstack([x[:-1], x[:1]])  # two in one place
        scene.add_particles(x, velocity=np.random.default_rng(k).normal(0, 0.3, (27, 3)))
        scene.add_interaction(ps.LennardJones(cutoff=2.5))
        return scene

    settings = ps.Settings(dt=0.01, substeps=2)
    sim = ps.Simulation([build(k) for k in range(8)], settings, device=device)
    with pytest.raises(ps.SimulationError, match=r"of particle (0|26) in world 5 between t = 0 "):
        sim.step()
    healthy = ps.sample.lattice("sc", (3, 3, 3), 1.1)
    sim.world(5).position = healthy
    sim.run(5)
    for w in range(8):
        if w != 5:
            alone = ps.Simulation(build(w), settings, device=device)
            alone.run(5)
            same(sim.world(w), alone)


@pytest.mark.parametrize("precision", ["float64", pytest.param("float32", marks=pytest.mark.slow)])
@pytest.mark.parametrize("method", SETTINGS)
@pytest.mark.parametrize("build", [fluids, clouds])
def test_reset_of_some_worlds(build, method, precision, device):
    # Drag with velocity Verlet: evaluated anew, its force would not be the same.
    settings = SETTINGS[method].replace(precision=precision)
    sim = ps.Simulation(build(), settings, device=device)
    twin = ps.Simulation(build(), settings, device=device)
    sim.run(6)
    sim.reset([1, 2])
    np.testing.assert_array_equal(
        sim.world(1).position, sim.state.start("position")[sim.world(1).rows]
        .astype(precision),
    )  # fmt: skip
    sim.run(5)
    twin.run(5)
    for w in (1, 2):
        same(sim.world(w), twin.world(w))
    twin.run(6)
    for w in (0, *range(3, sim.world_count)):
        same(sim.world(w), twin.world(w))
    assert sim.time == pytest.approx(11 * 0.02)  # the clock of the batch goes on


@pytest.mark.parametrize("method", SETTINGS)
def test_writing_to_one_world(method, device):
    sim = ps.Simulation(fluids(), SETTINGS[method], device=device)
    twin = ps.Simulation(fluids(), SETTINGS[method], device=device)
    for each in (sim, twin):
        each.run(3)
    world = sim.world(2)
    assert world.scene is sim.scenes[2]
    assert world.position.shape == (216, 3)
    world.position = world.position[::-1]
    world.velocity = (0, 0, 0.5)
    np.testing.assert_array_equal(sim.position[world.rows], twin.world(2).position[::-1])
    for each in (sim, twin):
        each.run(3)
    for w in (0, 1, 3, 4):
        same(sim.world(w), twin.world(w))
    assert not np.array_equal(world.position, twin.world(2).position)
    world.reset()
    np.testing.assert_array_equal(world.velocity, sim.scenes[2].velocity.astype(np.float32))
    with pytest.raises(ValueError, match="have shape"):
        world.position = np.zeros((5, 3))
