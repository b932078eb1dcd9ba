"""Adaptive substeps: as many in each frame as the limits of the moment ask for."""

import warnings

import numpy as np
import pytest

import particlesim as ps
from particlesim.instruments.pace import level
from particlesim.scenes import sod_tube

ADAPTIVE = ps.Settings(dt=1 / 60, substeps="adaptive")


def splash(speed=60.0):
    """A block of water hits a pool of it, faster than the sound of either."""
    spacing, scene = 0.1, ps.Scene()
    pool = ps.sample.box((0, 0, 0), (1, 0.4, 0.4), spacing)
    block = ps.sample.box((0.3, 0.45, 0), (0.7, 0.65, 0.4), spacing)
    given = {"mass": 1000 * spacing**3, "radius": spacing / 2}
    scene.add_particles(pool, **given)
    scene.add_particles(block, velocity=(0, -speed, 0), **given)
    scene.add_interaction(ps.UniformGravity((0, -9.81, 0)))
    scene.add_interaction(
        ps.SPH(smoothing_length=1.3 * spacing, rest_density=1000.0,
               equation_of_state=ps.Tait(30.0), viscosity=ps.ArtificialViscosity(0.05))
    )  # fmt: skip
    scene.add_constraint(ps.BoxBoundary((0, 0, 0), (1, 3, 0.4)))
    return scene


