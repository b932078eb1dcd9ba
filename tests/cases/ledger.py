"""Scenes and checks that tests of the ledger share."""

import numpy as np
import warp as wp

import particlesim as ps

G = 10.0


# Round-off: a contribution is rounded to eps of the forces, and these are added up substep after
# substep; in parts of the works (or impulses) of all parts without their signs.
EPS = {"float32": 2e-6, "float64": 1e-13}


def stepped(scene, device, frames, **knobs):
    sim = ps.Simulation(scene, ps.Settings(ledger=True, **knobs), device=device)
    for _ in range(frames):
        sim.step()
    return sim


def stone(mass=3.0, height=2.0, velocity=(1, 0, 0), **options):
    scene = ps.Scene()
    scene.add_particles([(0, height, 0)], mass=mass, velocity=velocity, **options)
    return scene


def assert_closed(sim, scale=1.0):
    """What no part accounts for is round-off of what all of them have moved to and fro."""
    ledger, eps = sim.ledger(), EPS[sim.settings.precision]
    kinetic = np.abs(ledger.kinetic_change) + sum(np.abs(each.work) for each in ledger)
    assert (np.abs(ledger.unaccounted) <= scale * eps * kinetic + 1e-300).all()
    moved = np.abs(ledger.momentum_change).max(axis=1)
    moved = moved + sum(np.abs(each.impulse).max(axis=1) for each in ledger)
    mass, v = sim.model.column("mass"), np.abs(sim.velocity).max(axis=1)
    there = np.bincount(sim.model.world_of, mass * v, sim.world_count)  # each is rounded by itself
    left = np.abs(ledger.unaccounted_momentum).max(axis=1)
    assert (left <= scale * eps * (moved + there) + 1e-300).all()


@ps.law
def stirred(position: wp.vec3, velocity: wp.vec3, time: float):
    return wp.vec3(wp.sin(20.0 * time), 0.0, 0.0) - 0.3 * velocity


def busy(seed=0):
    """All kinds of parts, two of one kind, some fused without a ledger, and a pinned particle."""
    rng = np.random.default_rng(seed)
    scene = ps.Scene()
    x = ps.sample.lattice("sc", (4, 4, 4), 0.22, origin=(0, 0.3, 0))
    x = x + rng.uniform(-0.02, 0.02, x.shape)
    scene.add_particles(
        x, velocity=rng.normal(0, 1, x.shape), mass=rng.uniform(0.5, 2, len(x)), radius=0.1,
        pinned=np.arange(len(x)) == 7,
    )  # fmt: skip
    scene.add_interaction(ps.UniformGravity((0, -G, 0)))
    scene.add_interaction(ps.LennardJones(epsilon=0.1, sigma=0.2, cutoff=0.5))
    scene.add_interaction(ps.PairPotential(pull, cutoff=0.5, strength=0.5))
    scene.add_interaction(ps.ParticleForce(stirred))
    scene.add_constraint(ps.Distance([(0, 1), (1, 2), (7, 8)], compliance=1e-5))
    scene.add_constraint(ps.Distance([(20, 21)]))
    scene.add_constraint(ps.Contact(friction=0.3, restitution=0.4))
    scene.add_constraint(ps.BoxBoundary((-1, 0, -1), (2, 4, 2), friction=0.2, restitution=0.5))
    return scene


@ps.law
def pull(r: float, strength: float):
    return strength * r * r
