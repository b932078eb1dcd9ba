"""Temperature, pressure, g(r), displacements and velocities: lattices, ideal gases, free flight."""

import numpy as np
import pytest

import particlesim as ps
from cases.parts import bending, screened


def gas(count=400, side=3.0, temperature=1.7, seed=0):
    rng = np.random.default_rng(seed)
    scene = ps.Scene(periodic=((-1, -1, -1), (side - 1,) * 3))
    scene.add_particles(
        rng.uniform(-1, side - 1, (count, 3)), mass=2.0, group="gas",
        velocity=ps.sample.maxwell_boltzmann(count, temperature, 2.0, seed=seed),
    )  # fmt: skip
    return scene


def test_temperature_and_pressure_of_an_ideal_gas(device):
    scenes = [gas(), gas(200, 2.0, 0.5)]
    found = ps.Simulation(scenes, ps.Settings(precision="float64"), device=device).diagnostics()
    for w, (count, side) in enumerate([(400, 3.0), (200, 2.0)]):
        kt = 2.0 * (scenes[w].velocity ** 2).mean()
        # Sums of 1200 squares, each right to some eps.
        assert found.temperature[w] == pytest.approx(kt, rel=1e-13)
        assert found.pressure[w] == pytest.approx(count * kt / side**3, rel=1e-13)
    # Sampled at T, of 1200 numbers whose squares scatter by sqrt(2 / 1200).
    assert found.temperature[0] == pytest.approx(1.7, rel=4 * np.sqrt(2 / 1200))


def test_pinned_particles_are_not_warm_and_open_scenes_have_no_pressure(device):
    scene = ps.Scene(periodic=((0, None, 0), (1, None, 1)))
    scene.add_particles([(0, 0, 0), (0, 1, 0)], velocity=(3, 0, 0), pinned=[False, True])
    found = ps.Simulation(scene, device=device).diagnostics()
    assert found.temperature[0] == pytest.approx(3.0) and found.free[0] == 1
    assert np.isnan(found.pressure[0])
    nothing = ps.Simulation(ps.Scene(), device=device).diagnostics()
    assert nothing.temperature.tolist() == [0.0]


def test_pressure_is_minus_the_slope_of_the_energy_by_the_volume(device):
    """At rest, of pairs, bonds and angles: P = -dU/dV as all places scale with the box."""

    def build(scale):
        rng = np.random.default_rng(5)
        side = 4.0 * scale
        scene = ps.Scene(periodic=((0, 0, 0), (side,) * 3))
        x = ps.sample.lattice("sc", (4, 4, 4), 1.0) + rng.uniform(-0.1, 0.1, (64, 3))
        scene.add_particles(x * scale)
        scene.add_interaction(ps.LennardJones(cutoff=1.9, truncation="shift"))
        scene.add_interaction(ps.Bonds([(0, 1), (5, 4)], screened, strength=3.0, reach=1.4))
        scene.add_interaction(ps.Angles([(0, 1, 2), (6, 5, 4)], bending, epsilon=3.0))
        return ps.Simulation(scene, ps.Settings(precision="float64"), device=device)

    h = 1e-4
    slope = np.subtract(*(build(1 + s).diagnostics().potential[0] for s in (h, -h))) / (2 * h)
    # dU/dV = dU/ds / (3 V). Central differences leave h^2 u''' / 6 of about 12^3 u.
    wanted = -slope / (3 * 64)
    assert build(1.0).diagnostics().pressure[0] == pytest.approx(wanted, rel=1e-4)


@pytest.mark.parametrize("far", [0.0, 7.3])
def test_shells_of_a_lattice(far, precision, device):
    # A simple cubic lattice has 6 at 1, 12 at sqrt(2), 8 at sqrt(3), 6 at 2.
    scene = ps.Scene(periodic=((far,) * 3, (far + 5,) * 3))
    scene.add_particles(far + 1e-3 + ps.sample.lattice("sc", (5, 5, 5), 1.0))
    sim = ps.Simulation(scene, ps.Settings(precision=precision), device=device, worlds=2)
    g = ps.radial_distribution(sim, bins=20, reach=2.2)  # none is at the edge of a bin
    expected = np.zeros(20)
    for r, neighbors in ((1.0, 6), (2**0.5, 12), (3**0.5, 8), (2.0, 6)):
        expected[int(r / 0.11)] = neighbors
    shells = 4 / 3 * np.pi * np.diff((0.11 * np.arange(21)) ** 3)
    np.testing.assert_allclose(g.value[0] * shells * 124 / 125, expected, rtol=1e-12)
    np.testing.assert_array_equal(g.value[0], g.value[1])


