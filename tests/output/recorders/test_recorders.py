"""Formats by suffix, read back by other means."""

import json
import sys

import numpy as np
import pytest

import particlesim as ps
from cases.strip import squares, strip
from particlesim.output.recorders import open_recorder
from particlesim.output.recorders.ply import PlyRecorder

from .scenes import worlds

FIELDS = ["speed", "force", "charge"]


def recorded(tmp_path, suffix, precision, **options):
    """Record 3 frames; returns the path and what the frames have to hold."""
    sim = ps.Simulation(worlds(), ps.Settings(dt=0.25, precision=precision), device="cpu")
    path, wanted = tmp_path / f"out{suffix}", []
    with open_recorder(sim, path, frames=2, fields=FIELDS, **options) as recorder:
        for _ in range(3):
            wanted.append(
                {
                    "time": sim.time, "position": sim.position, "velocity": sim.velocity,
                    "force": sim.get("force"), "speed": np.sqrt((sim.velocity**2).sum(axis=1)),
                    "radius": np.array([0.1, 0.1, 0.1, 0.3, 0.1, 0.1, 0.3]),
                    "charge": np.array([1, 2, 3, -1, 1, 2, -1]),
                    "id": np.array([0, 1, 2, 3, 0, 1, 2]),
                    "group": np.array([0, 0, 0, 1, 0, 0, 1]),
                    "world": np.array([0, 0, 0, 0, 1, 1, 1]),
                }
            )  # fmt: skip
            recorder.write()
            sim.step()
    return path, wanted


def assert_same(found, wanted, exact):
    """Positions and velocities bit for bit; the rest, where it was computed here, by rounding."""
    for name, value in wanted.items():
        if name in exact:
            assert np.array_equal(found[name], value), name
        else:
            np.testing.assert_allclose(found[name], value, rtol=1e-6, err_msg=name)


EXACT = ("time", "position", "velocity", "force", "id", "group", "world")


def test_npz(tmp_path, precision):
    path, wanted = recorded(tmp_path, ".npz", precision)
    with np.load(path) as index:
        assert (index["first"], index["last"], index["dt"]) == (0, 2, 0.25)
        assert index["groups"].tolist() == ["drops", "stone"] and index["fields"].tolist() == FIELDS
        pattern = str(index["pattern"])
    for k, frame in enumerate(wanted):
        with np.load(tmp_path / pattern.format(k)) as found:
            assert found["frame"] == k and found["position"].dtype == precision
            assert_same(found, frame, EXACT)
    about = json.loads((tmp_path / "out.frames" / "index.json").read_text())
    assert about["groups"] == ["drops", "stone"] and about["particles"] == 7


def read_ply(path):
    """Properties and comments of a binary PLY, read by the text of its own header."""
    head, _, body = path.read_bytes().partition(b"end_header\n")
    lines = [line.split() for line in head.decode("ascii").splitlines()]
    assert lines[0] == ["ply"] and lines[1] == ["format", "binary_little_endian", "1.0"]
    sizes = {"float": "<f4", "double": "<f8", "int": "<i4", "uint": "<u4"}
    (count,) = [int(line[2]) for line in lines if line[:2] == ["element", "vertex"]]
    kinds = [(line[2], sizes[line[1]]) for line in lines if line[0] == "property"]
    assert len(body) == count * np.dtype(kinds).itemsize
    return np.frombuffer(body, dtype=kinds), [line[1:] for line in lines if line[0] == "comment"]


def test_ply(tmp_path, precision):
    path, wanted = recorded(tmp_path, ".ply", precision)
    assert not path.exists()
    files = sorted((tmp_path / "out.frames").glob("*.ply"))
    assert [file.name for file in files] == [f"f.{k:06d}.ply" for k in range(3)]
    for k, (file, frame) in enumerate(zip(files, wanted, strict=True)):
        table, comments = read_ply(file)
        found = {name: table[name] for name in table.dtype.names}
        found["position"] = np.stack([table[name] for name in "xyz"], axis=1)
        found["velocity"] = np.stack([table[f"v{name}"] for name in "xyz"], axis=1)
        found["force"] = np.stack([table[f"force_{name}"] for name in "xyz"], axis=1)
        found["time"] = float(next(c[1] for c in comments if c[0] == "time"))
        assert ["frame", str(k)] in comments and ["group", "1", "stone"] in comments
        assert_same(found, frame, EXACT)


