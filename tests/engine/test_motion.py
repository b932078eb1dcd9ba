"""Kicks and drifts on the CPU's vector units, against Warp's own, which are the reference."""

import numpy as np
import pytest

import particlesim as ps
from particlesim.engine.model import Model

COUNT = 150  # of a world: blocks of rows are full, left over, and of two worlds at once


def build(periodic, forces, constrained):
    rng = np.random.default_rng(5)
    scene = ps.Scene(periodic=((0, -1, 0), (2, None, 3)) if periodic else None)
    x = rng.uniform(0, 2, (COUNT, 3))
    pinned = np.arange(COUNT) % 37 == 0
    scene.add_particles(
        x, velocity=rng.normal(size=x.shape), mass=rng.uniform(1, 2, COUNT), radius=0.05,
        pinned=pinned,
    )  # fmt: skip
    if forces:
        scene.add_interaction(ps.UniformGravity((1, -9.81, 2)))
        scene.add_interaction(ps.Drag(linear=0.1))
    if constrained:  # whose friction remembers where the substep began
        scene.add_constraint(ps.PlaneBoundary((0, 0, 0), (0, 1, 0), friction=0.2))
    return scene


CASES = {
    "free": (False, False, False, "symplectic_euler"),
    "forces": (False, True, False, "symplectic_euler"),
    "constraints": (False, True, True, "symplectic_euler"),
    "verlet in a box": (True, True, False, "velocity_verlet"),
    "constraints in a box": (True, True, True, "symplectic_euler"),
}


@pytest.mark.parametrize("precision", ["float32", "float64"])
@pytest.mark.parametrize("compensated", [True, False], ids=["compensated", "plain sums"])
@pytest.mark.parametrize("name", CASES)
def test_lanes_make_the_bits_of_one_after_the_other(name, compensated, precision, monkeypatch):
    *options, integrator = CASES[name]
    results = []
    for vectorised in (True, False):
        monkeypatch.setattr(Model, "vectorised", vectorised)
        settings = ps.Settings(
            dt=0.1, substeps=3, precision=precision, compensated=compensated,
            integrator=integrator, watchdog=False,
        )  # fmt: skip
        sim = ps.Simulation([build(*options), build(*options)], settings, device="cpu")
        for _ in range(4):
            sim.step()
        results.append({key: each.numpy().tobytes() for key, each in sim.state.arrays.items()})
        if options[0]:
            assert sim.state.image.numpy().any()
    assert results[0] == results[1]
