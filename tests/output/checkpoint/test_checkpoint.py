"""A restart equals the uninterrupted run bit for bit."""

import importlib
import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import warp as wp

import particlesim as ps
from cases.ready import every

from .checkpoints import SMALL, described, pair, restart, ropes


@pytest.mark.parametrize("name", list(every()))
def test_a_restart_equals_the_uninterrupted_run(name, device, tmp_path):
    module = importlib.import_module(f"particlesim.scenes.{name}")
    options = SMALL.get(name, {})
    sim = ps.Simulation(module.build(**options), module.settings, device=device)
    sim.run(3)
    # The scene is built anew, as a new process would.
    restart(sim, tmp_path / "run.npz", module.build(**options))


@pytest.mark.parametrize("execution", ["graph", "threads"])
def test_a_restart_may_run_in_another_way(execution, device, tmp_path, liquid):
    settings = ps.Settings(
        dt=0.02, substeps=4, integrator="velocity_verlet", execution=execution, threads=2
    )
    sim = ps.Simulation(liquid(6), settings, device=device)
    sim.run(3)
    other = {"graph": "threads", "threads": "graph"}[execution]
    loaded = restart(
        sim, tmp_path / "run.npz", liquid(6), settings=settings.replace(execution=other)
    )
    assert loaded.settings.execution == other


def test_chain_stays_broken(device, tmp_path):
    scene = ropes(strength=60.0)
    sim = ps.Simulation(scene, ps.Settings(substeps=20, iterations=2), device=device)
    sim.run(10)
    broken = np.concatenate([each.broken for each in sim.constraints[:4]])
    force = sim.constraints[0].force
    assert 0 < broken.sum() < len(broken) and force.any()
    sim.save(tmp_path / "run.npz")
    loaded = ps.Simulation.load(tmp_path / "run.npz", ropes(strength=60.0), device=device)
    np.testing.assert_array_equal(loaded.constraints[0].force, force)
    restart(sim, tmp_path / "again.npz", ropes(strength=60.0))


@pytest.mark.parametrize("integrator", ["symplectic_euler", "velocity_verlet"])
def test_worlds(integrator, precision, device, tmp_path, liquid):
    # Sizes looked through directly and by grid (limit 512 on the CPU).
    def scenes():
        return [liquid(4, seed=1), liquid(6, seed=2, epsilon=1.2), liquid(3, density=0.3, seed=3)]

    settings = ps.Settings(dt=0.02, substeps=4, integrator=integrator, precision=precision)
    sim = ps.Simulation(scenes(), settings, device=device)
    sim.run(2)
    sim.reset([1])  # its forces are not known
    sim.world(2).velocity = (0.1, 0.1, 0.1)
    assert sim.loop.unknown_forces >= {1, 2}
    restart(sim, tmp_path / "run.npz", scenes())


def test_copies_need_no_count(device, tmp_path, refused):
    sim = ps.Simulation(ropes(), device=device, worlds=3)
    sim.world(1).velocity = (0, 1, 0)
    sim.run(1)
    assert restart(sim, tmp_path / "run.npz", ropes()).world_count == 3
    with refused("worlds must be as in 'run.npz', 3, got 2"):
        ps.Simulation.load(tmp_path / "run.npz", ropes(), worlds=2)


def test_what_was_set_from_outside_is_kept(device, tmp_path):
    sim = ps.Simulation(pair(), ps.Settings(integrator="velocity_verlet"), device=device)
    sim.set("mass", [2.0, 3.0])  # makes the array of masses
    sim.run(2)
    loaded = restart(sim, tmp_path / "run.npz", pair())
    assert loaded.get("mass").tolist() == [2.0, 3.0]
    np.testing.assert_array_equal(loaded.diagnostics().energy, sim.diagnostics().energy)


@ps.law
def swing(position: wp.vec3, time: float):
    return -wp.sin(30.0 * time) * position


def test_forces_that_depend_on_time(device, tmp_path):
    def swinging():
        scene = ps.Scene()
        scene.add_particles([(1, 2, 3)])
        scene.add_interaction(ps.ParticleForce(swing))
        return scene

    sim = ps.Simulation(swinging(), device=device, worlds=2)
    sim.run(2)
    sim.reset([1])  # its clock starts anew
    restart(sim, tmp_path / "run.npz", swinging())


def test_before_the_first_step_and_without_particles(device, tmp_path):
    restart(ps.Simulation(ropes(), device=device), tmp_path / "start.npz", ropes())
    restart(ps.Simulation(ps.Scene(), device=device), tmp_path / "empty.npz", ps.Scene())


def test_longer_rows_than_at_the_start(device, tmp_path):
    """Particles that have gathered since need longer rows than those of the start."""

    def gather():
        scene = ps.Scene()
        scene.add_particles(ps.sample.lattice("sc", (9, 9, 9), 0.9))
        scene.add_interaction(ps.LennardJones(epsilon=0.0, sigma=0.4))
        return scene

    sim = ps.Simulation(gather(), device=device)
    rows = sim.neighbors.verlet[0].capacity
    sim.position = 0.3 * sim.position
    assert sim.neighbors.verlet[0].capacity > rows
    loaded = restart(sim, tmp_path / "run.npz", gather())
    ours, theirs = sim.neighbors.verlet[0], loaded.neighbors.verlet[0]
    for particle in (0, 300, 728):
        row = ours.neighbors_of(particle)
        np.testing.assert_array_equal(row, theirs.neighbors_of(particle))


def test_settings_are_those_saved_or_fit_them(device, tmp_path, refused):
    settings = ps.Settings(dt=1 / 70, substeps=7, skin=0.1, precision="float64", threads=1)
    path = tmp_path / "run.npz"
    ps.Simulation(pair(), settings, device=device).save(path)
    assert ps.Simulation.load(path, pair(), device=device).settings == settings
    finer = settings.replace(substeps=50)
    assert ps.Simulation.load(path, pair(), finer, device=device).settings == finer
    for knobs in (
        {"dt": 0.1}, {"integrator": "velocity_verlet"}, {"precision": "float32"},
        {"compensated": False},
    ):  # fmt: skip
        with refused(f"settings.{next(iter(knobs))} must be .* as in 'run.npz'"):
            ps.Simulation.load(path, pair(), settings.replace(**knobs), device=device)
    with refused("settings", TypeError):
        ps.Simulation.load(path, pair(), {"dt": 0.1}, device=device)


def test_fingerprints_hold_in_another_process():
    code = "import json, checkpoints; print(json.dumps(checkpoints.described()))"
    done = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True, text=True, timeout=100, check=True, cwd=Path(__file__).parent,
        env={**os.environ, "PYTHONHASHSEED": "7"},
    )  # fmt: skip
    assert json.loads(done.stdout.splitlines()[-1]) == described()
    assert " at 0x" not in done.stdout
