"""Numbers and intervals at the ends of what can be computed: bounded and right, or announced."""

import re
import subprocess
import sys
import warnings

import numpy as np
import pytest

import particlesim as ps

EPS = 2.0**-23  # of float32


# Numbers ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("scale", [1e-30, 1e-12, 1e12, 1e30])
def test_units_do_not_matter(scale, device, simulate):
    # Masses and stiffnesses from where products are denormal to where they nearly overflow.
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0), (1.5, 0, 0)], mass=scale)
    scene.add_interaction(ps.Springs([(0, 1)], stiffness=10.0 * scale, rest_length=1.0))
    sim = simulate(scene, 30, device, substeps=20, integrator="velocity_verlet")
    t = sim.time
    np.testing.assert_allclose(
        np.diff(sim.position[:, 0]), 1 + 0.5 * np.cos(np.sqrt(20) * t), atol=1e-4
    )


def test_speeds_below_every_normal_number(device, simulate):
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0)], velocity=(1e-42, 0, 0))
    sim = simulate(scene, 10, device)
    assert 0 <= sim.velocity[0, 0] <= 1.1e-42
    assert 0 <= sim.position[0, 0] <= 1e-42


FAST = """
import numpy as np
import particlesim as ps
from particlesim.kernels import precision

make, built = precision.kernel, []


def kernel(function):
    made = make(function)
    made.module.options["fast_math"] = True
    built.append(made)
    return made


precision.kernel = kernel
scene = ps.Scene(periodic=((0, 0, 0), (6.8, 6.8, 6.8)))
x = ps.sample.lattice("fcc", (4, 4, 4), 1.7)
scene.add_particles(x, velocity=ps.sample.maxwell_boltzmann(len(x), 1.0, 1.0, seed=1))
scene.add_interaction(ps.LennardJones(cutoff=2.5))
settings = ps.Settings(dt=0.02, substeps=5, integrator="velocity_verlet")
sim = ps.Simulation(scene, settings, device="cpu")
start = sim.diagnostics()
sim.run(20)
end = sim.diagnostics()
assert any("sum_over_partners" in each.key for each in built)
assert abs(end.energy - start.energy)[0] < 0.02 * start.kinetic[0], end.energy - start.energy
assert np.abs(end.momentum).max() < 1e-3
sim.position = np.where(np.arange(len(x))[:, None] < 2, 0.0, sim.position)
try:
    sim.run(1)
except ps.SimulationError as error:
    print("named:", error)
"""


@pytest.mark.slow
def test_fast_mathematics_still_conserves_and_still_names_what_is_wrong(tmp_path):
    # Built so that the compiler may assume that nothing is NaN: the watchdog must find it all the
    # same. In a process of its own, as kernels are made once a process.
    script = tmp_path / "fast.py"
    script.write_text(FAST)
    done = subprocess.run([sys.executable, script], capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    assert "named: Simulation: " in done.stdout


# Intervals --------------------------------------------------------------------------------------


@pytest.mark.parametrize(("phase", "bounded"), [(1.99, True), (2.01, False)])
def test_the_limit_of_an_oscillator(phase, bounded, device):
    # omega dt, omega^2 = 2 k / m. Verlet's amplitude is bounded below 2; above it grows a frame by
    # the largest root of z + 1/z = 2 - phase^2, that is 1.22 a substep.
    omega = np.sqrt(20.0)
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0), (1.1, 0, 0)])
    scene.add_interaction(ps.Springs([(0, 1)], stiffness=10.0, rest_length=1.0))
    knobs = ps.Settings(dt=10 * phase / omega, substeps=10, integrator="velocity_verlet")
    sim = ps.Simulation(scene, knobs, device=device)
    if bounded:
        sim.run(100)
        # At the edge the conserved energy is a thin ellipse: 1 / sqrt(1 - (phase / 2)^2) wide.
        stretch = np.diff(sim.position[:, 0])[0] - 1
        assert abs(stretch) < 0.1 / np.sqrt(1 - (phase / 2) ** 2) * 1.01
    else:
        with pytest.warns(UserWarning, match="Springs"), pytest.raises(ps.SimulationError):
            sim.run(100)


def test_no_time_changes_nothing(device, simulate):
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0), (0.5, 0, 0)], velocity=(1, 2, 3), radius=0.5)
    scene.add_interaction(ps.UniformGravity())
    scene.add_constraint(ps.Contact())
    sim = simulate(scene, 3, device, dt=0.0)
    np.testing.assert_array_equal(sim.position, [(0, 0, 0), (0.5, 0, 0)])
    np.testing.assert_array_equal(sim.velocity, [(1, 2, 3)] * 2)


