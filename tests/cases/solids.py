"""Blocks of an elastic solid."""

import numpy as np

import particlesim as ps

Y, NU, SPACING, DENSITY = 1e4, 0.3, 0.1, 1000.0
VERLET = {"precision": "float64", "integrator": "velocity_verlet"}


def block(dimension, cells=(4, 5, 3), jitter=0.1, seed=0):
    """Points about a lattice, in the plane or in space."""
    upper = SPACING * np.array([*cells[:dimension], *[1] * (3 - dimension)])
    x = ps.sample.box((0, 0, 0), upper, spacing=SPACING)
    x[:, :dimension] += (
        jitter * SPACING * np.random.default_rng(seed).uniform(-1, 1, (len(x), dimension))
    )
    return x


def body(x, dimension=3, periodic=None, velocity=(0, 0, 0), pinned=False, **options):
    """A scene of one solid."""
    scene = ps.Scene(periodic=periodic)
    mass = DENSITY * SPACING**dimension
    group = scene.add_particles(x, mass=mass, velocity=velocity, pinned=pinned)
    given = {"smoothing_length": 1.5 * SPACING, "rest_density": DENSITY, "dimension": dimension}
    scene.add_interaction(ps.ElasticSolid(group, **{"youngs_modulus": Y, "poissons_ratio": NU,
                                                    **given, **options}))  # fmt: skip
    return scene


def simulation(scene, **knobs):
    return ps.Simulation(scene, ps.Settings(**{"dt": 1e-3, **VERLET, **knobs}), device="cpu")