def test_ply_holds_triangles_that_are_not_torn(tmp_path):
    scene, _ = strip()
    sim = ps.Simulation(scene, ps.Settings(dt=1 / 32, substeps=4), device="cpu", worlds=2)
    sim.run(1, record=tmp_path / "out.ply")
    for frame, left in ((0, [0, 0, 1, 1, 2, 2]), (1, [0, 0, 2, 2])):
        data = (tmp_path / "out.frames" / f"f.{frame:06d}.ply").read_bytes()
        head, _, body = data.partition(b"end_header\n")
        count = 2 * len(left)
        assert f"element face {count}\nproperty list uchar int vertex_indices\n".encode() in head
        faces = np.frombuffer(body[-13 * count :], dtype=[("count", "u1"), ("corners", "<i4", 3)])
        assert (faces["count"] == 3).all()
        for w in (0, 1):
            corners = faces["corners"][w * len(left) : (w + 1) * len(left)]
            assert squares(corners - 8 * w) == left


def test_ply_is_read_by_vtk(tmp_path):
    vtk, support = pytest.importorskip("vtk"), pytest.importorskip("vtk.util.numpy_support")
    path, wanted = recorded(tmp_path, ".ply", "float32")
    reader = vtk.vtkPLYReader()
    reader.SetFileName(str(path.with_suffix(".frames") / "f.000002.ply"))
    reader.Update()
    points = support.vtk_to_numpy(reader.GetOutput().GetPoints().GetData())
    np.testing.assert_array_equal(points, wanted[2]["position"])


def test_gsd(tmp_path, precision):
    gsd = pytest.importorskip("gsd.hoomd")
    path, wanted = recorded(tmp_path, ".gsd", precision)
    with gsd.open(str(path)) as file:
        assert len(file) == 3
        for k, frame in enumerate(wanted):
            particles, log = file[k].particles, file[k].log
            assert file[k].configuration.step == k and particles.types == ["drops", "stone"]
            # Of the periodic axes; the open one reaches from the origin to all of y, both ways.
            box = file[k].configuration.box.tolist()
            assert box[0] == 4 and box[2:] == [2, 0, 0, 0]
            assert box[1] == pytest.approx(2 * np.abs(frame["position"][:, 1]).max(), rel=2e-7)
            found = {name.removeprefix("particles/"): array for name, array in log.items()}
            found |= {
                "position": particles.position, "velocity": particles.velocity,
                "group": particles.typeid, "radius": particles.diameter / 2,
                "time": log["time"][0],
            }  # fmt: skip
            assert_same(found, frame, EXACT)
            assert particles.mass.tolist() == [2, 2, 2, 1, 2, 2, 1]


def test_vtkhdf(tmp_path, precision):
    h5py = pytest.importorskip("h5py")
    path, wanted = recorded(tmp_path, ".vtkhdf", precision)
    with h5py.File(path) as file:
        root, steps = file["VTKHDF"], file["VTKHDF/Steps"]
        assert root.attrs["Type"] == b"PolyData" and root.attrs["Version"].tolist() == [2, 0]
        assert steps.attrs["NSteps"] == 3 and steps["Values"][:].tolist() == [0, 0.25, 0.5]
        assert steps["NumberOfParts"][:].tolist() == [1, 1, 1]
        assert root["NumberOfPoints"][:].tolist() == [7, 7, 7]
        assert file.attrs["groups"].tolist() == ["drops", "stone"]
        for k, frame in enumerate(wanted):
            start = steps["PointOffsets"][k]
            rows = slice(start, start + root["NumberOfPoints"][steps["PartOffsets"][k]])
            found = {name: array[rows] for name, array in root["PointData"].items()}
            found |= {"position": root["Points"][rows], "time": steps["Values"][k]}
            assert_same(found, frame, EXACT)
            cell = steps["CellOffsets"][k, 0] + steps["PartOffsets"][k]
            assert root["Vertices/Offsets"][cell : cell + 8].tolist() == list(range(8))
            first = steps["ConnectivityIdOffsets"][k, 0]
            assert root["Vertices/Connectivity"][first : first + 7].tolist() == list(range(7))
    with h5py.File(tmp_path / "out.frames" / "f.000001.vtkhdf") as file:  # alone, as well
        assert np.array_equal(file["VTKHDF/Points"], wanted[1]["position"])
        assert file["VTKHDF/FieldData/time"][:] == [0.25]


