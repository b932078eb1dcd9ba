"""What recordings draw of simulations, and how: filters, layouts, colours, meshes, boundaries."""

import numpy as np
import pytest
import warp as wp
from pxr import Sdf, Usd, UsdGeom

import particlesim as ps
from particlesim.output.colors import colored
from particlesim.output.usd.checking.check import check


def opened(path):
    """The stage, in which neither usd-core's validators nor ours find a fault at any frame."""
    assert check(path) == []
    return Usd.Stage.Open(str(path))


def value(stage, path, frame):
    return np.array(stage.GetAttributeAtPath(path).Get(frame))


def names(stage, kind):
    """Paths of the prims of a type, below the worlds."""
    return [str(p.GetPath())[7:] for p in stage.Traverse() if p.GetTypeName() == kind]


def record(sim, path, frames, **options):
    """Record a run; positions and velocities of every frame of the simulation."""
    states = []
    with ps.UsdRecorder(sim, path, frames=frames, **options) as out:
        for frame in range(frames + 1):
            states.append((sim.position, sim.velocity))
            out.write()
            if frame < frames:
                sim.step()
    return [np.array(each) for each in zip(*states, strict=True)]


def flying(count=4, groups=("a", "b"), **options):
    """Particles that fly straight on, each at a speed of its own."""
    scene = ps.Scene(**options)
    for k, name in enumerate(groups):
        rows = np.arange(count) + 10.0 * k
        scene.add_particles(
            np.stack([rows, 0 * rows, 0 * rows], axis=1), group=name, radius=0.1, charge=rows,
            velocity=np.stack([0 * rows, 1 + rows, 0 * rows], axis=1),
        )  # fmt: skip
    return scene


SETTINGS = ps.Settings(dt=1 / 32, substeps=1)  # exact in binary


# Which ------------------------------------------------------------------------------------------


def test_worlds_and_groups_are_chosen(tmp_path, device):
    sim = ps.Simulation(flying(), SETTINGS, device=device, worlds=4)
    position, _ = record(sim, tmp_path / "out.usda", 1, worlds=[3, 1], groups=["b"])
    stage = opened(tmp_path / "out.usda")
    assert names(stage, "Points") == ["env_0001/b", "env_0003/b"]
    for w in (1, 3):
        found = value(stage, f"/World/env_000{w}/b.points", 1)
        np.testing.assert_array_equal(found, position[1, 8 * w + 4 : 8 * w + 8])


def test_links_need_both_ends(tmp_path, device):
    scene = flying()
    scene.add_interaction(ps.Springs([(0, 1), (3, 4), (4, 5)], 0.0))
    sim = ps.Simulation(scene, SETTINGS, device=device)
    record(sim, tmp_path / "out.usda", 0, groups=scene["b"])
    stage = opened(tmp_path / "out.usda")
    ends = value(stage, "/World/env_0000/Springs.points", 0)
    np.testing.assert_array_equal(ends, scene.position[[4, 5]])


def test_every_kth_frame_counts_one_by_one(tmp_path, device):
    # Free flight: x(next) = x + v dt exactly, also from each recorded frame to the next.
    sim = ps.Simulation(flying(), SETTINGS, device=device)
    sim.run(1)  # a start that is not recorded itself
    position, _ = record(sim, tmp_path / "out.usda", 9, every=3)
    stage = opened(tmp_path / "out.usda")
    assert (stage.GetStartTimeCode(), stage.GetEndTimeCode()) == (1, 3)
    assert stage.GetTimeCodesPerSecond() == pytest.approx(32 / 3)
    for code in (1, 2, 3):
        found = value(stage, "/World/env_0000/a.points", code)
        np.testing.assert_array_equal(found, position[3 * code - 1, :4])
    moved = value(stage, "/World/env_0000/a.velocities", 1) / stage.GetTimeCodesPerSecond()
    np.testing.assert_allclose(moved, position[5, :4] - position[2, :4], rtol=1e-6, atol=1e-7)