@pytest.fixture
def quiet():
    """Speeds above that of sound are what the scene is made for."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ps.StabilityWarning)
        yield


def test_an_impact_diverges_at_the_substeps_of_its_start_and_runs_adaptively(quiet):
    fixed = ps.Simulation(splash(), ADAPTIVE.replace(substeps="auto", most_substeps=None), "cpu")
    with pytest.raises(ps.SimulationError):
        fixed.run(10)
    sim = ps.Simulation(splash(), ADAPTIVE, device="cpu")
    energy, substeps = [sim.diagnostics().energy[0]], []
    for _ in range(10):
        sim.step()
        found = sim.diagnostics()
        energy.append(found.energy[0])
        substeps.append(found.substeps[0])
        assert found.limiter[0] in ("SPH sound", "SPH acceleration", "SPH speed")
        assert found.limiter[0] in str(found)
    # Walls only hold, and viscosity takes: the energy never rises, but for what rounding and a
    # step of half the limit leave of it, some percent of what the impact turns over.
    assert np.diff(energy).max() < 0.02 * energy[0]
    # More where it hits, fewer when it has calmed.
    assert max(substeps) >= 2 * fixed.settings.substeps
    assert substeps[-1] < max(substeps)
    assert set(substeps) <= {level(2 ** (k / 2)) for k in range(20)}


@pytest.mark.slow
@pytest.mark.parametrize("speed", [120.0, 160.0, 240.0])
def test_an_impact_within_the_first_frame_adds_no_energy(speed, quiet):
    """Two or four metres a frame, over a gap of 0.05: no look between frames sees it come."""
    sim = ps.Simulation(splash(speed), ADAPTIVE, device="cpu")
    energy = [sim.diagnostics().energy[0]]
    for _ in range(10):
        sim.step()
        energy.append(sim.diagnostics().energy[0])
    assert np.diff(energy).max() < 0.02 * energy[0]


def test_bits(quiet, tmp_path):
    """By threads and graph, and from a checkpoint on, also with what limits were last asked by."""
    straight = ps.Simulation(splash(), ADAPTIVE.replace(execution="graph"), device="cpu")
    straight.run(3)
    straight.save(tmp_path / "splash.npz")
    straight.run(3)
    threads = ADAPTIVE.replace(execution="threads", threads=2)
    other = ps.Simulation(splash(), threads, device="cpu")
    other.run(6)
    loaded = ps.Simulation.load(tmp_path / "splash.npz", splash(), device="cpu")
    assert loaded.settings.adaptive and loaded.diagnostics().limiter[0]
    loaded.run(3)
    other.reset()
    other.run(6)
    for sim in (other, loaded):
        np.testing.assert_array_equal(sim.position, straight.position)
        np.testing.assert_array_equal(sim.velocity, straight.velocity)
        assert sim.settings.substeps == straight.settings.substeps
        assert sim.limiter == straight.limiter


def test_a_maximum_guards_the_run_and_says_who_asks_for_more():
    capped = ADAPTIVE.replace(most_substeps=16, on_failure="freeze")
    sim = ps.Simulation(splash(), capped, device="cpu")
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        sim.step()
        sim.step()
    said = [str(each.message) for each in caught if "most_substeps" in str(each.message)]
    assert len(said) == 1 and "at least" in said[0] and "got 16" in said[0]
    assert "SPH (" in said[0] or "not finite" in said[0]
    assert sim.settings.substeps == 16


def orbit(**knobs):
    """Energy errors of two thirds of a hundred frames of an orbit of eccentricity 0.9."""
    e, scene = 0.9, ps.Scene()
    scene.add_particles([(0, 0, 0)], pinned=True)
    scene.add_particles(
        [(1 + e, 0, 0)], velocity=(0, np.sqrt((1 - e) / (1 + e)), 0), mass=1e-6
    )  # fmt: skip
    scene.add_interaction(ps.Gravity(G=1.0))
    settings = ps.Settings(
        dt=2 * np.pi / 100, precision="float64", integrator="velocity_verlet", **knobs
    )
    sim = ps.Simulation(scene, settings, device="cpu")
    start, off, cost = sim.diagnostics().energy[0], [], 0
    for _ in range(200):
        sim.step()
        cost += sim.settings.substeps
        off.append(sim.diagnostics().energy[0] / start - 1)
    return np.abs(off), cost


def test_an_eccentric_orbit_is_followed_better_at_equal_cost():
    adaptive, cost = orbit(substeps="adaptive", safety=0.1)
    fixed, equal = orbit(substeps=cost // 200 + 1)
    assert equal >= cost
    # Leapfrog's energy is off by about (omega dt)^2 / 3: with steps as r^(3/2), omega dt is what
    # it is far out; equal ones have (2 a / r_p)^3 = 20^3 / 8 times its square at the pericentre, as
    # a mean over the orbit, of which the first orders are left: ten times at least.
    assert adaptive.max() < 0.1 * fixed.max()
    assert adaptive.max() < 0.1


@pytest.mark.slow
def test_a_hot_start_pays_for_its_first_frames_only():
    side, rng = 8.0, np.random.default_rng(0)
    scene = ps.Scene(periodic=((0, 0, 0), (side, side, side)))
    x = ps.sample.lattice("sc", 6, side / 6)
    x[0] = x[1] + (0, 0, 0.8)  # is thrown off at the speed of 2 (4 epsilon (1 / 0.8)^12)^(1/2)
    scene.add_particles(x + 0.01 * rng.normal(size=x.shape))
    scene.add_interaction(ps.LennardJones(cutoff=2.5))
    settings = ps.Settings(dt=0.02, substeps="adaptive", integrator="velocity_verlet")
    sim = ps.Simulation(scene, settings, device="cpu")
    before, counts = sim.diagnostics().energy[0], []
    for _ in range(30):
        sim.step()
        counts.append(sim.settings.substeps)
        assert sim.diagnostics().limiter[0].startswith("LennardJones")
    assert counts[-1] <= 0.5 * counts[0]
    # (omega dt)^2 / 12 of what is turned over, with omega dt at most 1 by a safety of a half.
    assert sim.diagnostics().energy[0] == pytest.approx(before, abs=abs(before) / 12)


def test_histories_say_what_limited_each_frame(quiet, tmp_path):
    for name in ("splash.csv", "splash.jsonl"):
        sim = ps.Simulation(splash(), ADAPTIVE, device="cpu")
        sim.run(3, history=tmp_path / name)
        record = ps.read_history(tmp_path / name)
        assert record["substeps"][-1, 0] == sim.settings.substeps
        assert record["limiter"][-1, 0] == sim.diagnostics().limiter[0]


def test_nothing_limits_what_flies_freely():
    scene = ps.Scene()
    scene.add_particles([(0, 0, 0)], velocity=(1, 0, 0))
    sim = ps.Simulation(scene, ps.Settings(dt=0.5, substeps="adaptive"), device="cpu")
    sim.run(2)
    assert sim.settings.substeps == 1 and sim.position[0, 0] == 1.0
    assert sim.diagnostics().limiter[0] == ""


def test_worlds_of_a_batch_have_as_many():
    """As many as all of them can do with."""
    scenes = [splash(speed) for speed in (1.0, 10.0)]
    sim = ps.Simulation(scenes, ADAPTIVE, device="cpu")
    for _ in range(3):
        sim.step()
        assert sim.stability().substeps <= sim.settings.substeps
        assert sim.diagnostics().substeps.tolist() == [sim.settings.substeps] * 2


@pytest.mark.slow
def test_a_gas_keeps_its_energy_where_the_step_changes():
    """Velocity Verlet carries rates of heating into a substep that may be of another length."""
    scene = sod_tube.build(count=90)
    settings = sod_tube.settings.replace(substeps="adaptive", precision="float64")
    sim = ps.Simulation(scene, settings, device="cpu")
    before, counts = sim.diagnostics().energy[0], []
    for _ in range(4):
        sim.step()
        counts.append(sim.settings.substeps)
    assert len(set(counts)) > 1
    # Heat takes what each kick gives, to rounding: 1e-16 of the energy, some 100 times a substep.
    assert sim.diagnostics().energy[0] == pytest.approx(before, rel=1e-10)
