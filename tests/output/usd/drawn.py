"""Simulations to be recorded, and what their recordings draw."""

import numpy as np

import particlesim as ps


def names(stage, kind):
    """Paths of the prims of a type, below the worlds."""
    return [str(p.GetPath())[7:] for p in stage.Traverse() if p.GetTypeName() == kind]


def record(sim, path, frames, **options):
    """Record a run; positions and velocities of every frame of the simulation."""
    states = []
    with ps.UsdRecorder(sim, path, frames=frames, **options) as out:
        for frame in range(frames + 1):
            states.append((sim.position, sim.velocity))
            out.write()
            if frame < frames:
                sim.step()
    return [np.array(each) for each in zip(*states, strict=True)]


def flying(count=4, groups=("a", "b"), **options):
    """Particles that fly straight on, each at a speed of its own."""
    scene = ps.Scene(**options)
    for k, name in enumerate(groups):
        rows = np.arange(count) + 10.0 * k
        scene.add_particles(
            np.stack([rows, 0 * rows, 0 * rows], axis=1), group=name, radius=0.1, charge=rows,
            velocity=np.stack([0 * rows, 1 + rows, 0 * rows], axis=1),
        )  # fmt: skip
    return scene


SETTINGS = ps.Settings(dt=1 / 32, substeps=1)  # exact in binary


def pool(count=5, **options):
    scene = ps.Scene()
    water = scene.add_particles(
        ps.sample.box((0, 0, 0), (1, 1, 1), spacing=1 / count), mass=1 / count**3,
        radius=0.5 / count, group="water", **options,
    )  # fmt: skip
    scene.add_particles([(0, 3, 0)], group="duck")
    scene.add_interaction(
        ps.SPH(water, smoothing_length=2.6 / count, rest_density=1.0,
               equation_of_state=ps.Tait(5.0))
    )  # fmt: skip
    return scene
