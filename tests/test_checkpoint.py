"""Checkpoints: a restart equals the uninterrupted run bit for bit, and bad files are refused."""

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
from particlesim.commands.scene_files import ready_scenes
from particlesim.scene.fingerprint import fingerprint

SCENES = list(ready_scenes())
SMALL = {
    "dam_break": {"spacing": 0.05},
    "star_collision": {"count": 150},
    "freezing": {"cells": 5},
    "gas_in_a_box": {"count": 400},
    "pile": {"count": 100},
}


def arrays(sim):
    return {name: array.numpy().copy() for name, array in sim.frames.snapshot.contents().items()}


def assert_same(sim, other):
    """Equal bits in every array: also NaN and the sign of zero would show."""
    ours, theirs = arrays(sim), arrays(other)
    assert ours.keys() == theirs.keys()
    for name, array in ours.items():
        assert array.dtype == theirs[name].dtype, name
        assert array.tobytes() == theirs[name].tobytes(), name
    assert sim.frame == other.frame and sim.time == other.time


def restart(sim, path, scene, frames=3, **options):
    """Save, go on, and go on from the file: both must end the same."""
    sim.save(path)
    saved = arrays(sim)
    loaded = ps.Simulation.load(path, scene, device=sim.device, **options)
    assert all(saved[name].tobytes() == each.tobytes() for name, each in arrays(loaded).items())
    sim.run(frames)
    loaded.run(frames)
    assert_same(sim, loaded)
    return loaded


def ropes(strength=None, count=4):
    """Ropes of different weight over a ground, with contacts."""
    scene = ps.Scene()
    for k in range(count):
        x = np.stack([np.linspace(0, 1, 9), np.full(9, 0.3), np.full(9, 0.2 * k)], axis=1)
        rope = scene.add_particles(x, mass=1.0 + k, radius=0.05, pinned=np.arange(9) == 0)
        pairs = np.stack([rope[:-1], rope[1:]], axis=1)
        scene.add_constraint(ps.Distance(pairs, compliance=1e-6, break_force=strength))
    scene.add_interaction(ps.UniformGravity())
    scene.add_constraint(ps.Contact(friction=0.3))
    scene.add_constraint(ps.PlaneBoundary((0, 0, 0), (0, 1, 0)))
    return scene


def pair(charge=1.0, **options):
    scene = ps.Scene(**options)
    scene.add_particles([(0, 0, 0), (1, 0, 0)], group="ends", charge=charge)
    scene.add_interaction(ps.Springs([(0, 1)], stiffness=10.0, rest_length=0.5))
    return scene


@pytest.mark.parametrize("name", SCENES)
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
    sim.world(2).velocity = 0.1
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
    sim.diagnostics()  # makes the array of masses
    sim.set("mass", [2.0, 3.0])
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


def described():
    """Fingerprints of all ready scenes, as they are saved."""
    modules = {name: importlib.import_module(f"particlesim.scenes.{name}") for name in SCENES}
    return {
        name: json.dumps(fingerprint([module.build(**SMALL.get(name, {}))]))
        for name, module in modules.items()
    }


def test_fingerprints_hold_in_another_process():
    code = "import json, test_checkpoint; print(json.dumps(test_checkpoint.described()))"
    done = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True, text=True, timeout=100, check=True, cwd=Path(__file__).parent,
        env={**os.environ, "PYTHONHASHSEED": "7"},
    )  # fmt: skip
    assert json.loads(done.stdout.splitlines()[-1]) == described()
    assert " at 0x" not in done.stdout


@ps.law
def weak(r: float, charge_i: float, charge_j: float):
    return 0.1 * charge_i * charge_j / r


@ps.law
def strong(r: float, charge_i: float, charge_j: float):
    return 10.0 * charge_i * charge_j / r


