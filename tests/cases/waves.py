"""Standing waves, and the damped oscillations that fit them."""

import numpy as np

import particlesim as ps
from particlesim.scenes import standing_wave


def fitted(length, spacing, density=None):
    """Period over the exact one, and damping [1/s], of the oscillation that fits three best."""
    exact = standing_wave.period(length)
    dt = exact / 40
    scene = standing_wave.build(length, spacing, density=density)
    sound = scene.interactions[1].parameters["state_sound_speed"]
    substeps = int(np.ceil(dt / (0.35 * 2 * spacing / sound)))
    settings = standing_wave.settings.replace(dt=dt, substeps=substeps)
    sim = ps.Simulation(scene, settings, device="cpu")
    signal = [standing_wave.amplitude(sim)]
    for _ in range(120):
        sim.step()
        signal.append(standing_wave.amplitude(sim))
    t, best = dt * np.arange(121), (np.inf, 0.0, 0.0)
    for ratio in np.linspace(0.9, 1.15, 251):
        for damping in np.linspace(0.0, 2.0, 41):
            phase, fall = 2 * np.pi * t / (ratio * exact), np.exp(-damping * t)
            basis = np.stack([fall * np.cos(phase), fall * np.sin(phase)], axis=1)
            left = signal - basis @ np.linalg.lstsq(basis, signal, rcond=None)[0]
            best = min(best, ((left**2).sum(), ratio, damping))
    return best[1:]
