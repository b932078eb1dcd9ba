"""Trade-offs whose law is known: the sweep has to find it."""

import numpy as np
import pytest

import particlesim as ps

# Kepler ---------------------------------------------------------------------------------------

PERIOD = 2 * np.pi
ECCENTRICITY = 0.5


def kepler():
    """A planet at its perihelion, about a sun that is held, G M = a = 1."""
    scene = ps.Scene(up_axis="z")
    scene.add_particles([(0, 0, 0)], pinned=True, group="sun")
    start = (1 - ECCENTRICITY, 0, 0)
    speed = np.sqrt((1 + ECCENTRICITY) / (1 - ECCENTRICITY))
    scene.add_particles([start], velocity=(0, speed, 0), group="planet")
    scene.add_interaction(ps.Gravity(G=1.0))
    return scene


def off_its_start(sim):
    """Distance from the start, where the planet is again after a period."""
    return float(np.linalg.norm(sim.position[1] - (1 - ECCENTRICITY, 0, 0)))


def orbit(error, **options):
    settings = ps.Settings(dt=PERIOD / 20, integrator="velocity_verlet", precision="float64")
    vary = {"substeps": [10, 20, 40, 80, 160]}
    return ps.tradeoff(
        kepler, vary, error=error, frames=20, settings=settings, repeats=1, **options
    )


def test_velocity_verlet_is_of_second_order(device):
    table = orbit(off_its_start, device=device)
    # From 200 steps an orbit on, the next term of the error, of relative size (h / tau)^2 with tau
    # the time at the perihelion (r^1.5 = 0.35), is under 1 %: 0.01 of the exponent.
    assert table.order("substeps") == pytest.approx(2.0, abs=0.1)
    # 1.77e-2 after ten orbits at 1000 steps (three digits); it grows with h^2 and the orbits.
    assert table.rows[3].error == pytest.approx(1.77e-2 / 10 * (1000 / 1600) ** 2, rel=0.01)


def test_a_reference_finds_the_same_order(device):
    table = orbit("converged", device=device)
    known = orbit(off_its_start, device=device)
    assert table.order("substeps") == pytest.approx(2.0, abs=0.1)
    # Of the two bodies one is held, and does not count. The orbit's error is largest where it is
    # fastest, at its end. The reference may itself be off by a tenth of the smallest error.
    errors, distances = ([row.error for row in each.rows] for each in (table, known))
    np.testing.assert_allclose(errors, distances, atol=0.11 * min(distances), rtol=1e-6)


def test_energy_of_verlet_is_of_second_order(device):
    # The energy error oscillates with amplitude ~ h^2 along the orbit, caught at every frame.
    assert orbit("energy", device=device).order("substeps") == pytest.approx(2.0, abs=0.1)


# Spring ---------------------------------------------------------------------------------------

STIFFNESS, AMPLITUDE = 100.0, 0.1


def spring():
    """A unit mass on a compliant rod, omega = 10, stretched along it."""
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0)], pinned=True, group="wall")
    scene.add_particles([(1 + AMPLITUDE, 0, 0)], group="mass")
    scene.add_constraint(ps.Distance([(0, 1)], rest_length=1.0, compliance=1 / STIFFNESS))
    return scene


def energy_left(sim):
    """E / E0; all of it is in the stretch at the start."""
    stretch, speed = sim.position[1, 0] - 1.0, sim.velocity[1, 0]
    return (0.5 * speed**2 + 0.5 * STIFFNESS * stretch**2) / (0.5 * STIFFNESS * AMPLITUDE**2)


