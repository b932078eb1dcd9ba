"""Images, unwrapped positions and the boxes of recordings."""

import numpy as np
import pytest
from pxr import Usd, UsdGeom

import particlesim as ps
from particlesim.output.recorders import open_recorder

from .test_recorders import read_ply

LENGTH = np.array([10.0, 0.0, 4.0])
START = np.array([(25.0, 5.0, -1.0), (-3.0, -50.0, 2.0)])
VELOCITY = np.array([(6.0, 1.0, 0.0), (-11.0, 0.0, -3.0)])
FIELDS = ("image", "unwrapped")


def _through_boxes(precision):
    """Two particles that start outside of their box and go straight on, in whole numbers."""
    scene = ps.Scene(periodic=((0, None, -2), (10, None, 2)))
    scene.add_particles(START, velocity=VELOCITY, group="two")
    return ps.Simulation(scene, ps.Settings(dt=1.0, substeps=8, precision=precision), device="cpu")


def _recorded(tmp_path, suffix, precision):
    path = tmp_path / f"out{suffix}"
    _through_boxes(precision).run(2, record=path, fields=FIELDS)
    return path


def _check(k, position, image, unwrapped):
    expected = START + k * VELOCITY
    np.testing.assert_array_equal(unwrapped, expected)
    np.testing.assert_array_equal(position + image * LENGTH, expected)
    position = np.asarray(position)
    for axis, lower, upper in ((0, 0, 10), (2, -2, 2)):
        assert (position[:, axis] >= lower).all() and (position[:, axis] < upper).all()


def test_npz(tmp_path, precision):
    _recorded(tmp_path, ".npz", precision)
    for k in range(3):
        with np.load(tmp_path / "out.frames" / f"f.{k:06d}.npz") as found:
            _check(k, *(found[name] for name in ("position", *FIELDS)))
            assert found["image"].dtype == np.int32 and found["unwrapped"].dtype == np.float64


def test_ply(tmp_path, precision):
    _recorded(tmp_path, ".ply", precision)
    for k in range(3):
        table, _ = read_ply(tmp_path / "out.frames" / f"f.{k:06d}.ply")
        names = ("xyz", *([f"{name}_{axis}" for axis in "xyz"] for name in FIELDS))
        _check(k, *(np.stack([table[each] for each in name], axis=1) for name in names))


def test_vtkhdf(tmp_path, precision):
    h5py = pytest.importorskip("h5py")
    with h5py.File(_recorded(tmp_path, ".vtkhdf", precision)) as file:
        root = file["VTKHDF"]
        for k in range(3):
            rows = slice(2 * k, 2 * k + 2)
            _check(k, root["Points"][rows], *(root["PointData"][name][rows] for name in FIELDS))


def test_usd(tmp_path, precision):
    stage = Usd.Stage.Open(str(_recorded(tmp_path, ".usda", precision)))
    prim = stage.GetPrimAtPath("/World/env_0000/two")
    values = [UsdGeom.PrimvarsAPI(prim).GetPrimvar(name) for name in FIELDS]
    for k in range(3):
        points = np.array(UsdGeom.Points(prim).GetPointsAttr().Get(k))
        _check(k, points, *(np.array(each.Get(k)) for each in values))


def test_gsd_has_images_of_its_own(tmp_path, precision):
    """Also where nobody has asked for them."""
    gsd = pytest.importorskip("gsd.hoomd")
    path = _recorded(tmp_path, ".gsd", precision)
    _through_boxes(precision).run(2, record=tmp_path / "plain.gsd")
    with gsd.open(str(path)) as file, gsd.open(str(tmp_path / "plain.gsd")) as plain:
        for k in range(3):
            particles = file[k].particles
            unwrapped = file[k].log["particles/unwrapped"]
            _check(k, particles.position, particles.image, unwrapped)
            np.testing.assert_array_equal(plain[k].particles.image, particles.image)
            assert "particles/image" not in file[k].log
            np.testing.assert_array_equal(file[k].configuration.box[[0, 2]], [10, 4])


def test_gsd_boxes_hold_everybody_in_every_frame(tmp_path, precision):
    gsd = pytest.importorskip("gsd.hoomd")
    rng = np.random.default_rng(5)
    scene = ps.Scene()
    scene.add_particles(rng.normal(size=(40, 3)), velocity=rng.normal(scale=9.0, size=(40, 3)))
    settings = ps.Settings(dt=0.1, precision=precision)
    path = tmp_path / "open.gsd"
    ps.Simulation(scene, settings, device="cpu").run(20, record=path)
    with gsd.open(str(path)) as file:
        assert len(file) == 21
        for frame in file:
            half = 0.5 * frame.configuration.box[:3]
            reach = np.abs(frame.particles.position).max(axis=0)
            assert (reach <= half).all()
            np.testing.assert_allclose(half, reach, rtol=2e-7)  # and no more than has to be


def test_only_a_periodic_scene_has_images(tmp_path, refused):
    scene = ps.Scene()
    scene.add_particles([(1, 2, 3)])
    sim = ps.Simulation(scene, device="cpu")
    with refused("got 'image'"):
        open_recorder(sim, tmp_path / "out.npz", fields=["image"])
    sim.run(1, record=tmp_path / "out.npz", fields=["unwrapped"])
    with np.load(tmp_path / "out.frames" / "f.000001.npz") as found:
        np.testing.assert_array_equal(found["unwrapped"], [(1, 2, 3)])


def test_images_go_on_from_a_checkpoint_and_back_to_the_start(tmp_path):
    sim = _through_boxes("float64")
    sim.step()
    sim.save(tmp_path / "half.npz")
    again = ps.Simulation.load(tmp_path / "half.npz", sim.scenes[0])
    again.step()
    np.testing.assert_array_equal(again.state.unwrapped(), START + 2 * VELOCITY)
    again.reset()
    np.testing.assert_array_equal(again.state.unwrapped(), START)