def test_a_captured_frame_shares_nothing_with_the_simulation(tmp_path, device):
    sim = ps.Simulation(flying(), SETTINGS, device=device)
    with ps.UsdRecorder(sim, tmp_path / "out.usda", fields=["speed"], color_by="charge") as out:
        start, frame = sim.position, out.capture()
        sim.step()
        sim.velocity = 0.0
        out.write_frame(frame)
    stage = opened(tmp_path / "out.usda")
    np.testing.assert_array_equal(value(stage, "/World/env_0000/a.points", 0), start[:4])
    speed = value(stage, "/World/env_0000/a.primvars:speed", 0)
    np.testing.assert_array_equal(speed, 1 + np.arange(4))


# Where ------------------------------------------------------------------------------------------


def placed(stage, w):
    prim = stage.GetPrimAtPath(f"/World/env_{w:04d}")
    return np.array(UsdGeom.XformCache(0).GetLocalToWorldTransform(prim).ExtractTranslation())


def test_worlds_in_a_row(tmp_path):
    sim = ps.Simulation(flying(), SETTINGS, device="cpu", worlds=3)
    record(sim, tmp_path / "out.usda", 0, layout=(0, 0, 7), worlds=[0, 2])
    stage = opened(tmp_path / "out.usda")
    np.testing.assert_array_equal([placed(stage, w) for w in (0, 2)], [(0, 0, 0), (0, 0, 7)])
    for w in (0, 2):  # never baked into the points
        found = value(stage, f"/World/env_{w:04d}/a.points", 0)
        np.testing.assert_array_equal(found, sim.world(w).position[:4])


@pytest.mark.parametrize("up_axis", ["y", "z"])
def test_worlds_on_a_grid_do_not_overlap(tmp_path, up_axis):
    scene = flying(up_axis=up_axis)
    up = "xyz".index(up_axis)
    scene.add_constraint(ps.BoxBoundary((-1, -1, -1), np.where(np.arange(3) == up, np.inf, 20)))
    sim = ps.Simulation(scene, SETTINGS, device="cpu", worlds=5)
    record(sim, tmp_path / "out.usda", 0, layout="grid")
    stage = opened(tmp_path / "out.usda")
    at = np.array([placed(stage, w) for w in range(5)])
    np.testing.assert_array_equal(at[:, up], 0)
    apart = np.abs(at[:, None] - at[None]) >= 21.0  # the box; not upwards
    apart[..., up] = False
    assert (apart.any(axis=-1) | np.eye(5, dtype=bool)).all()


@ps.law
def push(charge: float):
    return wp.vec3(charge, 0.0, 0.0)


# Values -----------------------------------------------------------------------------------------


def test_fields_may_be_attributes_and_derived(tmp_path, device):
    scene = flying()
    scene.add_interaction(ps.ConstantForce((1, 0, 2)))
    sim = ps.Simulation(scene, SETTINGS, device=device)
    fields = ["charge", "speed", "mass", "force"]
    _, velocity = record(sim, tmp_path / "out.usda", 2, fields=fields)
    stage = opened(tmp_path / "out.usda")
    prim = "/World/env_0000/b.primvars:"
    np.testing.assert_array_equal(value(stage, f"{prim}charge", 2), 10 + np.arange(4))
    np.testing.assert_array_equal(value(stage, f"{prim}mass", 2), 1)
    np.testing.assert_array_equal(value(stage, f"{prim}force", 2), np.tile((1, 0, 2), (4, 1)))
    expected = np.linalg.norm(velocity[2, 4:], axis=1)  # not scaled to playback
    np.testing.assert_allclose(value(stage, f"{prim}speed", 2), expected, rtol=1e-6)


def pool(count=5, **options):
    scene = ps.Scene()
    water = scene.add_particles(
        ps.sample.box((0, 0, 0), (1, 1, 1), spacing=1 / count), mass=1 / count**3,
        radius=0.5 / count, group="water", **options,
    )  # fmt: skip
    scene.add_particles([(0, 3, 0)], group="duck")
    scene.add_interaction(
        ps.SPH(water, smoothing_length=2.6 / count, rest_density=1.0,
               equation_of_state=ps.Tait(5.0))
    )  # fmt: skip
    return scene