def test_an_ideal_gas_has_no_structure(device, refused):
    scenes = [gas(1000), gas(500, seed=1)]
    sim = ps.Simulation(scenes, device=device)
    g = ps.radial_distribution(sim, bins=5)
    for w, count in enumerate((1000, 500)):
        shells = 4 / 3 * np.pi * np.diff(np.linspace(0, 1.5, 6) ** 3)
        pairs = count * (count - 1) * shells / 27
        # Pairs are counted twice: a Poisson number of half of them.
        assert (np.abs(g.value[w] - 1) < 4 * np.sqrt(2 / pairs)).all()
    some = ps.radial_distribution(sim, range(100), range(50, 500), bins=5)
    assert np.abs(some.value[:, -1] - 1).max() < 4 * np.sqrt(2 / (100 * 450 * shells[-1] / 27))
    alone = ps.radial_distribution(ps.Simulation(scenes[1], device=device), "gas", bins=5)
    np.testing.assert_array_equal(alone.value[0], g.value[1])
    with refused("radial_distribution: reach must be at most 1.5"):
        ps.radial_distribution(sim, reach=1.6)
    with refused("scene must be periodic along all axes"):
        ps.radial_distribution(ps.Simulation(ps.Scene(), device=device))


def test_free_flight_and_what_is_left_of_velocities(device, refused):
    scenes = [gas(50), gas(30, seed=1)]
    sim = ps.Simulation(scenes, ps.Settings(dt=0.5, precision="float64"), device=device)
    sim.run(10)
    squares = np.array([(scene.velocity**2).sum(axis=1).mean() for scene in scenes])
    # (v t)^2, across faces; 100 sums of places within a few boxes.
    np.testing.assert_allclose(ps.mean_square_displacement(sim), squares * 25, rtol=1e-12)
    np.testing.assert_allclose(ps.velocity_autocorrelation(sim), squares, rtol=1e-14)
    one = ps.mean_square_displacement(sim, group=[3])
    speed = [(scene.velocity[3] ** 2).sum() for scene in scenes]
    np.testing.assert_allclose(one, 25 * np.array(speed), rtol=1e-12)
    places, velocities = sim.state.unwrapped(), 2.0 * sim.velocity
    sim.run(2)
    np.testing.assert_allclose(ps.mean_square_displacement(sim, since=places), squares, rtol=1e-12)
    np.testing.assert_allclose(
        ps.velocity_autocorrelation(sim, since=velocities), 2 * squares, rtol=1e-14
    )
    with refused(r"mean_square_displacement: since must have shape .*\(80, 3\)"):
        ps.mean_square_displacement(sim, since=places[:3])


def test_velocities_of_an_oscillator_turn_with_it(device):
    # v(t).v(0) = v^2 cos(omega t), omega^2 = k / m; Verlet's omega is 1 + (omega h)^2 / 24 of it.
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0)], pinned=True)
    scene.add_particles([(1, 0, 0)], velocity=(0.3, 0, 0), group="free")
    scene.add_interaction(ps.HarmonicBonds([(0, 1)], 4.0, 1.0))
    settings = ps.Settings(dt=0.1, substeps=50, precision="float64", integrator="velocity_verlet")
    sim = ps.Simulation(scene, settings, device=device)
    for frame in range(1, 21):
        sim.step()
        kept = ps.velocity_autocorrelation(sim, "free")[0]
        phase = (2 * 0.002) ** 2 / 24 * 0.2 * frame
        assert kept == pytest.approx(0.09 * np.cos(0.2 * frame), abs=0.09 * 2 * phase + 1e-13)
