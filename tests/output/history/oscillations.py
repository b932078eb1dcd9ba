"""Simulations whose histories are known."""

import math

import particlesim as ps

OMEGA, STEPS = 2 * math.pi, 40  # of the oscillator: one period a second, steps a frame of 1/10 s


def oscillator(amplitude: float = 0.1) -> ps.Scene:
    """Two unit masses on a spring of k = omega^2 / 2, so that omega^2 = 2 k / m."""
    scene = ps.Scene()
    scene.add_particles([(-0.5 - amplitude / 2, 0, 0), (0.5 + amplitude / 2, 0, 0)])
    scene.add_interaction(ps.Springs([(0, 1)], stiffness=OMEGA**2 / 2, rest_length=1.0))
    return scene


def oscillation(worlds: int = 1, substeps: int = 4, **options) -> ps.Simulation:
    settings = ps.Settings(
        dt=0.1, substeps=substeps, integrator="velocity_verlet", precision="float64"
    )
    scenes = [oscillator(0.1 * (w + 1)) for w in range(worlds)]
    return ps.Simulation(scenes, settings, device="cpu")


def fluid() -> ps.Scene:
    """A block of water that falls into a box, on a rope that it hangs on with one drop."""
    scene = ps.Scene()
    block = ps.sample.box((0, 0, 0), (0.4, 0.4, 0.4), spacing=0.1)
    water = scene.add_particles(block, mass=1.0, radius=0.05, group="water")
    rope = scene.add_particles([(2, 0, 0), (2, 0.5, 0)], radius=0.1, pinned=[False, True])
    scene.add_interaction(ps.UniformGravity((0, -9.81, 0)))
    tait = ps.Tait(sound_speed=10.0)
    scene.add_interaction(
        ps.SPH(water, smoothing_length=0.2, rest_density=1000.0, equation_of_state=tait)
    )
    scene.add_constraint(ps.Distance([tuple(rope)], rest_length=0.4))
    scene.add_constraint(ps.BoxBoundary((-1, 0.02, -1), (3, 5, 2)))
    scene.add_constraint(ps.Contact(rope))
    return scene


def run(sim: ps.Simulation, path, frames: int) -> list:
    """A run with a history; returns the diagnostics of every frame."""
    found = [sim.diagnostics()]
    sim.run(frames, history=path, progress=lambda *_: found.append(sim.diagnostics()))
    return found
