"""Speed of contacts and distances: a block of grains that settles, and a cloth.

The floor is 2.5 M particle-substeps/s for 27 000 grains on one core, float32, and about 60 M
distances/s. Run it as ``python tests/benchmarks/contacts.py [cpu|cuda:0] [threads]``.
"""

import sys

import numpy as np
from timing import rates, report

import particlesim as ps

SIDE, RADIUS = 30, 0.05  # grains along an edge; [m]
KNOTS = 101  # of the cloth along an edge: 40 200 distances


def block(device="cpu", friction=0.0, **knobs):
    """27 000 grains falling onto the ground from a loose block."""
    rng = np.random.default_rng(0)
    x = ps.sample.lattice("sc", (SIDE,) * 3, 2.05 * RADIUS) + RADIUS
    scene = ps.Scene()
    scene.add_particles(x + rng.uniform(-0.02, 0.02, x.shape) * RADIUS, radius=RADIUS)
    scene.add_interaction(ps.UniformGravity((0, -9.81, 0)))
    scene.add_constraint(ps.Contact(friction=friction))
    scene.add_constraint(ps.PlaneBoundary((0, 0, 0), (0, 1, 0), friction=friction))
    settings = ps.Settings(dt=1 / 60, substeps=20, **knobs)
    return ps.Simulation(scene, settings, device=device)


def cloth(device="cpu", iterations=1, **knobs):
    """A cloth with both diagonals, hung by two corners."""
    k = np.arange(KNOTS**2).reshape(KNOTS, KNOTS)
    ends = (
        (k[:-1], k[1:]), (k[:, :-1], k[:, 1:]),
        (k[:-1, :-1], k[1:, 1:]), (k[1:, :-1], k[:-1, 1:]),
    )  # fmt: skip
    pairs = np.concatenate([np.stack([a.ravel(), b.ravel()], axis=1) for a, b in ends])
    x = 0.01 * np.stack([k // KNOTS, 0 * k, k % KNOTS], axis=-1).reshape(-1, 3)
    pinned = np.isin(k.ravel(), (k[0, 0], k[0, -1]))
    scene = ps.Scene()
    scene.add_particles(x, mass=2e-5, pinned=pinned)
    scene.add_interaction(ps.UniformGravity((0, -9.81, 0)))
    scene.add_constraint(ps.Distance(pairs, compliance=1e-7))
    settings = ps.Settings(dt=1 / 60, substeps=10, iterations=iterations, **knobs)
    return ps.Simulation(scene, settings, device=device)


def distance_time(device="cpu", **knobs):
    """Seconds of one iteration over the cloth's distances: 11 iterations less 1."""
    few, many = 1, 11
    found = rates({str(n): lambda n=n: cloth(device, n, **knobs) for n in (few, many)}, frames=6)
    seconds = {n: KNOTS**2 / found[str(n)] for n in (few, many)}
    return (seconds[many] - seconds[few]) / (many - few)


if __name__ == "__main__":
    device = sys.argv[1] if len(sys.argv) > 1 else "cpu"
    knobs = {"threads": int(sys.argv[2])} if len(sys.argv) > 2 else {"threads": 1}
    names = {"without friction": 0.0, "with friction": 0.3}
    report(
        f"27 000 grains, contacts and ground, float32, {knobs['threads']} thread(s), {device}",
        rates({name: lambda mu=mu: block(device, mu, **knobs) for name, mu in names.items()}, 5),
    )
    for compensated in (True, False):
        seconds = distance_time(device, compensated=compensated, **knobs)
        print(f"40 200 distances, an iteration, compensated={compensated}: {seconds * 1e3:.2f} ms")
