"""Pictures of USD stages and of simulations: what is read, in which colours, and where."""

import numpy as np
import pytest
from pxr import Gf, Sdf, Usd, UsdGeom, Vt

import particlesim as ps
from particlesim.output import colors
from particlesim.pictures.render.look import Look
from particlesim.pictures.render.paint import Paint, field_names, spanned
from particlesim.pictures.render.preview import ground_height, seen
from particlesim.pictures.render.renderer import Renderer
from particlesim.pictures.render.stage import look_at

RED = Vt.Vec3fArray([Gf.Vec3f(1, 0, 0)])


@pytest.fixture
def stage():
    made = Usd.Stage.CreateInMemory()
    UsdGeom.SetStageUpAxis(made, UsdGeom.Tokens.y)
    return made


def vectors(rows):
    return Vt.Vec3fArray.FromNumpy(np.asarray(rows, dtype=np.float32))


def define(stage, kind, path, **attributes):
    """A prim with attributes, red if it can be."""
    prim = getattr(UsdGeom, kind).Define(stage, path)
    for name, value in attributes.items():
        prim.GetPrim().GetAttribute(name).Set(value)
    if prim.GetPrim().IsA(UsdGeom.Gprim):
        UsdGeom.Gprim(prim).GetDisplayColorAttr().Set(RED)
    return prim


def test_points_have_their_widths_and_places(stage):
    world = UsdGeom.Xform.Define(stage, "/World")
    world.AddTranslateOp().Set(Gf.Vec3d(10, 0, 0))
    world.AddRotateZOp().Set(90.0)
    world.AddScaleOp().Set(Gf.Vec3f(2, 2, 2))
    define(stage, "Points", "/World/a", points=vectors([(0, 0, 0), (1, 0, 0)]), widths=[0.2, 0.4])
    balls = look_at(stage, 0).geometry.array("ball")
    # Twice as large, then x to y, then 10 along x; the radius is half the width, twice as large.
    np.testing.assert_allclose(balls, [(10, 0, 0, 0.2), (10, 2, 0, 0.4)], atol=1e-6)


def test_points_without_widths_are_visible(stage):
    define(stage, "Points", "/a", points=vectors([(0, 0, 0), (0, 3, 4)]))
    radius = look_at(stage, 0).geometry.array("ball")[:, 3]
    assert radius == pytest.approx(0.5 * 0.005 * 5)


def test_samples_are_taken_at_the_time(stage):
    points = define(stage, "Points", "/a", widths=[1.0])
    points.GetPointsAttr().Set(vectors([(0, 0, 0)]), 1)
    points.GetPointsAttr().Set(vectors([(0, 0, 0), (1, 1, 1)]), 2)
    assert [len(look_at(stage, k).geometry.array("ball")) for k in (1, 2)] == [1, 2]


def test_curves_are_open_or_closed(stage):
    x = vectors([(0, 0, 0), (1, 0, 0), (1, 1, 0), (5, 0, 0), (5, 5, 0)])
    given = {"points": x, "curveVertexCounts": [3, 2], "widths": [1.0, 0.8, 0.6, 0.4, 0.2]}
    define(stage, "BasisCurves", "/open", type="linear", **given)
    ends = look_at(stage, 0).geometry.array("cone").reshape(-1, 2, 4)
    np.testing.assert_allclose(ends[:, 0, :3], [(0, 0, 0), (1, 0, 0), (5, 0, 0)])
    np.testing.assert_allclose(ends[:, 1, :3], [(1, 0, 0), (1, 1, 0), (5, 5, 0)])
    np.testing.assert_allclose(ends[:, :, 3], [(0.5, 0.4), (0.4, 0.3), (0.2, 0.1)])
    stage.GetPrimAtPath("/open").GetAttribute("wrap").Set("periodic")
    closed = look_at(stage, 0).geometry.array("cone").reshape(-1, 2, 4)[:, :, :2]
    pieces = {tuple(map(tuple, piece)) for piece in closed.tolist()}
    assert {((1, 1), (0, 0)), ((5, 5), (5, 0))} < pieces and len(pieces) == 5


def test_faces_of_any_size_become_triangles(stage):
    x = vectors(
        [(0, 0, 0), (2, 0, 0), (2, 1, 0), (1, 2, 0), (0, 1, 0), (3, 3, 0), (4, 3, 0), (4, 4, 0)]
    )
    mesh = define(
        stage, "Mesh", "/a", points=x, faceVertexCounts=[5, 3], subdivisionScheme="none",
        faceVertexIndices=[0, 1, 2, 3, 4, 5, 6, 7],
    )  # fmt: skip
    mesh.CreateDisplayColorPrimvar("uniform").Set(vectors([(1, 0, 0), (0, 1, 0)]))
    geometry = look_at(stage, 0).geometry
    corners = geometry.array("corner").reshape(-1, 3, 3).astype(float)
    area = 0.5 * np.cross(*(corners[:, k] - corners[:, 0] for k in (1, 2)))[:, 2]
    # The house: a square of 2 with a roof 1 high, and corners at (2, 1) and (0, 1).
    np.testing.assert_allclose([area[:3].sum(), area[3:].sum()], [2 * 1 + 2 * 1 / 2, 0.5])
    tints = geometry.array("corner_color").reshape(-1, 3, 3)[:, 0]
    np.testing.assert_array_equal(tints, [(1, 0, 0)] * 3 + [(0, 1, 0)])


