"""Stability: what binds, the warning, dt="auto", and that asking changes nothing."""

import importlib
import math
import warnings

import numpy as np
import pytest
import warp as wp

import particlesim as ps
from cases.ready import small, swept
from cases.stability import chain, grains, oscillator, simulation
from particlesim.instruments.stability import StabilityWarning


def test_worlds_and_what_binds():
    scenes = [chain(3, stiffness) for stiffness in (1.0, 50.0, 10.0)]
    report = simulation(scenes, dt=0.5).stability()
    assert report.binding.world == 1 and report.binding.particle == 1
    assert report.dt == pytest.approx(2 / math.sqrt(50 / 0.3 * 3), rel=0.01)
    assert report.substeps == math.ceil(0.5 / report.dt)
    assert "PAST THE LIMIT" in str(report) and "particle 1 in world 1" in str(report)


@ps.law
def undefined(position: wp.vec3):
    return wp.log(-1.0 - wp.length(position)) * position


def test_forces_that_are_not_finite_are_named(refused):
    scene = ps.Scene()
    scene.add_particles([(1, 0, 0)])
    scene.add_interaction(ps.ParticleForce(undefined))
    report = simulation(scene).stability()
    assert report.dt == 0.0 and report.substeps == math.inf and not report.safe
    assert "not finite" in report.binding.reason
    with refused("where the forces are not finite at the start"):
        simulation(scene, dt="auto")


# It leaves no trace


@pytest.mark.parametrize("integrator", ["symplectic_euler", "velocity_verlet"])
def test_asking_changes_not_one_bit(liquid, device, integrator):
    def run(ask):
        scene = liquid(cells=3)
        scene.add_interaction(ps.Drag(linear=0.1))
        sim = simulation(scene, device, dt=0.02, substeps=4, integrator=integrator)
        for _ in range(5):
            sim.step()
            if ask:
                before = {name: a.numpy().copy() for name, a in sim.state.arrays.items()}
                sim.stability()
                for name, array in sim.state.arrays.items():
                    np.testing.assert_array_equal(array.numpy(), before[name], err_msg=name)
        return sim.position, sim.velocity

    for asked, plain in zip(run(True), run(False), strict=True):
        np.testing.assert_array_equal(asked, plain)


def test_asking_a_fluid_changes_not_one_bit(device):
    module = importlib.import_module("particlesim.scenes.dam_break")
    sims = [ps.Simulation(module.build(spacing=0.1), module.settings, device) for _ in range(2)]
    for _ in range(3):
        sims[0].stability()
        for sim in sims:
            sim.step()
    np.testing.assert_array_equal(sims[0].position, sims[1].position)


# The warning


def test_run_warns_once_past_the_limit():
    sim = simulation(oscillator(), dt=1.0, substeps=2, watchdog=False)
    with pytest.warns(StabilityWarning) as caught:
        sim.run(1)
    (warning,) = caught
    text = str(warning.message)
    # 2 / omega = 0.2828: four substeps.
    assert "Springs (frequency: 2 / omega" in text and "Settings(substeps=4)" in text
    assert warning.filename == __file__
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        sim.reset()
        sim.run(1)


def test_run_within_the_limit_says_nothing():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        simulation(oscillator(), dt=1.0, substeps=4).run(1)
        simulation(oscillator(), dt=0.0).run(1)
        simulation(ps.Scene(), dt=1.0).run(1)


# dt="auto"


def test_dt_auto():
    sim = simulation(oscillator(), dt="auto", substeps=5, safety=0.25)
    assert isinstance(sim.settings.dt, float)
    assert sim.settings.dt == pytest.approx(5 * 0.25 * 2 / math.sqrt(50.0), rel=0.01)
    sim.step()
    assert sim.time == sim.settings.dt
    assert sim.stability().safe


def test_substeps_auto():
    sim = simulation(oscillator(), dt=1.0, substeps="auto", safety=0.5)
    assert sim.settings.substeps == math.ceil(1.0 / (0.5 * sim.stability().dt))


def test_what_auto_cannot_do(refused):
    with refused("substeps must be a number with dt="):
        ps.Settings(dt="auto", substeps="auto")
    with refused("dt must be a number in a scene where no part limits it"):
        simulation(grains((0, 0, 0)), dt="auto")
    for safety in (0.0, 1.5, math.nan):
        with refused("safety must"):
            ps.Settings(safety=safety)


def test_checkpoint_of_dt_auto(tmp_path):
    settings = ps.Settings(dt="auto", substeps=3)
    sim = ps.Simulation(oscillator(), settings, device="cpu")
    sim.step()
    sim.save(tmp_path / "run.npz")
    for given in (None, settings):
        again = ps.Simulation.load(tmp_path / "run.npz", oscillator(), given, device="cpu")
        assert again.settings == sim.settings
        np.testing.assert_array_equal(again.position, sim.position)


def test_recording_of_dt_auto(tmp_path):
    from pxr import Usd

    sim = simulation(oscillator(), dt="auto", substeps=1, safety=0.2)
    sim.run(1, record=tmp_path / "run.usda")
    stage = Usd.Stage.Open(str(tmp_path / "run.usda"))
    assert stage.GetTimeCodesPerSecond() == pytest.approx(1 / sim.settings.dt, rel=1e-6)


def test_tradeoff_of_dt_auto():
    table = ps.tradeoff(
        oscillator, {"safety": [0.5], "precision": ["float32", "float64"]}, error="energy",
        settings=ps.Settings(dt="auto", substeps=4), frames=3, repeats=1, device="cpu",
    )  # fmt: skip
    assert all(isinstance(row.settings.dt, float) and not row.diverged for row in table.rows)
    table = ps.tradeoff(
        oscillator, {"substeps": ["auto", 20]}, error="energy", frames=3, repeats=1,
        settings=ps.Settings(dt=0.5, safety=0.5), device="cpu",
    )  # fmt: skip
    assert table.rows[0].settings.substeps == 4  # 0.5 / (0.5 * 0.2828)


# The ready scenes


@pytest.mark.parametrize("name", swept())
def test_ready_scenes_are_within_their_limits(name):
    module, scene = small(name)
    sim = ps.Simulation(scene, module.settings, device="cpu")
    report = sim.stability()
    assert report.safe, str(report)


# Simulated seconds: some collisions of the gas, the fall of the dam, the merger's first shock.
DURATIONS = {
    "spring_lattice": 0.5, "freezing": 5.0, "gas_in_a_box": 0.3, "dam_break": 0.4,
    "star_collision": 3.0,
}  # fmt: skip


@pytest.mark.parametrize(("name", "duration"), DURATIONS.items())
def test_force_scenes_are_bounded_just_below_their_limit(name, duration):
    module, scene = small(name)
    sim = ps.Simulation(scene, module.settings, device="cpu")
    dt = 0.9 * sim.stability().dt
    sim = ps.Simulation(
        scene, module.settings.replace(dt=duration, substeps=math.ceil(duration / dt)), "cpu"
    )
    before = sim.diagnostics()
    sim.step()
    after = sim.diagnostics()
    # Nothing adds energy to these scenes: at most a few per cent of it by the integrator.
    scale = np.abs(before.energy).max() + before.kinetic.max()
    assert after.energy[0] - before.energy[0] < 0.05 * scale
