"""Checkpoints of something else, and files that cannot be written or read, are refused."""

import json
import os

import numpy as np
import pytest

import particlesim as ps

from .checkpoints import assert_same, pair, ropes


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
