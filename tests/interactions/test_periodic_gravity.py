"""Gravity between all images of a periodic box: sums in NumPy, softening, energies and virials."""

import math

import numpy as np
import pytest

import particlesim as ps
from cases.images import images
from cases.worlds import equal_alone

pytest.importorskip("nvalchemiops", reason="extra electrostatics")
METHODS = ("ewald", "particle_mesh_ewald")
BOX, G = np.array([6.0, 7.0, 8.0]), 0.7


def bodies(seed=0, count=40):
    rng = np.random.default_rng(seed)
    return rng.uniform(0, 1, (count, 3)) * BOX, rng.uniform(0.5, 2.0, count)


def universe(x, m, box=BOX, **options):
    scene = ps.Scene(periodic=((0, 0, 0), tuple(box)))
    scene.add_particles(x, mass=m)
    scene.add_interaction(ps.Gravity(**{"G": G, **options}))
    return scene


def simulate(scenes, device="cpu", **knobs):
    return ps.Simulation(scenes, ps.Settings(**{"precision": "float64", **knobs}), device=device)


@pytest.mark.parametrize(
    "method", [pytest.param(name, marks=[pytest.mark.slow] * (name == "ewald")) for name in METHODS]
)
def test_it_is_that_of_all_images(method, device):
    """Ewald's sum to rounding, less what the background has with the masses, pi M^2 / (2 a^2 V) at
    its damping; to ten times the tolerance, as for charges. Without softening U is its own virial.
    """
    x, m = bodies()
    U, F = images(x, m, BOX)
    a = 6.0 / (0.6 * BOX.min())
    U -= math.pi * m.sum() ** 2 / (2.0 * a**2 * BOX.prod())
    sim = simulate(universe(x, m, method=method, tolerance=1e-7), device)
    np.testing.assert_allclose(sim.get("force"), -G * F, rtol=0, atol=1e-6 * G * np.abs(F).max())
    found = sim.diagnostics()
    assert found.potential[0] == pytest.approx(-G * U, rel=1e-6)
    assert found.virial[0] == pytest.approx(found.potential[0], rel=1e-5)


@pytest.mark.parametrize("method", METHODS)
def test_softening_reaches_all_images(method, device):
    """Less than Newton's force by that of every image within 20 boxes.

    What is softened off at R is f = 1.5 s^2 R / R^5. Of images beyond all around, what is linear in
    d adds up, d / 3 of div f = -3 s^2 / R^5: d int 4 pi R^2 dR / L^3 s^2 / R^5 from 20 L, or
    2 pi s^2 d / L^3 / (20 L)^2.
    """
    L, s, d = 2.0, 0.3, np.array([0.3, 0.5, -0.2])
    x = np.array([[1.0, 1.0, 1.0], 1.0 + d])
    options = {"method": method, "tolerance": 1e-9}
    sharp, soft = (
        simulate(universe(x, 1.0, (L,) * 3, softening=each, **options), device).get("force")[1]
        for each in (0.0, s)
    )
    n = np.arange(-20, 21)
    cells = np.stack(np.meshgrid(n, n, n, indexing="ij"), axis=-1).reshape(-1, 3)
    r = d + L * cells
    r2 = (r**2).sum(axis=1)
    less = G * (r * (r2**-1.5 - (r2 + s * s) ** -1.5)[:, None]).sum(axis=0)
    beyond = 2.0 * math.pi * s**2 * np.linalg.norm(d) / L**3 / (20 * L) ** 2
    np.testing.assert_allclose(soft - sharp, less, rtol=0, atol=G * beyond)


@pytest.mark.slow
@pytest.mark.parametrize("method", METHODS)
def test_the_virial_is_how_energy_answers_to_the_scale(method):
    """-dU / d ln(scale) of box and places, by central differences of 1e-3: off by 1e-6 and by 1e-9
    of U over 1e-3. Where near pairs end makes no difference.
    """
    x, m = bodies(1)
    options = {"method": method, "tolerance": 1e-9, "softening": 0.4}
    up, down = (
        simulate(universe(x * each, m, BOX * each, **options)).diagnostics().potential[0]
        for each in (1.001, 0.999)
    )
    sims = [simulate(universe(x, m, **options, cutoff=cutoff)) for cutoff in (None, 2.2)]
    a, b = (sim.diagnostics() for sim in sims)
    assert a.virial[0] == pytest.approx(-(up - down) / 0.002, rel=1e-5)
    assert a.virial[0] == pytest.approx(b.virial[0], rel=1e-6)
    assert a.potential[0] == pytest.approx(b.potential[0], rel=1e-7)


@pytest.mark.slow
@pytest.mark.parametrize("method", METHODS)
def test_a_world_goes_as_it_goes_alone(method, device):
    scenes = [
        universe(*bodies(0), method=method, softening=0.2),
        universe(*bodies(1, 30), method=method, softening=0.0, tolerance=1e-3),
    ]
    equal_alone(simulate, scenes, device, 3, dt=1e-6, substeps=2)


@pytest.mark.slow
def test_units_of_planets():
    """Masses whose squares no single precision holds, against the same in double."""
    x, m = bodies()
    options = {"G": 6.6743e-11, "method": "particle_mesh_ewald", "tolerance": 1e-4}
    scene = universe(x * 1e9, m * 1e30, BOX * 1e9, **options)
    single, double = (simulate(scene, precision=p).get("force") for p in ("float32", "float64"))
    # Places at 8 are rounded by 2.4e-7, and the closest two are 0.2 apart.
    np.testing.assert_allclose(single, double, rtol=0, atol=5e-6 * np.abs(double).max())


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"method": "fast"}, "Gravity: method must be one of"),
        ({"cutoff": 2.0}, "Gravity: cutoff must be left out without a method"),
        ({"method": "ewald", "softening": None}, "Gravity: softening must be one length"),
        ({"method": "ewald", "tolerance": 0.0}, "Gravity: tolerance must be above 0"),
        ({"method": "ewald", "cutoff": -1.0}, "Gravity: cutoff must be above 0"),
        ({"method": "ewald"}, "Gravity: scene must be periodic along all axes"),
    ],
)
def test_what_does_not_fit_is_refused(options, message):
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0), (1, 0, 0)])
    with pytest.raises(ValueError, match=message):
        scene.add_interaction(ps.Gravity(**options))
        simulate(scene)
