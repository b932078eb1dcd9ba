"""A chain between two nails settles to the curve that Huygens, Leibniz and Bernoulli found in 1691.

Of span 1 and length 1.2 it hangs 0.292344 low in the middle; 20 links 0.292721, 60 links 0.292386.
"""

import functools

import numpy as np

import particlesim as ps

frames = 240
settings = ps.Settings(dt=1 / 60, substeps=200, precision="float64")

SPAN, LENGTH, MASS = 1.0, 1.2, 1.0  # [m], [m], [kg]


def build(links: int = 60, damping: float = 6.0) -> ps.Scene:
    """A chain that is let go as a V, in air that brings it to rest.

    Args:
        links: Of the chain, an even number.
        damping: Rate at which the air slows a mass [1/s].
    """
    scene = ps.Scene()
    dip = 0.5 * np.sqrt(LENGTH**2 - SPAN**2)
    start = [(-0.5 * SPAN, 0, 0), (0, -dip, 0), (0.5 * SPAN, 0, 0)]
    scene.add_rope(
        ps.sample.curve(start, LENGTH / links), linear_density=MASS / LENGTH,
        radius=0.4 * LENGTH / links, pinned=[0, -1], group="chain",
    )  # fmt: skip
    scene.add_interaction(ps.UniformGravity((0, -9.81, 0)))
    scene.add_interaction(ps.Drag(linear=damping * MASS / links))
    return scene


def error(sim: ps.Simulation) -> float:
    """Difference of the sag from that of a chain of infinitely many links [m]."""
    return abs(-float(sim.position[:, 1].min()) - sag())


@functools.cache
def sag() -> float:
    """a (cosh(d / 2a) - 1) with 2 a sinh(d / 2a) = L, by Newton's method for u = d / 2a."""
    u = 1.0
    for _ in range(20):
        u -= (np.sinh(u) / u - LENGTH / SPAN) / ((u * np.cosh(u) - np.sinh(u)) / u**2)
    return float(SPAN / (2 * u) * (np.cosh(u) - 1))