def test_a_fast_impact_is_stopped_or_announced(device):
    # A bullet that crosses three diameters a substep: it may pass through, but not unannounced.
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0), (-1.0, 0, 0)], velocity=[(0, 0, 0), (400, 0, 0)], radius=0.05)
    scene.add_constraint(ps.Contact())
    sim = ps.Simulation(scene, ps.Settings(dt=1 / 60, substeps=20), device=device)
    with pytest.warns(UserWarning, match="Contact"):
        sim.run(1)


def test_a_ball_that_would_skip_an_obstacle_is_announced(device):
    scene = ps.Scene()
    scene.add_particles([(-1, 0.01, 0)], velocity=(300, 0, 0), radius=0.01)
    scene.add_constraint(ps.SphereBoundary((0, 0, 0), 0.2, inside=False))
    sim = ps.Simulation(scene, ps.Settings(dt=1 / 60, substeps=10), device=device)
    assert sim.stability().dt == pytest.approx(0.2 / 300)
    with pytest.warns(ps.StabilityWarning, match="SphereBoundary"):
        sim.run(1)


def test_a_dense_seeding_expands_without_a_blast(device):
    # Water seeded at 1.26 of its spacing: twice the density. Tait's energy of that compression is
    # all that there is to gain.
    spacing, c = 0.05 / 2 ** (1 / 3), 10.0
    scene = ps.Scene()
    scene.add_particles(ps.sample.box((0, 0, 0), (0.3, 0.3, 0.3), spacing), mass=1000 * 0.05**3)
    scene.add_interaction(
        ps.SPH(smoothing_length=0.06, rest_density=1000.0, equation_of_state=ps.Tait(c),
               viscosity=ps.ArtificialViscosity(0.1))
    )  # fmt: skip
    sim = ps.Simulation(scene, ps.Settings(dt=1e-3, substeps=20), device=device)
    start = sim.diagnostics().energy[0]
    sim.run(20)
    assert sim.diagnostics().energy[0] <= start * (1 + 1e-3)
    assert np.abs(sim.diagnostics().momentum).max() < 1e-2 * sim.diagnostics().mass[0]


def test_a_solid_placed_in_water_pushes_it_away_and_no_more(device):
    # Pinned particles amid the water, half a spacing off: what is gained is the energy of the
    # overlap at the start, and what leaves is slower than sound.
    spacing, c = 0.05, 10.0
    x = ps.sample.box((0, 0, 0), (0.4, 0.4, 0.4), spacing)
    solid = ps.sample.box((0.15, 0.15, 0.15), (0.25, 0.25, 0.25), spacing) + 0.5 * spacing
    scene = ps.Scene()
    scene.add_particles(x, mass=1000 * spacing**3)
    scene.add_particles(solid, mass=1000 * spacing**3, pinned=True)
    scene.add_interaction(
        ps.SPH(smoothing_length=0.06, rest_density=1000.0, equation_of_state=ps.Tait(c),
               viscosity=ps.ArtificialViscosity(0.1))
    )  # fmt: skip
    sim = ps.Simulation(scene, ps.Settings(dt=1e-3, substeps=10), device=device)
    start = sim.diagnostics().energy[0]
    sim.run(40)
    assert sim.diagnostics().energy[0] <= start * (1 + 1e-3)
    assert np.linalg.norm(sim.velocity, axis=1).max() < c


@pytest.mark.parametrize(("rate", "bounded"), [(1.9, True), (2.1, False)])
def test_the_limit_of_drag(rate, bounded, device):
    # v falls or grows by 1 - gamma dt a step.
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0)], velocity=(1, 0, 0))
    scene.add_interaction(ps.Drag(linear=rate))
    sim = ps.Simulation(scene, ps.Settings(dt=10.0, substeps=10), device=device)
    if bounded:
        sim.run(4)
        assert abs(sim.velocity[0, 0]) == pytest.approx(0.9**40, rel=1e-3)
    else:
        with pytest.warns(ps.StabilityWarning, match="Drag"):
            sim.run(1)