def changed(**changes):
    """A scene with something of everything, and one thing of it changed."""
    given = {
        "count": 3, "group": "ions", "law": weak, "members": [0, 1], "pairs": [(0, 1)],
        "more": False, "side": 9.0, "charge": 1.0, "breaks": 5.0, **changes,
    }  # fmt: skip
    scene = ps.Scene(periodic=((0, 0, 0), (given["side"],) * 3))
    x = np.arange(1, given["count"] + 1)[:, None] * np.ones(3)
    scene.add_particles(x, group=given["group"], charge=given["charge"])
    scene.add_interaction(ps.PairPotential(given["law"], given["members"], cutoff=2.0))
    scene.add_constraint(ps.Distance(given["pairs"], break_force=given["breaks"]))
    if given["more"]:
        scene.add_interaction(ps.Drag(1.0))
    return scene


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"count": 4}, r"scene.particle_count must be as in 'run.npz', 3, got 4"),
        ({"group": "atoms"}, r"scene.groups\[0\]\[0\] must .* 'ions', got 'atoms'"),
        ({"law": strong}, r"scene.interactions\[0\].kind\[1\]\[0\] must .*weak.*strong"),
        ({"members": [0, 2]}, r"scene.interactions\[0\].particles must"),
        ({"pairs": [(0, 2)]}, r"scene.constraints\[0\].particles must"),
        ({"pairs": [(0, 1), (1, 2)]}, r"scene.constraints\[0\]"),
        ({"more": True}, r"scene.interactions must .*got \['PairPotential', 'Drag'\]"),
        ({"side": 8.0}, r"scene.periodic\[1\]\[0\] must .* 9.0, got 8.0"),
        ({"charge": [(1, 0, 0)] * 3}, r"scene.attributes.charge must"),
        ({"breaks": None}, r"scene.constraints\[0\]"),
    ],
)
def test_another_scene_is_refused(change, told, tmp_path, refused):
    path = tmp_path / "run.npz"
    ps.Simulation(changed(), device="cpu").save(path)
    ps.Simulation.load(path, changed(charge=2.0, breaks=9.0), device="cpu")  # values may change
    with refused(told):
        ps.Simulation.load(path, changed(**change), device="cpu")


def test_another_world_is_refused(tmp_path, refused):
    path = tmp_path / "run.npz"
    ps.Simulation([changed(), changed()], device="cpu").save(path)
    with refused(r"scenes\[1\].particle_count must be as in 'run.npz', 3, got 4"):
        ps.Simulation.load(path, [changed(), changed(count=4)], device="cpu")
    with refused("worlds must be as in 'run.npz', 2, got 1"):  # they were not one scene's copies
        ps.Simulation.load(path, changed(), device="cpu")


# Files -----------------------------------------------------------------------------------------


def test_a_file_is_replaced_only_if_asked(device, tmp_path, refused):
    path = tmp_path / "run.npz"
    sim = ps.Simulation(pair(), device=device)
    sim.save(path)
    sim.step()
    before = path.read_bytes()
    with refused("pass overwrite=True", FileExistsError):
        sim.save(path)
    assert path.read_bytes() == before
    sim.save(str(path), overwrite=True)
    assert ps.Simulation.load(str(path), pair(), device=device).frame == 1
    assert os.listdir(tmp_path) == ["run.npz"]


def test_places_that_cannot_be_written(tmp_path, refused, monkeypatch):
    sim = ps.Simulation(pair(), device="cpu")
    with refused("end in .npz"):
        sim.save(tmp_path / "run.usda")
    with refused("existing folder", FileNotFoundError):
        sim.save(tmp_path / "missing" / "run.npz")
    (tmp_path / "folder.npz").mkdir()
    with refused("be a file", IsADirectoryError):
        sim.save(tmp_path / "folder.npz", overwrite=True)

    # The disk is full: what was there stays, and nothing else is left behind.
    path = tmp_path / "run.npz"
    sim.save(path)

    def full(file):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with refused("No space left", OSError):
        sim.save(path, overwrite=True)
    assert sorted(os.listdir(tmp_path)) == ["folder.npz", "run.npz"]
    assert ps.Simulation.load(path, pair(), device="cpu").frame == 0


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="root may write")
def test_a_folder_without_permission(tmp_path, refused):
    tmp_path.chmod(0o500)
    with refused("writable", PermissionError):
        ps.Simulation(pair(), device="cpu").save(tmp_path / "run.npz")