@pytest.mark.parametrize("kind", ["vertex", "faceVarying"])
def test_corners_of_meshes_have_colours_and_normals(stage, kind):
    mesh = define(
        stage, "Mesh", "/a", points=vectors(np.eye(3)), faceVertexCounts=[3],
        faceVertexIndices=[2, 1, 0], normals=vectors(np.eye(3)), subdivisionScheme="none",
    )  # fmt: skip
    mesh.CreateDisplayColorPrimvar(kind).Set(vectors(np.eye(3)))
    geometry = look_at(stage, 0).geometry
    order = [2, 1, 0] if kind == "vertex" else [0, 1, 2]
    np.testing.assert_array_equal(geometry.array("corner_color"), np.eye(3)[order])
    np.testing.assert_array_equal(geometry.array("normal"), np.eye(3)[[2, 1, 0]])


def test_simple_shapes(stage):
    define(stage, "Sphere", "/sphere", radius=2.0)
    define(stage, "Cube", "/cube", size=3.0)
    define(stage, "Capsule", "/capsule", radius=0.5, height=4.0, axis="X")
    plane = define(stage, "Plane", "/plane", width=6.0, length=8.0, axis="Y")
    geometry = look_at(stage, 0).geometry
    np.testing.assert_allclose(geometry.array("ball"), [(0, 0, 0, 2)])
    np.testing.assert_allclose(geometry.array("cone"), [(-2, 0, 0, 0.5), (2, 0, 0, 0.5)])
    corners = geometry.array("corner").reshape(-1, 3, 3)
    assert len(corners) == 12 + 2
    bounds = UsdGeom.Boundable.ComputeExtentFromPlugins(plane, Usd.TimeCode.Default())
    span = np.abs(corners[-2:].reshape(-1, 3)).max(axis=0)
    np.testing.assert_allclose(span, bounds[1])  # as USD itself says
    triple = np.einsum("ni,ni->n", corners[:12, 0], np.cross(corners[:12, 1], corners[:12, 2]))
    assert triple.sum() / 6 == pytest.approx(27.0)  # all faces turned outwards


def ball_mesh(stage, path, radius):
    turn = np.linspace(0, np.pi, 7)
    rings = [(radius * np.sin(a) * np.cos(b), radius * np.sin(a) * np.sin(b), radius * np.cos(a))
             for a in turn for b in 2 * turn]  # fmt: skip
    define(
        stage,
        "Mesh",
        path,
        points=vectors(rings),
        faceVertexCounts=[3],
        faceVertexIndices=[0, 1, 2],
    )


@pytest.mark.parametrize("round_one", [True, False])
def test_instances_of_spheres_are_spheres(stage, round_one):
    instancer = UsdGeom.PointInstancer.Define(stage, "/many")
    ball_mesh(stage, "/many/prototypes/ball", 0.5)
    if not round_one:
        define(stage, "Cube", "/many/prototypes/ball", size=1.0)
    instancer.GetPrototypesRel().SetTargets([Sdf.Path("/many/prototypes/ball")])
    instancer.GetPositionsAttr().Set(vectors([(0, 0, 0), (4, 0, 0)]))
    instancer.GetScalesAttr().Set(vectors([(1, 1, 1), (2, 2, 2)]))
    instancer.GetProtoIndicesAttr().Set([0, 0])
    geometry = look_at(stage, 0).geometry
    if round_one:
        np.testing.assert_allclose(
            geometry.array("ball"), [(0, 0, 0, 0.5), (4, 0, 0, 1)], atol=1e-6
        )
    else:
        assert len(geometry.array("corner")) == 2 * 12 * 3
        np.testing.assert_allclose(geometry.box, [(-0.5, -1, -1), (5, 1, 1)])


def test_what_is_invisible_is_left_out(stage):
    for name in ("shown", "hidden", "guide"):
        define(stage, "Sphere", f"/{name}/ball")
    UsdGeom.Imageable(stage.GetPrimAtPath("/hidden/ball")).MakeInvisible()
    UsdGeom.Imageable(stage.GetPrimAtPath("/guide/ball")).CreatePurposeAttr("guide")
    assert len(look_at(stage, 0).geometry.array("ball")) == 1


