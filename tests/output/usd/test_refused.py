"""What a writer of USD refuses: values, descriptions, frames and fields that do not fit."""

from __future__ import annotations

import numpy as np
import pytest

from particlesim.output.usd.description import LinksPrim, MeshPrim, Shape, StageInfo
from particlesim.output.usd.writing.writer import UsdWriter

from .recordings import BLUE, COUNT, RED, folder_content, group, motion, opened


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf, 1e39])  # 1e39: not in single precision
@pytest.mark.parametrize("name", ["position", "velocity", "density"])
def test_values_that_are_not_finite_are_refused(tmp_path, name, bad):
    path = tmp_path / "out.usda"
    position, velocity = (array.astype(float) for array in motion(2))
    arrays = [{"position": p, "velocity": v, "density": p[:, 0].copy()}
              for p, v in zip(position, velocity, strict=True)]  # fmt: skip
    points = [group(0, 0, 5), group(1, 5, 7, ids=np.arange(10, 17))]
    info = StageInfo(points=points, frames=10)
    with UsdWriter(path, info, fields={"density": 1}) as recorder:

        def write(frame: int) -> None:
            given = arrays[frame]
            recorder.write(
                frame, given["position"], given["velocity"], {"density": given["density"]}
            )

        write(0)
        before, good = folder_content(tmp_path), arrays[1][name].copy()
        arrays[1][name][7:9] = bad
        message = (
            rf"^UsdRecorder.write: {name} of particle 7 \(/World/env_0001/water, id 12\) "
            r"at frame 1 must be finite in single precision, got .*; look for .*\.$"
        )
        with pytest.raises(ValueError, match=message):
            write(1)
        assert folder_content(tmp_path) == before
        arrays[1][name][:] = good  # mended, it goes on
        write(1)
    assert opened(path).GetEndTimeCode() == 1


def test_nothing_is_created_by_a_first_frame_that_is_refused(tmp_path):
    with (
        pytest.raises(ValueError, match=r"position of particle 0 .* at frame 0"),
        UsdWriter(tmp_path / "out.usda", StageInfo(points=[group()])) as recorder,
    ):
        recorder.write(0, np.full((COUNT, 3), np.nan), np.zeros((COUNT, 3)))
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            (0, np.zeros((COUNT - 1, 3)), np.zeros((COUNT, 3))),
            r"position must have shape \(12, 3\)",
        ),
        ((0, np.zeros((COUNT, 3)), np.zeros(COUNT)), r"velocity must have shape \(12, 3\)"),
        ((0, np.zeros((COUNT, 3)), np.zeros((COUNT, 3)), {"rho": np.zeros(3)}), "fields must be"),
        ((0.5, np.zeros((COUNT, 3)), np.zeros((COUNT, 3))), "frame must be a whole number"),
    ],
)
def test_arrays_that_do_not_fit_are_refused(tmp_path, arguments, message):
    recorder = UsdWriter(tmp_path / "out.usda", StageInfo(points=[group()]))
    with pytest.raises(ValueError, match=message):
        recorder.write(*arguments)


def test_frames_come_one_by_one(tmp_path):
    position, velocity = motion(1)
    frame = (position[0], velocity[0])
    with UsdWriter(tmp_path / "out.usda", StageInfo(points=[group()], frames=9)) as recorder:
        recorder.write(4, *frame)
        for number in (3, 4, 6):
            with pytest.raises(ValueError, match=f"frame must be 5, the next, got {number}"):
                recorder.write(number, *frame)
        recorder.write(5, *frame)
    with pytest.raises(ValueError, match="before close"):
        recorder.write(6, *frame)
    stage = opened(tmp_path / "out.usda")
    assert (stage.GetStartTimeCode(), stage.GetEndTimeCode()) == (4, 5)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: group(world=-1), "PointsPrim: world must be a whole number"),
        (lambda: group(name=""), "PointsPrim: name must be a word"),
        (lambda: group(indices=slice(3, 3)), "PointsPrim: indices must have both ends and a row"),
        (lambda: group(indices=np.array([0.5])), "PointsPrim: indices must be at least one row"),
        (lambda: group(indices=np.array([-1])), "PointsPrim: indices must be at least 0"),
        (lambda: group(ids=np.arange(3)), "PointsPrim: ids must be 12 whole numbers"),
        (lambda: group(ids=np.arange(COUNT) + 2**31), r"PointsPrim: ids must be in 0\.\.2\^31"),
        (lambda: group(widths=-1.0), r"PointsPrim: widths must be at least 0 \[length\]"),
        (lambda: group(widths=np.full(COUNT, -1.0)), r"PointsPrim: widths must be at least 0"),
        (lambda: group(color=(0, 0, 2)), r"PointsPrim: color must be in 0\.\.1"),
        (lambda: LinksPrim(0, "rope", np.arange(3), 0.1, RED), "LinksPrim: pairs must have shape"),
        (
            lambda: LinksPrim(0, "rope", np.eye(2, dtype=int), 0, RED),
            "LinksPrim: width must be above",
        ),
        (lambda: Shape("plane", ((0, 0, 0), (0, 0, 0))), "Shape: normal must have a length"),
        (lambda: Shape("box", ((0, 0, 0), (1, 0, 1))), "Shape: upper must be above lower"),
        (lambda: Shape("sphere", ((0, 0, 0), 0)), "Shape: radius must be above 0"),
        (lambda: Shape("torus", (0, 0)), "Shape: kind must be one of plane, box, sphere"),
        (lambda: StageInfo(points=[]), "StageInfo: points must hold a group"),
        (lambda: StageInfo(points=[group()], up_axis="x"), "StageInfo: up_axis must be 'y' or 'z'"),
        (lambda: StageInfo(points=[group()], fps=0), "StageInfo: fps must be above 0"),
        (lambda: StageInfo(points=[group()], frames=0), "StageInfo: frames must be a whole number"),
        (
            lambda: StageInfo(points=[group()], periodic=((0, 0, 0), (1, 1, 0))),
            "StageInfo: periodic must have upper above lower",
        ),
    ],
)
def test_descriptions_that_make_no_sense_are_refused(make, message):
    with pytest.raises(ValueError, match=f"^{message}.*, got .*; .*\\.$"):
        make()


