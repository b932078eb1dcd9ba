"""Two disc galaxies pass through each other, and pull out tails and a bridge.

Units of one galaxy's mass and scale, G = 1. Each is a Plummer halo in equilibrium, which holds four
fifths of the mass, and a thin exponential disc that turns in the field of both, its stars on
circular orbits with a small spread (Toomre 1964: Q of about 1.5 keeps it from breaking up). They
come on a parabola of two points, as in Toomre and Toomre (1972), the first disc turning as they
pass, which its tails need, the second at right angles. Energy is kept within a few parts in a
thousand: what the halos' friction takes from the orbit heats the stars.
"""

import numpy as np

import particlesim as ps

frames = 300
settings = ps.Settings(dt=0.25, substeps=5, integrator="velocity_verlet", opening_angle=0.6)
DISC, LENGTH, THICKNESS, Q = 0.2, 0.5, 0.05, 1.5  # part of the mass; scales; spread
FARTHEST, EDGE = 5.0, 8.0  # of the disc, in its lengths; of the halo


def build(
    count: int = 50_000, separation: float = 12.0, pericentre: float = 1.5, softening: float = 0.05
) -> ps.Scene:
    """Two galaxies on their way towards each other.

    Args:
        count: Bodies of both, two fifths of them in the discs.
        separation: Of the centres.
        pericentre: Distance at which two points would pass.
        softening: Of each body.
    """
    scene = ps.Scene(up_axis="z")
    # A parabola of masses 1 and 1: v^2 = 2 G 2 / r, and v_t r = sqrt(2 G 2 r_p).
    across = 2.0 * np.sqrt(pericentre) / separation
    along = np.sqrt(4.0 / separation - across**2)
    for side, name, tilt in ((-1.0, "first", 0.0), (1.0, "second", 0.5 * np.pi)):
        place = np.array([side * separation / 2, 0.0, 0.0])
        speed = np.array([-side * along / 2, side * across / 2, 0.0])
        seed = int(side > 0)
        for part, make in (("halo", halo), ("disc", disc)):
            share, mass = (0.3, 1.0 - DISC) if part == "halo" else (0.2, DISC)
            x, v = make(max(2, round(share * count)), seed)
            axis, origin = (1, 0, 0), (0, 0, 0)
            scene.add_particles(
                place + ps.sample.rotate(x, axis, tilt, origin),
                velocity=speed + ps.sample.rotate(v, axis, tilt, origin),
                mass=mass / len(x), radius=0.02, group=f"{name} {part}",
            )  # fmt: skip
    scene.add_interaction(ps.Gravity(G=1.0, softening=softening))
    return scene


def halo(count: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """A Plummer sphere of mass 1 - DISC, with the speeds of all the mass in its profile."""
    within = (1.0 + 1.0 / EDGE**2) ** -1.5
    x = ps.sample.plummer((0, 0, 0), 1.0, int(count / within) + 1, seed)[:count]
    v = ps.sample.plummer_velocity(x, (0, 0, 0), 1.0, seed=seed)
    return x - x.mean(axis=0), v - v.mean(axis=0)


def disc(count: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Stars of surface density exp(-R / LENGTH) on nearly circular orbits about z."""
    rng = np.random.default_rng(seed)
    R, share = profile()
    R = np.interp((np.arange(count) + 0.5) / count, share, R)
    angle = rng.uniform(0.0, 2.0 * np.pi, count)
    out = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    around = np.stack([-out[:, 1], out[:, 0], 0 * angle], axis=1)
    x = R[:, None] * out
    height = THICKNESS * LENGTH
    x[:, 2] = height * np.arctanh(rng.uniform(-0.99, 0.99, count))
    omega, kappa = turning(R)
    density = DISC * np.exp(-R / LENGTH) / (2.0 * np.pi * LENGTH**2)
    spread = np.minimum(Q * 3.36 * density / kappa, 0.3 * omega * R)
    v = (omega * R)[:, None] * around + (spread * rng.normal(size=count))[:, None] * out
    v += (0.5 * kappa / omega * spread * rng.normal(size=count))[:, None] * around
    v[:, 2] += np.sqrt(np.pi * density * height) * rng.normal(size=count)
    return x - x.mean(axis=0), v - v.mean(axis=0)


def profile() -> tuple[np.ndarray, np.ndarray]:
    """Radii, and the part of the disc's mass within each."""
    R = np.linspace(1e-3, FARTHEST, 2000) * LENGTH
    within = 1.0 - (1.0 + R / LENGTH) * np.exp(-R / LENGTH)
    return R, within / within[-1]


def turning(R: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Angular speed of a circular orbit at R, and the frequency of small swings about it."""
    nodes, within = profile()
    pull = (1.0 - DISC) * nodes / (nodes**2 + 1.0) ** 1.5 + DISC * within / nodes**2
    omega2 = pull / nodes
    kappa2 = nodes * np.gradient(omega2, nodes) + 4.0 * omega2
    return np.sqrt(np.interp(R, nodes, omega2)), np.sqrt(np.interp(R, nodes, kappa2))
