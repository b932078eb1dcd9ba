"""Scenes to make checkpoints of, and when two simulations are the same."""

import importlib
import json

import numpy as np

import particlesim as ps
from particlesim.commands.scene_files import ready_scenes
from particlesim.scene.fingerprint import fingerprint

SCENES = list(ready_scenes())


SMALL = {
    "dam_break": {"spacing": 0.05},
    "star_collision": {"count": 150},
    "sloshing_tank": {"spacing": 0.05},
    "sod_tube": {"count": 90},
    "sedov_blast": {"side": 10},
    "plummer_sphere": {"count": 300},
    "galaxy_collision": {"count": 300, "softening": 0.2},
    "freezing": {"cells": 5},
    "lj_melt": {"cells": 4},
    "molten_salt": {"edge": 4, "tolerance": 1e-4},
    "phase_transition": {"cells": 4},
    "polymer_melt": {"edge": 6},
    "gas_in_a_box": {"count": 400},
    "pile": {"count": 100},
}


def arrays(sim):
    return {name: array.numpy().copy() for name, array in sim.frames.snapshot.contents().items()}


def assert_same(sim, other):
    """Equal bits in every array: also NaN and the sign of zero would show."""
    ours, theirs = arrays(sim), arrays(other)
    assert ours.keys() == theirs.keys()
    for name, array in ours.items():
        assert array.dtype == theirs[name].dtype, name
        assert array.tobytes() == theirs[name].tobytes(), name
    assert sim.frame == other.frame and sim.time == other.time


def restart(sim, path, scene, frames=3, **options):
    """Save, go on, and go on from the file: both must end the same."""
    sim.save(path)
    saved = arrays(sim)
    loaded = ps.Simulation.load(path, scene, device=sim.device, **options)
    assert all(saved[name].tobytes() == each.tobytes() for name, each in arrays(loaded).items())
    sim.run(frames)
    loaded.run(frames)
    assert_same(sim, loaded)
    return loaded


def ropes(strength=None, count=4):
    """Ropes of different weight over a ground, with contacts."""
    scene = ps.Scene()
    for k in range(count):
        x = np.stack([np.linspace(0, 1, 9), np.full(9, 0.3), np.full(9, 0.2 * k)], axis=1)
        rope = scene.add_particles(x, mass=1.0 + k, radius=0.05, pinned=np.arange(9) == 0)
        pairs = np.stack([rope[:-1], rope[1:]], axis=1)
        scene.add_constraint(ps.Distance(pairs, compliance=1e-6, break_force=strength))
    scene.add_interaction(ps.UniformGravity())
    scene.add_constraint(ps.Contact(friction=0.3))
    scene.add_constraint(ps.PlaneBoundary((0, 0, 0), (0, 1, 0)))
    return scene


def pair(charge=1.0, **options):
    scene = ps.Scene(**options)
    scene.add_particles([(0, 0, 0), (1, 0, 0)], group="ends", charge=charge)
    scene.add_interaction(ps.Springs([(0, 1)], stiffness=10.0, rest_length=0.5))
    return scene


def described():
    """Fingerprints of all ready scenes, as they are saved."""
    modules = {name: importlib.import_module(f"particlesim.scenes.{name}") for name in SCENES}
    return {
        name: json.dumps(fingerprint([module.build(**SMALL.get(name, {}))]))
        for name, module in modules.items()
    }