def test_xpbd_damping_follows_its_law(device):
    settings = ps.Settings(dt=1 / 60, precision="float64")
    vary = {"substeps": [1, 10, 25, 50, 100, 200]}
    table = ps.tradeoff(
        spring, vary, error=lambda sim: 1.0 - energy_left(sim), frames=60, settings=settings,
        repeats=1, device=device,
    )  # fmt: skip
    for row in table.rows:
        h, steps = row.settings.substep, 60 * row.settings.substeps
        # One iteration of XPBD is implicit Euler on a linear spring: exact up to round-off.
        left = (1 + STIFFNESS * h**2) ** -steps
        assert 1.0 - row.error == pytest.approx(left, abs=1e-9)
    # 1 - E/E0 = 1 - exp(-z) with z = omega^2 h T, whose local order is z / (e^z - 1), z / 2 less
    # than 1: with z from 0.17 to 0.008 in the part that is straight, 0.04 less in the mean.
    assert table.order("substeps") == pytest.approx(1.0, abs=0.05)


def hanging(mass=1.0, stiffness=1000.0):
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0)], pinned=True, group="hook")
    scene.add_particles([(0, -1, 0)], mass=mass, group="mass")
    scene.add_interaction(ps.UniformGravity((0, -9.81, 0)))
    scene.add_constraint(ps.Distance([(0, 1)], rest_length=1.0, compliance=1 / stiffness))
    return scene


def test_a_compliant_weight_does_not_depend_on_iterations(device):
    stretch = 9.81 / 1000.0
    vary = {"iterations": [1, 2, 5, 20, 100]}
    table = ps.tradeoff(
        hanging, vary, error=lambda sim: -1.0 - sim.position[1, 1] - stretch, frames=300,
        settings=ps.Settings(dt=1 / 60, substeps=1, precision="float64"), repeats=1,
        device=device,
    )  # fmt: skip
    # Implicit Euler takes the swing down by (1 + omega^2 h^2)^(-n/2) = 1.278^-150 = 1e-16 in 300
    # steps; what is left is round-off of positions near 1, of 2e-16, over a few operations.
    assert all(row.error < 1e-14 for row in table.rows)
    # All are as good, so that the cheapest is as good as any.
    assert table.cheapest(error=1e-14) is table.fastest_stable()


# Lennard-Jones --------------------------------------------------------------------------------

DENSITY, ATOMS = 0.4, 4000
SIDE = (ATOMS / DENSITY) ** (1 / 3)
LONGEST = 0.49 * SIDE


def fluid(cutoff=2.5):
    """Atoms without order beyond their size: g(r) = 1."""
    scene = ps.Scene(periodic=((0, 0, 0), (SIDE,) * 3))
    x = ps.sample.random((0, 0, 0), (SIDE,) * 3, ATOMS, seed=1, minimum_distance=0.9, periodic=True)
    scene.add_particles(x)
    scene.add_interaction(ps.LennardJones(cutoff=cutoff))
    return scene


def tail(cutoff):
    """Energy a particle that the cutoff leaves out."""
    return 8 / 3 * np.pi * DENSITY * (cutoff**-9 / 3 - cutoff**-3)


@pytest.mark.slow
def test_lennard_jones_cutoff_leaves_out_its_tail(device):
    settings = ps.Settings(dt=1e-9, substeps=1, precision="float64")
    energy = lambda sim: sim.diagnostics().potential[0] / ATOMS  # noqa: E731
    whole = energy(ps.Simulation(fluid(LONGEST), settings, device=device)) + tail(LONGEST)
    cutoffs = [2.0, 2.5, 3.0, 4.0, 5.0]
    table = ps.tradeoff(
        fluid, {"cutoff": cutoffs}, error=lambda sim: energy(sim) - whole, frames=1,
        settings=settings, repeats=1, device=device,
    )  # fmt: skip
    # Half of the tail of 2.0 comes from the pairs up to 2.5: N rho 2 pi r^2 dr / 2 = 2e4, counted
    # to 0.7 %; of 5.0, from 3e5 pairs. What order the atoms' size leaves beyond two is as little.
    for row in table.rows:
        assert row.error == pytest.approx(-tail(row["cutoff"]), rel=0.05)
    # Errors of 5 % at both ends of a factor of 2.5 are 0.1 of the exponent.
    assert table.order("cutoff") == pytest.approx(3.0, abs=0.1)
    # 16 times the pairs want longer rows (times of a single frame would be a matter of luck).
    assert table.rows[-1].array_bytes > 2 * table.rows[0].array_bytes