def test_files_that_are_no_checkpoint(tmp_path, refused):
    with refused("be a file that can be read", FileNotFoundError):
        ps.Simulation.load(tmp_path / "missing.npz", pair())
    with refused("be a file that can be read", IsADirectoryError):
        ps.Simulation.load(tmp_path, pair())
    foreign = tmp_path / "foreign.npz"
    for write in (
        lambda: foreign.write_bytes(b""),
        lambda: foreign.write_text("not a zip"),
        lambda: np.savez(foreign, position=np.zeros((2, 3))),
        lambda: np.savez(foreign, header=np.frombuffer(b'{"format": "other"}', np.uint8)),
        lambda: np.savez(foreign, header=np.frombuffer(b"[1]", np.uint8)),
        lambda: np.savez(foreign, header=np.array([object()], dtype=object)),  # a pickle
    ):
        write()
        with refused(r"whole checkpoint .*foreign.npz"):
            ps.Simulation.load(foreign, pair())


def test_damaged_files_are_found(tmp_path, refused):
    path, damaged = tmp_path / "run.npz", tmp_path / "damaged.npz"
    sim = ps.Simulation(pair(), device="cpu")
    sim.run(1)
    sim.save(path)
    whole = path.read_bytes()
    for size in (1, 100, len(whole) // 2, len(whole) - 1):
        damaged.write_bytes(whole[:size])
        with refused("whole checkpoint .*damaged.npz"):
            ps.Simulation.load(damaged, pair(), device="cpu")
    rng, found = np.random.default_rng(0), 0
    for at in rng.permutation(len(whole))[:300]:
        flipped = bytearray(whole)
        flipped[at] ^= 1 << int(rng.integers(8))
        damaged.write_bytes(flipped)
        try:
            loaded = ps.Simulation.load(damaged, pair(), device="cpu")
        except ValueError as error:
            assert "Simulation.load: path must be" in str(error) and "damaged.npz" in str(error)
            found += 1
        else:
            # A date, an attribute or another byte of the archive that says nothing.
            assert_same(sim, loaded)
    assert found > 150


def rewritten(path, **changes):
    """A checkpoint with another header."""
    with np.load(path) as file:
        content = dict(file)
    header = json.loads(content["header"].tobytes())
    header.update(changes)
    content["header"] = np.frombuffer(json.dumps(header).encode(), np.uint8)
    other = path.with_name("other.npz")
    np.savez(other, **content)
    return other


def test_newer_files_are_refused(tmp_path, refused):
    path = tmp_path / "run.npz"
    ps.Simulation(pair(), device="cpu").save(path)
    other = rewritten(path, format_version=2, particlesim="9.0")
    with refused("format 1 or older, got format 2 in .*other.npz.*use particlesim 9.0"):
        ps.Simulation.load(other, pair())
    other = rewritten(path, settings={"dt": 0.1, "haste": 3})
    with refused("this version of particlesim, got .*other.npz.*haste"):
        ps.Simulation.load(other, pair())
    # An engine that needs other arrays for the same scene.
    other = rewritten(path, arrays=["state/position"])
    with refused("this version of particlesim, got .*other.npz.*state/force"):
        ps.Simulation.load(other, pair(), device="cpu")


def test_a_checkpoint_is_an_archive_of_arrays(tmp_path):
    path = tmp_path / "run.npz"
    sim = ps.Simulation(ropes(), device="cpu")
    sim.run(1)
    sim.save(path)
    with np.load(path, allow_pickle=False) as file:
        np.testing.assert_array_equal(file["state/position"], sim.position)
        header = json.loads(file["header"].tobytes())
    assert header["frame"] == 1 and header["particlesim"] == ps.__version__


def test_a_checkpoint_goes_from_one_device_to_another(device, tmp_path):
    path = tmp_path / "run.npz"
    sim = ps.Simulation(ropes(strength=60.0), device=device)
    sim.run(3)
    sim.save(path)
    loaded = ps.Simulation.load(path, ropes(strength=60.0), device="cpu")
    assert loaded.device.is_cpu
    assert_same(sim, loaded)
    loaded.save(tmp_path / "back.npz")
    assert_same(sim, ps.Simulation.load(tmp_path / "back.npz", ropes(60.0), device=device))
