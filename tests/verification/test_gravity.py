"""Gravity against Kepler, and the figure eight of three bodies (G = 1)."""

import numpy as np
import pytest

import particlesim as ps


def orbit(eccentricity, steps, device, orbits=10):
    """Relative energies of every step, and the distance from the start after whole orbits."""
    e = eccentricity
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0)], pinned=True)
    scene.add_particles([(1 - e, 0, 0)], velocity=(0, np.sqrt((1 + e) / (1 - e)), 0))
    scene.add_interaction(ps.Gravity(G=1.0))
    settings = ps.Settings(
        dt=2 * np.pi / steps, substeps=1, integrator="velocity_verlet", precision="float64"
    )
    sim = ps.Simulation(scene, settings, device=device)
    energy = []
    for _ in range(orbits * steps):
        sim.step()
        x, v = sim.position[1], sim.velocity[1]
        energy.append(0.5 * v @ v - 1 / np.linalg.norm(x))
    assert sim.diagnostics().energy[0] == pytest.approx(energy[-1], rel=1e-14)
    error = np.linalg.norm(sim.position[1] - scene.position[1])
    return np.abs(np.array(energy) / -0.5 - 1).max(), error


# Ten orbits by kick, drift, kick in float64: largest |dE/E| and the error of the position.
KEPLER = {
    (0.5, 100): (1.08e-2, 1.32), (0.5, 1000): (1.07e-4, 1.77e-2),
    (0.0, 100): (3.9e-6, 8.3e-2), (0.0, 1000): (3.9e-10, 8.3e-4),
}  # fmt: skip


@pytest.mark.parametrize(("eccentricity", "steps"), KEPLER)
def test_kepler(eccentricity, steps, device):
    energy, position = orbit(eccentricity, steps, device)
    # To the digits given: 3, and 2 for the circle, half of the last one.
    digits = 0.005 if eccentricity else 0.015
    known = KEPLER[eccentricity, steps]
    assert energy == pytest.approx(known[0], rel=digits)
    assert position == pytest.approx(known[1], rel=digits)


def test_kepler_is_of_second_order(device):
    # A tenth of the step is a hundredth of the error, at 1000 steps an orbit and beyond.
    coarse = orbit(0.5, 1000, device, orbits=1)
    fine = orbit(0.5, 2000, device, orbits=1)
    assert np.log2(coarse[0] / fine[0]) == pytest.approx(2, abs=0.02)
    assert np.log2(coarse[1] / fine[1]) == pytest.approx(2, abs=0.02)