# Ropes ----------------------------------------------------------------------------------------

TENSION, LINE_DENSITY = 100.0, 0.01  # of a string of length 1: 50 Hz


def string(segments=8):
    """A string in its first mode, of an amplitude that leaves the tension as it is."""
    scene = ps.Scene()
    s = np.linspace(0, 1, segments + 1)
    x = np.stack([s, 1e-5 * np.sin(np.pi * s), 0 * s], axis=1)
    held = np.isin(np.arange(segments + 1), [0, segments])
    scene.add_particles(x, mass=LINE_DENSITY / segments, pinned=held)
    k = np.arange(segments)
    pairs, stiffness = np.stack([k, k + 1], axis=1), 1e4 * segments
    scene.add_interaction(ps.Springs(pairs, stiffness, 1 / segments - TENSION / stiffness))
    return scene


def detuned(sim):
    """How much lower the string is tuned than 50 Hz, by its phase after a period of that."""
    omega, middle = 2 * np.pi * 50, len(sim.position) // 2
    phase = np.arctan2(-sim.velocity[middle, 1] / omega, sim.position[middle, 1])
    return -phase / (2 * np.pi)


def test_a_string_comes_to_its_pitch_with_its_segments(device):
    settings = ps.Settings(
        dt=0.001, substeps=200, integrator="velocity_verlet", precision="float64"
    )
    table = ps.tradeoff(
        string, {"segments": [4, 8, 16, 32]}, error=detuned, frames=20, settings=settings,
        repeats=1, device=device,
    )  # fmt: skip
    for row in table.rows:
        n = row["segments"]
        # The phase is taken with omega for omega_n, which errs by its error squared; Verlet by
        # (omega h)^2 / 24 = 1e-7; the change of the tension by (pi 1e-5)^2 k L / T / 4 = 1e-7.
        law = 1 - 2 * n / np.pi * np.sin(np.pi / (2 * n))
        assert row.error == pytest.approx(law, abs=1.1 * law**2 + 2e-7)
    assert table.order("segments") == pytest.approx(2.0, abs=0.02)


SPAN, LENGTH, SAG = 1.0, 1.2, 0.292344


def hanging_chain(links=20):
    """A chain from the end of one nail to another, let go on the parabola of that sag."""
    scene = ps.Scene()
    s = np.linspace(-0.5, 0.5, links + 1)
    x = np.stack([SPAN * s, SAG * (4 * s**2 - 1), 0 * s], axis=1)
    held = np.isin(np.arange(links + 1), [0, links])
    scene.add_particles(x, mass=1 / links, pinned=held)
    scene.add_interaction(ps.UniformGravity((0, -9.81, 0)))
    scene.add_interaction(ps.Drag(linear=8.0 / links))
    k = np.arange(links)
    scene.add_constraint(ps.Distance(np.stack([k, k + 1], axis=1), LENGTH / links))
    return scene


@pytest.mark.slow
def test_a_chain_comes_to_the_catenary_with_its_links(device):
    # Drag of 8 m / s, of which half damps: in 5 s what the start lacks is down to e^-20 of it.
    table = ps.tradeoff(
        hanging_chain, {"links": [10, 20, 60], "substeps": [400, 800]}, frames=300, repeats=1,
        settings=ps.Settings(dt=1 / 60, precision="float64"), device=device,
        error=lambda sim: -sim.position[:, 1].min() - SAG,
    )  # fmt: skip
    errors = {tuple(row.values.values()): row.error for row in table.rows}
    for links, sag in ((20, 0.292721), (60, 0.292386)):
        # One iteration leaves rods longer by some g h^2 a link: taken out by its own law. The
        # rest is the last digit of two sags.
        coarse, fine = errors[links, 400], errors[links, 800]
        assert fine + (fine - coarse) / 3 == pytest.approx(sag - SAG, abs=1.5e-6)
    # What is not taken out is 14 % at 60 links: ln 1.14 / ln 6 = 0.07 of the exponent.
    assert table.order("links", substeps=800) == pytest.approx(2.0, abs=0.1)