def test_densities_are_there_at_the_start_and_change_nothing(tmp_path, device):
    settings = ps.Settings(dt=0.01, substeps=2)
    sims = [ps.Simulation(pool(), settings, device=device) for _ in range(3)]
    record(sims[0], tmp_path / "out.usda", 3, fields=["density"], color_by="pressure")
    for _ in range(3):
        sims[1].step()
    np.testing.assert_array_equal(sims[0].position, sims[1].position)
    sims[2].forces(0.005)
    stage = opened(tmp_path / "out.usda")
    start = value(stage, "/World/env_0000/water.primvars:density", 0)
    np.testing.assert_array_equal(start, sims[2].get("density")[:-1].astype(np.float32))
    assert (start > 0).all()


def test_colors_follow_a_value_through_a_map(tmp_path, device):
    sim = ps.Simulation(flying(), SETTINGS, device=device, worlds=2)
    ramp = [(0, 0, 0), (1, 0.5, 0)]
    options = {"color_by": "velocity", "color_map": ramp, "color_range": (1, 14)}
    _, velocity = record(sim, tmp_path / "out.usda", 1, **options)
    stage = opened(tmp_path / "out.usda")
    found = value(stage, "/World/env_0001/b.primvars:displayColor", 1)
    share = (np.linalg.norm(velocity[1, 12:], axis=1) - 1) / 13
    # A map has 256 steps: half of one off at most.
    np.testing.assert_allclose(found, share[:, None] * ramp[1], atol=0.5 / 255 + 1e-6)


def test_the_range_of_colors_is_that_of_the_first_frame_that_has_one(tmp_path, device):
    scene = flying()
    scene.add_interaction(ps.ParticleForce(push))
    sim = ps.Simulation(scene, SETTINGS, device=device)
    sim.velocity = 0.0  # nothing differs at the start
    _, velocity = record(sim, tmp_path / "out.usda", 3, color_by="speed", groups=["b"])
    stage = opened(tmp_path / "out.usda")
    speed = np.linalg.norm(velocity, axis=-1)[:, 4:]
    for frame, (lower, upper) in enumerate([(0, 0)] + 3 * [(speed[1].min(), speed[1].max())]):
        found = value(stage, "/World/env_0000/b.primvars:displayColor", frame)
        np.testing.assert_array_equal(found, colored(speed[frame], "viridis", lower, upper))
    clip = Sdf.Layer.FindOrOpen(str(tmp_path / "out.clips/f.000003.usdc"))
    notes = clip.customLayerData["particlesim"]
    assert (notes["colorLower"], notes["colorUpper"]) == (speed[1].min(), speed[1].max())


def test_a_resumed_recording_keeps_its_range_of_colors(tmp_path, device):
    path = tmp_path / "out.usda"
    sim = ps.Simulation(flying(), SETTINGS, device=device)
    with ps.UsdRecorder(sim, path, color_by="speed") as out:
        out.write()
    sim.step()
    sim.velocity = 2 * sim.velocity  # a range of its own would be another
    with ps.UsdRecorder(sim, path, color_by="speed", resume=0) as out:
        out.write()
    stage = opened(path)
    speed = np.linalg.norm(sim.velocity[:4], axis=1)
    found = value(stage, "/World/env_0000/a.primvars:displayColor", 1)
    np.testing.assert_array_equal(found, colored(speed, "viridis", 1.0, 14.0))


# Meshes -----------------------------------------------------------------------------------------


def cloth(size=4):
    """A square of particles in the plane y = 1, its triangles and its edges along the axes."""
    at = np.stack(np.meshgrid(*2 * [np.arange(size)], indexing="ij"), axis=-1).reshape(-1, 2)
    position = np.stack([at[:, 0], np.ones(size**2), at[:, 1]], axis=1)
    index = np.arange(size**2).reshape(size, size)
    faces = index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]
    a, b, c, d = (corner.ravel() for corner in faces)
    triangles = np.concatenate([np.stack([a, d, c], 1), np.stack([a, c, b], 1)])
    edges = np.concatenate([
        np.stack([index[:-1].ravel(), index[1:].ravel()], 1),
        np.stack([index[:, :-1].ravel(), index[:, 1:].ravel()], 1),
    ])  # fmt: skip
    return position, triangles, edges


