"""A salt crystal melts: ions of both signs that soft cores keep apart (Hansen and McDonald 1975).

    u = (1 / 9) (lambda / r)^9 + z_i z_j lambda / r,   z = 1 and -1

in units of the charges' own energy at lambda, where two unlike ones have their least energy. The
box has 0.368 ions per lambda^3, at which they found a simple liquid at k T = 0.0177; it starts from
the rock salt lattice, hotter, and is left to itself. All images are summed up by a mesh. Energy is
what it keeps: the error is what it has lost or gained since the start, in parts.
"""

import numpy as np
import warp as wp

import particlesim as ps

frames = 200
settings = ps.Settings(dt=0.2, substeps=4, integrator="velocity_verlet", precision="float64")


@ps.law
def core(distance_squared: float):
    d8 = distance_squared * distance_squared * distance_squared * distance_squared
    return 1.0 / (9.0 * d8 * wp.sqrt(distance_squared))


def build(
    edge: int = 6, density: float = 0.368, temperature: float = 0.0354, seed: int = 0,
    method: str = "particle_mesh_ewald", tolerance: float = 1e-6,
) -> ps.Scene:  # fmt: skip
    """A periodic box of edge^3 ions.

    Args:
        edge: Ions along a side, an even number, at least 4.
        density: Ions per lambda^3.
        temperature: At the start, half of which goes into the lattice [energy / k].
        seed: Of the velocities.
        method: How all images are summed up, as of ``Electrostatics``.
        tolerance: What these sums may leave out, in parts.
    """
    count, spacing = edge**3, density ** (-1 / 3)
    x = ps.sample.lattice("sc", (edge, edge, edge), spacing)
    scene = ps.Scene(up_axis="z", periodic=((0, 0, 0), (edge * spacing,) * 3))
    ions = scene.add_particles(
        x,
        velocity=ps.sample.maxwell_boltzmann(count, temperature, 1.0, seed=seed),
        charge=(-1.0) ** np.floor(x / spacing).sum(axis=1),
        radius=0.5,
        group="ions",
    )
    cutoff = min(3.0, 0.499 * edge * spacing)
    scene.add_interaction(ps.PairPotential(core, ions, cutoff=cutoff, truncation="force_shift"))
    scene.add_interaction(ps.Electrostatics(method, ions, tolerance=tolerance))
    return scene


def error(sim: ps.Simulation) -> float:
    """Difference of the energy from that of the start, relative."""
    start = ps.Simulation(sim.scenes[0], sim.settings, device=sim.model.device)
    before = float(start.diagnostics().energy[0])
    return abs(float(sim.diagnostics().energy[0]) / before - 1.0)