def test_a_value_is_painted_through_the_map(stage):
    points = define(
        stage, "Points", "/a", points=vectors([(-1, 0, 0), (0, 0, 0), (1, 0, 0)]), widths=[0.9]
    )
    primvars = UsdGeom.PrimvarsAPI(points)
    primvars.CreatePrimvar("heat", Sdf.ValueTypeNames.FloatArray, "vertex").Set([1.0, 2.0, 3.0])
    primvars.CreatePrimvar("push", Sdf.ValueTypeNames.Float3Array, "vertex").Set(
        vectors([(3, 4, 0), (0, 0, 0), (0, 0, 5)])
    )
    assert field_names(stage) == ["heat", "push", "speed"]
    assert spanned(stage, "push", [0.0]) == pytest.approx((0.1, 5.0))  # 0 to 5 but for 1 in 100
    view = look_at(stage, 0, Paint("heat", "magma", (1.0, 3.0)))
    camera = ps.Camera((0, 0, 6), (0, 0, 0))
    picture = Renderer("cpu").draw(view.geometry, camera, 300, 100, Look(flat=True)).array
    expected = np.rint(255 * colors.encoded(colors.table("magma")[[0, 127, 255]]))
    focus = 50 / camera.slope / 6
    for k, column in enumerate((150 - focus, 150, 150 + focus)):
        np.testing.assert_allclose(picture[50, int(column)], expected[k], atol=3)  # a step of 256


def test_the_camera_of_a_stage(stage):
    camera = UsdGeom.Camera.Define(stage, "/eye")
    camera.AddTranslateOp().Set(Gf.Vec3d(0, 1, 7))
    camera.GetFocalLengthAttr().Set(50.0)
    camera.GetVerticalApertureAttr().Set(20.0)
    camera.GetFocusDistanceAttr().Set(7.0)
    own = look_at(stage, 0).camera
    np.testing.assert_allclose([own.position, own.target], [(0, 1, 7), (0, 1, 0)], atol=1e-9)
    assert own.slope == pytest.approx(10 / 50)


@pytest.fixture
def sim():
    def build(worlds=None, **options):
        scene = ps.Scene()
        scene.add_particles([(0, 1, 0), (1, 1, 0)], radius=0.2, velocity=(0, 2, 0), **options)
        scene.add_constraint(ps.PlaneBoundary((0, 0, 0), (0, 1, 0)))
        return ps.Simulation(scene, ps.Settings(dt=0.01), device="cpu", worlds=worlds)

    return build


def test_a_simulation_is_drawn_with_its_ground(sim, tmp_path, refused):
    one = sim(color=(0.0, 1.0, 0.0))
    view = seen(one)
    np.testing.assert_allclose(view.geometry.array("ball_color"), [(0, 1, 0)] * 2)
    assert view.geometry.array("corner").size == 0  # the plane is the ground
    assert -0.01 < view.floor < 0.0  # a little below, for clear floors
    assert ground_height(view, None) == ground_height(view, True) == view.floor
    assert ground_height(view, False) is None and ground_height(view, -3.0) == -3.0
    picture = one.render(tmp_path / "a.png", 160, 90)
    assert (tmp_path / "a.png").exists() and picture.array.shape == (90, 160, 3)
    green = picture.array[:, :, 1].astype(int) - picture.array[:, :, 0]
    assert green.max() > 80
    with refused("exists", FileExistsError):
        one.render(tmp_path / "a.png")
    with refused("field"):
        one.render(color="nonsense")
    with refused("camera", TypeError):
        one.render(camera=(0, 0, 1))


def test_a_simulation_shows_itself_in_notebooks(sim, monkeypatch):
    assert sim()._repr_png_().startswith(b"\x89PNG")
    monkeypatch.setitem(__import__("sys").modules, "PIL", None)
    assert sim()._repr_png_() is None


def test_worlds_stand_side_by_side(sim):
    many = sim(worlds=4)
    apart = seen(many, layout="grid").geometry.array("ball").reshape(4, 2, 4)
    corner = apart[:, 0, [0, 2]]
    steps = np.abs(corner[:, None] - corner)[~np.eye(4, dtype=bool)]
    assert (steps > (1.4, 0.4)).any(axis=1).all()  # a world is 1.4 wide and 0.4 deep
    whole = many.render(None, 200, 100).array.astype(int)
    some = many.render(None, 200, 100, worlds=[2]).array
    assert np.abs(whole - some).max() > 50


def test_a_simulation_without_particles_is_background():
    empty = ps.Simulation(ps.Scene(up_axis="z"), device="cpu")
    assert np.ptp(empty.render(None, 32, 18).array, axis=(0, 1)).max() == 0


def test_colours_by_a_value(sim):
    moving = sim()
    moving.set("velocity", [(0, 0, 0), (0, 2, 0)])
    view = seen(moving, color_by="speed", color_map="magma", color_range=(0.0, 2.0))
    expected = colors.table("magma")[[0, 255]]
    np.testing.assert_allclose(view.geometry.array("ball_color"), expected, atol=1e-6)
