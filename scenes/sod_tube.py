"""Sod's tube (1978): dense hot gas bursts into thin gas, in a shock, a contact and a fan.

On a line, with particles of equal mass: eight times as many to a length in the dense half, which
smoothing lengths follow. Ends are pinned gas, which no wave reaches in the time that is run.
"""

import numpy as np

import particlesim as ps

GAMMA = 1.4
# Pressure and speed between shock and fan, the densities on both sides of the contact there, and
# the speeds of the shock, of the fan's tail and of its head (Toro 2009, section 4.3.3, test 1).
SPEED, LEFT, RIGHT = 0.927452620, 0.426319428, 0.265573712
SHOCK, TAIL, HEAD = 1.752155732, -0.070272813, -(GAMMA**0.5)
PINNED = 10  # particles at either end

frames = 4
settings = ps.Settings(dt=0.05, substeps=300, integrator="velocity_verlet")


def build(count: int = 400, eta: float = 1.2, alpha: float = 1.0, beta: float = 2.0) -> ps.Scene:
    """The tube from -1/2 to 1/2, with (density, pressure) = (1, 1) and (1/8, 1/10).

    Args:
        count: Particles along the tube, nine times some number or nearly so.
        eta: Smoothing lengths, in spacings.
        alpha: Of the viscosity.
        beta: Likewise.
    """
    thin = max(1, round(count / 9))
    dense, scene = 8 * thin, ps.Scene()
    left = (np.arange(-PINNED, dense) + 0.5) / dense * 0.5 - 0.5
    right = (np.arange(0, thin + PINNED) + 0.5) / thin * 0.5
    x = np.concatenate([left, right])
    scene.add_particles(
        x[:, None] * [1.0, 0.0, 0.0], mass=0.5 / dense, radius=0.2 / dense,
        pinned=np.abs(x) > 0.5, internal_energy=np.where(x < 0, 1.0, 0.8) / (GAMMA - 1.0),
        group="gas",
    )  # fmt: skip
    scene.add_interaction(
        ps.SPH(
            smoothing_length=ps.AdaptiveSmoothing(eta),
            equation_of_state=ps.IdealGas(GAMMA),
            smoothing="cubic_spline",
            viscosity=ps.ArtificialViscosity(alpha, beta),
            dimension=1,
        )
    )
    return scene


def density(speed: np.ndarray) -> np.ndarray:
    """The exact density at x / t."""
    c = -HEAD
    fan = (2.0 / (GAMMA + 1.0) - (GAMMA - 1.0) / (GAMMA + 1.0) * speed / c) ** (2.0 / (GAMMA - 1.0))
    edges = [speed < HEAD, speed < TAIL, speed < SPEED, speed < SHOCK]
    return np.select(edges, [1.0, fan, LEFT, RIGHT], 0.125)


def error(sim: ps.Simulation) -> float:
    """Integral of the size of the density's error, as a part of that of the density."""
    (scene,) = sim.scenes
    x, rho = sim.position[:, 0], sim.get("density")
    inside = np.abs(x) < 0.48
    x, rho, volume = x[inside], rho[inside], (scene.mass / rho)[inside]
    exact = density(x / sim.time) if sim.time > 0 else np.where(x < 0, 1.0, 0.125)
    return float((volume * np.abs(rho - exact)).sum() / (volume * exact).sum())