def test_figure_eight(device):
    # Chenciner and Montgomery (2000): E = -1.28714199177, L = 0, back after T = 6.32591398.
    period, frames = 6.32591398, 100
    first = np.array([0.97000436, -0.24308753, 0.0])
    third = np.array([-0.93240737, -0.86473146, 0.0])
    start = np.array([first, -first, 0 * first])
    scene = ps.Scene()
    scene.add_particles(start, velocity=[-third / 2, -third / 2, third])
    scene.add_interaction(ps.Gravity(G=1.0))
    settings = ps.Settings(
        dt=period / frames, substeps=100, integrator="velocity_verlet", precision="float64"
    )
    sim = ps.Simulation(scene, settings, device=device)
    before = sim.diagnostics()
    # The start is given to 8 digits, and the energy follows from it to the 11 that are known.
    assert before.energy[0] == pytest.approx(-1.28714199177, abs=5e-12 * 100)
    assert np.abs(before.angular_momentum).max() < 1e-15
    sim.run(frames // 3)
    assert np.abs(sim.position - start).max() > 0.5
    sim.run(frames - frames // 3)
    # Leapfrog of 10^4 steps: (dt)^2 = 4e-7 times accelerations and their rates, near 1.
    assert np.abs(sim.position - start).max() < 4e-6
    after = sim.diagnostics()
    assert after.energy[0] == pytest.approx(before.energy[0], rel=1e-9)
    assert np.abs(after.angular_momentum).max() < 1e-13
    assert np.abs(after.momentum).max() < 1e-13


def test_a_uniform_sphere_holds_three_fifths(device):
    # U = -3/5 G M^2 / R for a full sphere; N points of equal mass miss their own cells, each of
    # which would add the self energy of a cell of volume 4 pi / 3 N: a factor 1 - O(N^(-2/3)),
    # and the sampled sum scatters by 1 / sqrt(N).
    n = 4000
    x = ps.sample.uniform_sphere((0, 0, 0), 1.0, n, seed=0)
    scene = ps.Scene()
    scene.add_particles(x, mass=1 / n)
    scene.add_interaction(ps.Gravity(G=1.0))
    found = ps.Simulation(scene, ps.Settings(precision="float64"), device=device).diagnostics()
    assert found.potential[0] == pytest.approx(-3 / 5, rel=n ** (-2 / 3) + 1 / np.sqrt(n))
    # Scale-free forces: the virial sum is the energy.
    assert found.virial[0] == pytest.approx(found.potential[0], rel=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize(("angle", "error"), [(0.5, 1e-3), (0.2, 3e-5)])
def test_a_tree_on_a_plummer_sphere(angle, error, device):
    # Root mean square of the relative error of single forces, on a sample: what is promised.
    n = 100_000
    x = ps.sample.plummer((0, 0, 0), 1.0, n).astype(np.float32).astype(float)
    x = x[np.random.default_rng(0).permutation(n)]
    scene = ps.Scene()
    scene.add_particles(x, mass=1 / n)
    scene.add_interaction(ps.Gravity(G=1.0))
    sim = ps.Simulation(scene, ps.Settings(opening_angle=angle), device=device)
    sim.forces(1.0)
    f, off = sim.get("force"), []
    for k in range(1000):
        d = x - x[k]
        r2 = (d**2).sum(axis=1)
        r2[k] = np.inf
        true = (d / r2[:, None] ** 1.5).sum(axis=0) / n**2
        off.append(np.linalg.norm(f[k] - true) / np.linalg.norm(true))
    assert np.sqrt(np.mean(np.square(off))) < error


@pytest.mark.parametrize("angle", [None, 0.5])
def test_plummer_sphere(angle, device):
    # U = -3 pi / 32 G M^2 / a. Of n points the sum lacks each one's own cell, n^(-2/3) of it, and
    # scatters by 1 / sqrt(n) as directions are random.
    n = 4000
    scene = ps.Scene()
    scene.add_particles(ps.sample.plummer((0, 0, 0), 1.0, n), mass=1 / n)
    scene.add_interaction(ps.Gravity(G=1.0))
    settings = ps.Settings(precision="float64", opening_angle=angle)
    found = ps.Simulation(scene, settings, device=device).diagnostics()
    within = n ** (-2 / 3) + 1 / np.sqrt(n)
    assert found.potential[0] == pytest.approx(-3 * np.pi / 32, rel=within)
    assert found.virial[0] == pytest.approx(found.potential[0], rel=1e-12)


@pytest.mark.parametrize(
    ("mass", "distance"), [(5.972e24, 1.496e11), (700.0, 2.4e13), (1e21, 1.3e14)]
)
@pytest.mark.parametrize("angle", [None, 0.5])
def test_the_sun_in_single_precision(mass, distance, angle, device):
    """Products of masses and powers of distances leave its range; force and energy do not."""
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0), (distance, 0, 0)], mass=[1.989e30, mass])
    scene.add_interaction(ps.Gravity(G=6.6743e-11))
    settings = ps.Settings(precision="float32", opening_angle=angle)
    sim = ps.Simulation(scene, settings, device=device)
    energy = 6.6743e-11 * 1.989e30 * mass / distance
    few = 10 * float(np.finfo(np.float32).eps)
    np.testing.assert_allclose(sim.get("force")[:, 0], np.array([1, -1]) * energy / distance, few)
    assert sim.diagnostics().potential[0] == pytest.approx(-energy, rel=few)
    assert sim.diagnostics().virial[0] == pytest.approx(-energy, rel=few)


def growth(n, method, device):
    """omega^2 of a plane wave in a cold lattice of n^3 bodies, in parts of 4 pi G rho."""
    x, k, steps, dt = ps.sample.lattice("sc", (n, n, n), 1.0 / n), 2.0 * np.pi, 17, 0.05
    shift = np.zeros_like(x)
    shift[:, 0] = 1e-4 / n * np.sin(k * x[:, 0])
    scene = ps.Scene(periodic=((0, 0, 0), (1, 1, 1)))
    scene.add_particles(x + shift, mass=1.0 / n**3)
    scene.add_interaction(ps.Gravity(method=method, tolerance=1e-8))
    settings = ps.Settings(dt=dt, substeps=1, precision="float64", integrator="velocity_verlet")
    sim = ps.Simulation(scene, settings, device=device)
    for _ in range(steps):
        sim.step()
    moved = (sim.position - x + 0.5) % 1.0 - 0.5
    # From rest the scheme gives cosh(steps theta) with cosh(theta) = 1 + (omega dt)^2 / 2, exactly.
    theta = np.arccosh((moved * shift).sum() / (shift**2).sum()) / steps
    return 2.0 * (np.cosh(theta) - 1.0) / dt**2 / (4.0 * np.pi)


@pytest.mark.parametrize(
    ("method", "n"),
    [
        ("particle_mesh_ewald", 4),
        pytest.param("ewald", 4, marks=pytest.mark.slow),
        pytest.param("particle_mesh_ewald", 8, marks=pytest.mark.slow),
    ],
)
def test_a_plane_wave_grows_as_of_jeans(method, n, device):
    """As cosh(sqrt(4 pi G rho) t) of a cold fluid (Jeans 1902; Zeldovich 1970), which the lattice
    is to the square of its spacing (Marcos et al. 2006): tenfold within the run.

    From n and 2 n bodies a side that square is taken out, and about 1 / n^4 is left. Forces are off
    by 1e-8 n^2 m^2, 1e-5 of those of the wave.
    """
    coarse, fine = (growth(each, method, device) for each in (n, 2 * n))
    assert abs(coarse - 1.0) < 1.0 / n**2
    assert abs((4.0 * fine - coarse) / 3.0 - 1.0) < 1.0 / n**4
