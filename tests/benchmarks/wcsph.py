"""Particle-steps per second of a weakly compressible dam break, whole steps on the CPU.

59 319 particles in a trough, support 2 spacings (30 neighbours), cubic spline, Tait, artificial
viscosity, float32: the setting of the SPlisHSPlasH measurement (0.43 to 0.53 M/s on one core, 0.51
on two), with springs for walls instead of boundary particles. Timing starts once the column is
flowing, so that lists are rebuilt as often as a flow asks for.

    python tests/benchmarks/wcsph.py [--repeats 7] [--steps 40] [--threads 1 2] [--start 0.2]
"""

import argparse
import statistics
import time

import warp as wp

import particlesim as ps

SPACING, SIDE = 0.02, 39
SMOOTHING_LENGTH = SPACING
SOUND_SPEED = 40.0  # ten times sqrt(2 g H), the speed of a fall from the column's height
STEP = 0.3 * SMOOTHING_LENGTH / SOUND_SPEED


@ps.law
def walls(position: wp.vec3, mass: float, stiffness: float, length: float, width: float):
    """Springs against what lies outside of a trough, stiffness per mass."""
    low = wp.vec3(wp.min(position[0], 0.0), wp.min(position[1], 0.0), wp.min(position[2], 0.0))
    high = wp.vec3(wp.max(position[0] - length, 0.0), 0.0, wp.max(position[2] - width, 0.0))
    return -mass * stiffness * (low + high)


def build() -> ps.Scene:
    """A column of water at the end of a trough three times as long."""
    scene = ps.Scene()
    side = SIDE * SPACING
    water = scene.add_particles(
        ps.sample.box((0, 0, 0), (side, side, side), SPACING, jitter=0.05),
        mass=1000.0 * SPACING**3,
    )
    scene.add_interaction(ps.UniformGravity((0.0, -9.81, 0.0)))
    scene.add_interaction(
        ps.ParticleForce(walls, stiffness=0.05 / STEP**2, length=3 * side, width=side)
    )
    scene.add_interaction(
        ps.SPH(
            water,
            smoothing_length=SMOOTHING_LENGTH,
            rest_density=1000.0,
            equation_of_state=ps.Tait(SOUND_SPEED),
            smoothing="cubic_spline",
            viscosity=ps.ArtificialViscosity(0.05),
        )
    )
    return scene


def main() -> None:
    """Print the rate for each number of threads."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--repeats", type=int, default=7)
    parser.add_argument("--steps", type=int, default=40, help="steps a repeat")
    parser.add_argument("--threads", type=int, nargs="+", default=[1, 2])
    parser.add_argument("--start", type=float, default=0.2, help="simulated time before timing [s]")
    options = parser.parse_args()
    wp.config.quiet = True
    scene = build()
    settings = ps.Settings(dt=options.steps * STEP, substeps=options.steps)
    print(f"{scene.particle_count} particles, h = {SMOOTHING_LENGTH:g}, dt = {STEP:g}", flush=True)
    flowing = ps.Simulation(scene, settings, device="cpu")
    flowing.run(round(options.start / settings.dt))
    for threads in options.threads:
        sim = ps.Simulation(scene, settings.replace(threads=threads), device="cpu")
        sim.position, sim.velocity = flowing.position, flowing.velocity
        sim.run(4)  # chooses between graph and threads
        rates = []
        for _ in range(options.repeats):
            start = time.perf_counter()
            sim.step()
            rates.append(sim.particle_count * options.steps / (time.perf_counter() - start) / 1e6)
        print(
            f"{threads} thread{'s' if threads > 1 else ''}: {statistics.median(rates):.2f} M "
            f"particle-steps/s (from {min(rates):.2f} to {max(rates):.2f}), "
            f"{sim.neighbors.lists[0].describe()}",
            flush=True,
        )
        sim.close()


if __name__ == "__main__":
    main()