def test_vtkhdf_is_read_by_vtk_from_anywhere(tmp_path, monkeypatch):
    vtk, support = pytest.importorskip("vtk"), pytest.importorskip("vtk.util.numpy_support")
    pytest.importorskip("h5py")
    path, wanted = recorded(tmp_path, ".vtkhdf", "float32")
    (tmp_path / "elsewhere").mkdir()
    path = path.rename(tmp_path / "elsewhere" / path.name)
    (tmp_path / "out.frames").rename(tmp_path / "elsewhere" / "out.frames")
    monkeypatch.chdir("/")
    reader = vtk.vtkHDFReader()
    reader.SetFileName(str(path))
    reader.UpdateInformation()
    assert reader.GetNumberOfSteps() == 3
    for k, frame in enumerate(wanted):
        reader.SetStep(k)
        reader.Update()
        output = reader.GetOutput()
        numbers = support.vtk_to_numpy
        assert np.array_equal(numbers(output.GetPoints().GetData()), frame["position"])
        assert np.array_equal(numbers(output.GetPointData().GetArray("force")), frame["force"])
        assert output.GetNumberOfVerts() == 7


@pytest.mark.parametrize("suffix", [".npz", ".usda"])
def test_every_second_frame(tmp_path, suffix):
    recorded(tmp_path, suffix, "float32", every=2)
    folder = tmp_path / ("out.frames" if suffix == ".npz" else "out.clips")
    assert sorted(each.stem for each in folder.glob("f.*")) == ["f.000000", "f.000001"]
    if suffix == ".npz":
        assert np.load(folder / "f.000001.npz")["time"] == 0.5


# What is refused --------------------------------------------------------------------------------


def test_arguments_that_do_not_fit(tmp_path, monkeypatch, refused):
    monkeypatch.chdir(tmp_path)  # messages shorten long paths
    sim = ps.Simulation(worlds(), device="cpu")
    with refused("end in one of .usda, .usd, .usdc, .npz, .ply, .gsd, .vtkhdf, got 'out.abc'"):
        open_recorder(sim, "out.abc")
    with refused("existing folder", FileNotFoundError):
        open_recorder(sim, tmp_path / "none" / "out.npz")
    with refused("option must be one of frames, fields, .*got 'color_by'", TypeError):
        open_recorder(sim, tmp_path / "out.npz", color_by="speed")
    with refused("fields must have other names than what every frame has, got 'radius'"):
        open_recorder(sim, tmp_path / "out.npz", fields=["radius"])
    with refused("field must be one of .*, got 'colour'"):
        open_recorder(sim, tmp_path / "out.ply", fields=["colour"])
    with refused("end in .ply"):
        PlyRecorder(sim, tmp_path / "out.npz")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(("suffix", "package"), [(".gsd", "gsd.hoomd"), (".vtkhdf", "h5py")])
def test_a_missing_package_is_named(tmp_path, suffix, package, monkeypatch, refused):
    monkeypatch.setitem(sys.modules, package, None)
    with refused(rf"pip install 'particlesim\[{suffix[1:]}\]'", ImportError):
        open_recorder(ps.Simulation(worlds(), device="cpu"), tmp_path / f"out{suffix}")


def test_frames_come_in_order(tmp_path, refused):
    sim = ps.Simulation(worlds(), device="cpu")
    recorder = open_recorder(sim, tmp_path / "out.npz")
    recorder.write()
    with refused("frame must be the next, got 0"):
        recorder.write()
    recorder.close()
    recorder.close()
    sim.step()
    with refused("frame must come before close"):
        recorder.write()