@pytest.mark.parametrize(
    "fields", [{"a": 2}, {"pid": 1}, {"velocity": 3}, {"b c": 1, "b_c": 1}], ids=str
)
def test_fields_that_readers_would_mistake_are_refused(tmp_path, fields):
    with pytest.raises(ValueError, match=r"^UsdRecorder: fields.* must have .*, got .*; .*\.$"):
        UsdWriter(tmp_path / "out.usda", StageInfo(points=[group()]), fields=fields)


# What is refused --------------------------------------------------------------------------------


def everything():
    """A description that leaves all open that can be."""
    return {
        "rows": group(indices=None, ids=None), "pairs": LinksPrim(0, "rope", None, 0.1, RED),
        "meshes": MeshPrim(0, "skin", BLUE),
        "poses": Shape("box", ((0, 0, 0), (1, 1, 1)), moving=True),
    }  # fmt: skip


@pytest.mark.parametrize(
    ("changed", "match"),
    [
        ({"rows": None}, r"rows must be for \['water'\], which leave them open"),
        ({"meshes": None}, r"meshes must be for \['skin'\]"),
        ({"rows": ([0, 99], [0, 1])}, r"position must have shape \(100, 3\), or more rows"),
        ({"rows": ([0, 1], [0, 0])}, "ids must be different"),
        ({"rows": ([0, 1], [0])}, "ids must be 2 whole numbers"),
        ({"pairs": [[0, 1, 2]]}, r"pairs must have shape \(m, 2\)"),
        ({"pairs": [[0, 12]]}, r"position must have shape \(13, 3\)"),
        (
            {"meshes": (np.eye(3), [[0, 1, 3]], np.eye(3))},
            "triangles must hold indices from 0 to 2",
        ),
        (
            {"meshes": (np.eye(3), [[0, 1, 2]], np.eye(3)[:2])},
            r"normals .*must have shape \(3, 3\)",
        ),
        ({"meshes": (np.full((3, 3), np.nan), [[0, 1, 2]], np.eye(3))}, "points .* must be finite"),
    ],
)
def test_values_that_do_not_fit_are_refused(tmp_path, refused, changed, match):
    prims = everything()
    info = StageInfo(points=[prims["rows"]], links=[prims["pairs"]], meshes=[prims["meshes"]],
                     shapes=[prims["poses"]])  # fmt: skip
    good = {"rows": ([0, 1], [0, 1]), "pairs": [[0, 1]], "poses": ((0, 0, 0), np.eye(3)),
            "meshes": (np.eye(3), [[0, 1, 2]], np.eye(3))}  # fmt: skip
    given = {
        name: {prims[name]: each} for name, each in (good | changed).items() if each is not None
    }
    out = UsdWriter(tmp_path / "out.usda", info)
    with refused(match):
        out.write(0, *motion(1)[:, 0], **given)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("make", "match"),
    [
        (lambda: group(indices=None), "ids and widths must be None and one number"),
        (lambda: group(ids=np.zeros(COUNT, int)), "ids must be different"),
        (
            lambda: MeshPrim(0, "x", BLUE, None, [(0, 1, 2)]),
            "triangles must be None without indices",
        ),
        (lambda: MeshPrim(0, "x", BLUE, slice(0, 3), [[0, 1, 3]]), "hold indices from 0 to 2"),
        (
            lambda: Shape("mesh", (np.eye(3), [[0, 1, 3]])),
            "triangles must hold indices from 0 to 2",
        ),
        (lambda: StageInfo(points=[group()], layout={0: (1, 2)}), r"layout must have shape \(3,\)"),
    ],
)
def test_open_descriptions_that_make_no_sense_are_refused(refused, make, match):
    with refused(match):
        make()


@pytest.mark.parametrize("fields", [{"widths": 3}, {"displayColor": 3}, {"a": "half"}], ids=str)
def test_fields_of_other_kinds_are_refused(tmp_path, refused, fields):
    with refused("fields"):
        UsdWriter(tmp_path / "out.usda", StageInfo(points=[group()]), fields=fields)


@pytest.mark.parametrize(
    ("kind", "values", "match"),
    [
        ("int", np.arange(COUNT) + 0.5, "be whole numbers"),
        ("int", np.arange(COUNT) + 2**31, "fit into 32 bits"),
        ("color", np.zeros(COUNT), r"have shape \(12, 3\)"),
    ],
)
def test_values_of_other_kinds_are_refused(tmp_path, refused, kind, values, match):
    out = UsdWriter(tmp_path / "out.usda", StageInfo(points=[group()]), fields={"a": kind})
    with refused(match):
        out.write(0, *motion(1)[:, 0], {"a": values})