def test_a_group_with_triangles_is_a_mesh(tmp_path, device):
    position, triangles, edges = cloth()
    scene = ps.Scene()
    scene.add_particles([(0, 5, 0)], group="bob", radius=0.1)
    sheet = scene.add_particles(position, triangles=triangles, group="sheet", radius=0.1)
    scene.add_interaction(ps.UniformGravity())
    scene.add_constraint(ps.Distance(np.concatenate([sheet[edges], [(0, sheet[0])]])))
    sim = ps.Simulation(scene, SETTINGS, device=device, worlds=2)
    states, velocities = record(sim, tmp_path / "out.usda", 2, fields=["speed"])
    stage = opened(tmp_path / "out.usda")
    assert names(stage, "Points") == ["env_0000/bob", "env_0001/bob"]
    assert names(stage, "Mesh") == ["env_0000/sheet", "env_0001/sheet"]
    for w, frame in np.ndindex(2, 3):
        sheet_rows = slice(17 * w + 1, 17 * w + 17)
        prim = f"/World/env_000{w}/sheet"
        found = value(stage, f"{prim}.points", frame)
        np.testing.assert_array_equal(found, states[frame, sheet_rows])
        v = value(stage, f"{prim}.velocities", frame)
        np.testing.assert_array_equal(v, velocities[frame, sheet_rows])
    np.testing.assert_array_equal(
        value(stage, "/World/env_0000/sheet.faceVertexIndices", 0), triangles.ravel()
    )
    # Flat at the start, and seen from above: a, d, c turns counterclockwise about +y.
    np.testing.assert_allclose(
        value(stage, "/World/env_0001/sheet.normals", 0), np.tile((0, 1, 0), (16, 1)), atol=1e-6
    )
    # Edges of the mesh are not drawn once more; what hangs on it is.
    assert len(value(stage, "/World/env_0000/Distance.points", 0)) == 2


@pytest.mark.parametrize(
    ("triangles", "match"),
    [
        ([(0, 1)], r"triangles must be whole numbers of shape \(t, 3\)"),
        ([(0.0, 1.0, 2.0)], "triangles must be whole numbers"),
        ([], "triangles must be whole numbers"),
        (np.zeros((0, 3), int), "triangles must be whole numbers"),
        ([(0, 1, 3)], "triangles must hold indices from 0 to 2, got 3"),
        ([(0, 1, -1)], "triangles must hold indices from 0 to 2, got -1"),
        ([(0, 1, 2), (2, 1, 2)], r"triangles\[1\] must have three different corners"),
    ],
)
def test_triangles_that_are_none_are_refused(refused, triangles, match):
    scene = ps.Scene()
    with refused(match):
        scene.add_particles(np.eye(3), triangles=triangles)
    assert scene.particle_count == 0
    assert scene.add_particles(np.eye(3)).triangles is None


def test_a_fluid_is_drawn_as_its_surface(tmp_path, device):
    sim = ps.Simulation(pool(), ps.Settings(dt=0.01, substeps=2), device=device, worlds=2)
    record(sim, tmp_path / "out.usda", 1, surface={"spacing": 0.2})
    stage = opened(tmp_path / "out.usda")
    assert names(stage, "Points") == ["env_0000/duck", "env_0001/duck"]
    assert names(stage, "Mesh") == ["env_0000/water", "env_0001/water"]
    for frame in (0, 1):
        mesh = UsdGeom.Mesh(stage.GetPrimAtPath("/World/env_0001/water"))
        points = np.array(mesh.GetPointsAttr().Get(frame), dtype=float)
        a, b, c = points[np.array(mesh.GetFaceVertexIndicesAttr().Get(frame)).reshape(-1, 3).T]
        volume = np.sum(a * np.cross(b, c)) / 6
        # A unit cube whose corners and edges are rounded over about a particle spacing, 0.2:
        # at most 12 edges of (1 - pi/4) 0.2^2 each.
        assert 1 - 12 * (1 - np.pi / 4) * 0.2**2 < volume < 1.1


# What moves or breaks ---------------------------------------------------------------------------