@pytest.mark.parametrize("count", [0, 1])
def test_nobody_and_nobody_else(count, precision, device, simulate):
    scene = ps.Scene()
    scene.add_particles(np.zeros((count, 3)), radius=0.1, velocity=(1, 0, 0))
    for part in (ps.LennardJones(cutoff=1.0), ps.Gravity(), ps.Drag(0.0)):
        scene.add_interaction(part)
    scene.add_constraint(ps.Contact())
    scene.add_constraint(ps.PlaneBoundary((0, -1, 0), (0, 1, 0)))
    sim = simulate(scene, 3, device, precision=precision)
    assert sim.diagnostics().mass[0] == count
    np.testing.assert_allclose(sim.position, np.tile((3 / 60, 0, 0), (count, 1)), rtol=1e-5)


@pytest.mark.slow
def test_a_million_steps(device):
    # Verlet's energy error of an oscillator stays (phase / 2)^2 of itself for ever; rounding adds
    # a random walk of sqrt(n) last bits, carried along by compensation.
    omega, steps = np.sqrt(20.0), 1_000_000
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0), (1.5, 0, 0)])
    scene.add_interaction(ps.Springs([(0, 1)], stiffness=10.0, rest_length=1.0))
    phase = 0.1
    knobs = ps.Settings(dt=1000 * phase / omega, substeps=1000, integrator="velocity_verlet")
    sim = ps.Simulation(scene, knobs, device=device)
    start = sim.diagnostics().energy[0]
    drift = 0.0
    for _ in range(steps // 1000):
        sim.step()
        drift = max(drift, abs(sim.diagnostics().energy[0] / start - 1))
    assert drift < (phase / 2) ** 2 + np.sqrt(steps) * EPS * 4


def test_a_start_that_does_not_fit_is_announced(device):
    # A link half as long as it is to be: the first substep moves both ends by a quarter, which at
    # a thousandth of a second is 250 m/s. Projected first, there is nothing to say.
    def build():
        scene = ps.Scene()
        scene.add_particles([(0, 0, 0), (0.5, 0, 0)])
        scene.add_constraint(ps.Distance([(0, 1)], rest_length=1.0))
        return ps.Simulation(scene, ps.Settings(dt=0.01, substeps=10), device=device)

    with pytest.warns(ps.StabilityWarning, match="moved by 0.25 in the first substep, which gives"):
        build().run(1)
    sim = build()
    sim.project(4)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        sim.run(1)
    np.testing.assert_allclose(sim.velocity, 0, atol=1e-4)


@pytest.mark.parametrize(
    ("part", "name", "value"),
    [
        (
            lambda: ps.Springs([(0, 1)], stiffness=1e-46, rest_length=0.5),
            "Springs: stiffness",
            1e-46,
        ),
        (lambda: ps.UniformGravity((0, 1e40, 0)), "UniformGravity: acceleration", 1e40),
        (lambda: ps.Gravity(G=1e-60), "Gravity: constant", 1e-60),
        (lambda: ps.Distance([(0, 1)], 1.0, compliance=1e-50), "Distance: compliance", 1e-50),
    ],
    ids=["little", "much", "nothing", "stiff"],
)
def test_what_single_precision_cannot_hold_is_told(part, name, value, refused):
    """A parameter that would be 0 or infinite there is refused, and taken in double precision."""
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0), (1, 0, 0)])
    made = part()
    (scene.add_constraint if hasattr(made, "project") else scene.add_interaction)(made)
    with refused(rf"{name} must be within float32, .*, got {re.escape(f'{value:g}')}; choose"):
        ps.Simulation(scene, device="cpu")
    ps.Simulation(scene, ps.Settings(precision="float64"), device="cpu")


def test_masses_and_starts_that_single_precision_cannot_hold(refused):
    for values, told in (
        ({"mass": [1.0, 1e-60]}, "mass must be within float32.*got 1e-60"),
        ({"mass": 1e40}, "mass must be within float32.*got 1e"),
        ({"velocity": (1e39, 0, 0)}, "velocity must be within float32.*got 1e"),
    ):
        scene = ps.Scene()
        scene.add_particles([(0, 0, 0), (1, 0, 0)], **values)
        with refused(f"Scene.add_particles: {told}"):
            ps.Simulation(scene, device="cpu")
    # What is nothing beside others is no mistake: the cosine of a right angle, a Gaussian's tail.
    scene = ps.Scene()
    scene.add_particles([(0, 1e-300, 0), (1, 0, 0)], charge=[1.0, np.exp(-200)])
    ps.Simulation(scene, device="cpu").run(1)
