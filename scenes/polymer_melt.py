"""A melt of bead-spring chains, after Kremer and Grest (1990).

Reduced units. Beads repel each other by a Lennard-Jones potential that ends where it attracts, at
2^(1/6) sigma; those of a chain are held by FENE bonds as well, and a Langevin bath of the same
friction as theirs takes what the stretched bonds of the start give. At T = 1 bonds are 0.97 sigma
long, too short for chains to pass through each other.
"""

import numpy as np

import particlesim as ps

LENGTH = 0.97  # mean of a bond at T = 1 [sigma]: Kremer and Grest 1990
TURNS = 10  # of the path that fills the lattice, for each site
frames = 200
settings = ps.Settings(dt=0.25, substeps=50, integrator="velocity_verlet")


def build(
    edge: int = 10, length: int = 20, density: float = 0.85, temperature: float = 1.0, seed: int = 0
) -> ps.Scene:
    """A periodic box of edge^3 beads, but for those that make no whole chain.

    Args:
        edge: Sites along a side of the lattice that chains start on, at least 3.
        length: Beads of a chain.
        density: Beads per sigma^3.
        temperature: Of the start and the bath [epsilon / k].
        seed: Of chains, velocities and the bath.
    """
    chains = edge**3 // length
    count = chains * length
    side = (count / density) ** (1 / 3)
    scene = ps.Scene(up_axis="z", periodic=((0, 0, 0), (side, side, side)))
    beads = scene.add_particles(
        walk(edge, seed)[:count] * side / edge,
        velocity=ps.sample.maxwell_boltzmann(count, temperature, 1.0, seed=seed),
        radius=0.5,
        group="beads",
    )
    scene.add_interaction(ps.LennardJones(beads, cutoff=2 ** (1 / 6), truncation="shift"))
    scene.add_interaction(ps.FENEBonds(bonds(chains, length), stiffness=30.0, length=1.5))
    scene.add_thermostat(ps.Langevin(beads, temperature=temperature, friction=0.5, seed=seed))
    return scene


def bonds(chains: int, length: int) -> np.ndarray:
    """Pairs of beads that follow each other in a chain."""
    bead = np.arange(chains * length).reshape(chains, length)
    return np.stack([bead[:, :-1].ravel(), bead[:, 1:].ravel()], axis=1)


def walk(edge: int, seed: int) -> np.ndarray:
    """A random walk that visits every site of a periodic cubic lattice once, (edge^3, 3).

    It starts as a snake. Again and again an end bites the path at a neighbouring site and lets go
    of the bond there that closes a ring (Mansfield 1982).
    """
    rng = np.random.default_rng(seed)
    x, y, z = np.meshgrid(*[np.arange(edge)] * 3, indexing="ij")
    y = np.where(x % 2, edge - 1 - y, y)
    z = np.where((edge * x + np.where(x % 2, edge - 1 - y, y)) % 2, edge - 1 - z, z)
    path = np.stack([x.ravel(), y.ravel(), z.ravel()], axis=1)
    sizes = np.array([edge * edge, edge, 1])
    place = np.empty(edge**3, dtype=int)
    place[path @ sizes] = np.arange(edge**3)
    steps = np.concatenate([np.eye(3, dtype=int), -np.eye(3, dtype=int)])
    for step in steps[rng.integers(0, 6, TURNS * edge**3)]:
        bitten = place[(path[-1] + step) % edge @ sizes]
        path[bitten + 1 :] = path[bitten + 1 :][::-1]
        place[path[bitten + 1 :] @ sizes] = np.arange(bitten + 1, edge**3)
        if rng.random() < 0.5:  # on from the other end
            path, place = path[::-1].copy(), edge**3 - 1 - place
    return path


def error(sim: ps.Simulation) -> float:
    """How far the mean bond length is from that of the literature [sigma]."""
    pairs = sim.scenes[0].interactions[-1].pairs
    d = np.diff(sim.position[pairs], axis=1)[:, 0]
    d -= sim.model.box_length[0] * np.round(d / sim.model.box_length[0])
    return abs(float(np.linalg.norm(d, axis=1).mean()) - LENGTH)
