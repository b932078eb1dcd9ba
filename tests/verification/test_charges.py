"""Charged liquids: a molten salt keeps its energy, a plasma has that of the literature."""

import numpy as np
import pytest

import particlesim as ps
from particlesim.scenes import molten_salt

pytest.importorskip("nvalchemiops", reason="extra electrostatics")


def drift(steps, device, precision, **options):
    """Of 64 molten ions: trend of their energy over a run, in parts of it; their momentum."""
    scene = molten_salt.build(edge=4, **options)
    knobs = {"integrator": "velocity_verlet", "precision": precision}
    sim = ps.Simulation(scene, ps.Settings(dt=1.0, substeps=20, **knobs), device=device)
    for _ in range(100):  # it melts
        sim.step()
    found = []
    for _ in range(steps // 20):
        sim.step()
        found.append(sim.diagnostics().energy[0])
    time = np.linspace(0.0, 1.0, len(found))
    trend = np.polyfit(time, found, 1)[0] / abs(np.mean(found))
    return abs(trend), np.abs(sim.diagnostics().momentum[0]).max()


@pytest.mark.slow
@pytest.mark.parametrize(("method", "tolerance"), [("particle_mesh_ewald", 1e-6), ("ewald", 1e-5)])
@pytest.mark.parametrize(("precision", "allowed"), [("float64", 1e-5), ("float32", 1e-3)])
def test_a_molten_salt_keeps_its_energy(method, tolerance, precision, allowed, device):
    """As a Lennard-Jones liquid does over 100 000 steps. Kicks are rounded, and add up at most. The
    mesh's forces, of about q^2 / d^2 = 0.5, are off by the tolerance: of 64 ions in some 5 000
    units of time, each long enough to forget the last, a random walk.
    """
    trend, momentum = drift(100_000, device, precision, method=method, tolerance=tolerance)
    assert trend < allowed
    rounding = 2e7 * np.finfo(precision).eps
    walk = 0.5 * tolerance * np.sqrt(64 * 5_000)
    assert momentum < rounding + 3.0 * walk


@pytest.mark.slow
@pytest.mark.parametrize("method", ["ewald", "particle_mesh_ewald"])
def test_a_plasma_of_one_component(method, device):
    """U / N k T = a G + b G^(1/4) + c G^(-1/4) + d at G = q^2 / (a_ws k T) = 10 (Slattery, Doolen
    and DeWitt 1980, eq. 8), -7.996: 128 charges and a background that neutralises them.

    Of 300 samples half are independent. A sample's spread is sqrt(C / N), C / k = u - G du/dG =
    0.59 by the same formula, 0.068, and the mean's 0.0055: four times that, and 0.3 % for so few
    charges.
    """
    G, count = 10.0, 128
    known = -0.897744 * G + 0.95043 * G**0.25 + 0.18956 * G**-0.25 - 0.81487
    box = (4.0 * np.pi / 3.0 * count) ** (1.0 / 3.0)  # a_ws = 1
    scene = ps.Scene(periodic=((0, 0, 0), (box,) * 3))
    v = ps.sample.maxwell_boltzmann(count, 1.0 / G, 1.0, seed=1)
    scene.add_particles(ps.sample.lattice("bcc", (4, 4, 4), box / 4), velocity=v, charge=1.0)
    scene.add_interaction(ps.Electrostatics(method, tolerance=1e-4))
    scene.add_thermostat(ps.Langevin(temperature=1.0 / G, friction=0.5, seed=2))
    settings = ps.Settings(dt=1.0, substeps=10, precision="float64")
    sim = ps.Simulation(scene, settings, device=device)
    found = []
    for _ in range(380):
        sim.step()
        found.append(sim.diagnostics().potential[0] / count * G)
    assert np.mean(found[80:]) == pytest.approx(known, abs=0.022 + 0.003 * abs(known))