def test_broken_links_are_not_drawn(tmp_path, device):
    # Two weights on threads: one holds, one does not.
    scene = ps.Scene()
    ends = scene.add_particles(
        [(0, 1, 0), (0, 0, 0), (1, 1, 0), (1, 0, 0)], mass=[1, 1, 1, 9],
        pinned=[True, False, True, False],
    )  # fmt: skip
    scene.add_interaction(ps.UniformGravity((0, -10, 0)))
    scene.add_constraint(ps.Distance(ends.indices.reshape(2, 2), break_force=30.0))
    sim = ps.Simulation(scene, ps.Settings(dt=1 / 32, substeps=4), device=device, worlds=2)
    states, _ = record(sim, tmp_path / "out.usda", 4)
    assert sim.constraints[0].broken.tolist() == [False, True] * 2
    stage = opened(tmp_path / "out.usda")
    for w in (0, 1):
        thread = f"/World/env_000{w}/Distance"
        counts = [len(value(stage, f"{thread}.curveVertexCounts", f)) for f in range(5)]
        assert counts == [2, 1, 1, 1, 1]
        np.testing.assert_array_equal(
            value(stage, f"{thread}.points", 4), states[4, 4 * w : 4 * w + 2]
        )


def test_boundaries_that_move_have_their_transforms(tmp_path, device):
    scene = flying()
    scene.add_constraint(ps.PlaneBoundary((0, -50, 0), (0, 1, 0), velocity=(0, 0.5, 0)))
    turning = {"angular_velocity": (0, 0, 16 * np.pi)}  # a quarter a frame
    scene.add_constraint(ps.BoxBoundary((-90, -90, -90), (90, 90, 90), **turning))
    scene.add_constraint(ps.PlaneBoundary((0, -60, 0), (0, 1, 0)))
    sim = ps.Simulation(scene, SETTINGS, device=device, worlds=2)
    with ps.UsdRecorder(sim, tmp_path / "out.usda", frames=3) as out:
        for frame in range(4):
            if frame == 2:
                sim.reset([1])  # its clock starts again, the file's does not
            out.write()
            sim.step()
    stage = opened(tmp_path / "out.usda")
    cache = UsdGeom.XformCache()
    for w, times in enumerate([(0, 1, 2, 3), (0, 1, 0, 1)]):
        room = f"/World/env_000{w}/boundaries"
        for code, time in enumerate(times):
            cache.SetTime(code)
            plane, box, still = (
                np.array(cache.GetLocalToWorldTransform(stage.GetPrimAtPath(f"{room}/{name}")))
                for name in ("PlaneBoundary", "BoxBoundary", "PlaneBoundary_2")
            )
            np.testing.assert_allclose(plane[3, :3], (0, 0.5 * time / 32, 0), atol=1e-12)
            turned = np.linalg.matrix_power([[0, -1, 0], [1, 0, 0], [0, 0, 1]], time)
            np.testing.assert_allclose(box[:3, :3].T, turned, atol=1e-9)
            np.testing.assert_array_equal(still, np.eye(4))


# What is refused --------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("options", "match"),
    [
        ({"worlds": [2]}, r"worlds must be some of 0 to 1, got \[2\]"),
        ({"worlds": []}, "worlds must be some of"),
        ({"groups": ["c"]}, "groups must be one of a, b, got 'c'"),
        ({"layout": "circle"}, "layout must be one of grid"),
        ({"layout": (1, 2)}, r"layout must have shape \(3,\)"),
        ({"every": 0}, "every must be a whole number of at least 1"),
        ({"color_by": "heat"}, "field must be one of .*charge"),
        ({"color_by": "speed", "color_map": "jet"}, "color_map must be one of viridis"),
        ({"color_by": "speed", "color_range": 3}, r"color_range must be \(lower, upper\)"),
        ({"color_by": "speed", "color_range": (3, 3)}, "color_range upper must be above 3"),
        ({"fields": ["density"]}, "field must be one of"),
        ({"fields": ["velocity"]}, "fields must have another name"),
        ({"surface": True}, "surface must be False in a scene without SPH"),
        ({"groups": []}, "points must hold a group, or meshes a surface"),
    ],
)
def test_choices_that_make_no_sense_are_refused(tmp_path, refused, options, match):
    sim = ps.Simulation(flying(), SETTINGS, device="cpu", worlds=2)
    with refused(match):
        ps.UsdRecorder(sim, tmp_path / "out.usda", **options)
    assert list(tmp_path.iterdir()) == []
