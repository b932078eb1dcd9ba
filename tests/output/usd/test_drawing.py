"""What recordings draw of simulations, and how: filters, layouts and colours."""

import numpy as np
import pytest
import warp as wp
from pxr import Sdf, UsdGeom

import particlesim as ps
from particlesim.output.colors import colored

from .drawn import SETTINGS, flying, names, pool, record
from .recordings import checked, value

# Which ------------------------------------------------------------------------------------------


def test_worlds_and_groups_are_chosen(tmp_path, device):
    sim = ps.Simulation(flying(), SETTINGS, device=device, worlds=4)
    position, _ = record(sim, tmp_path / "out.usda", 1, worlds=[3, 1], groups=["b"])
    stage = checked(tmp_path / "out.usda")
    assert names(stage, "Points") == ["env_0001/b", "env_0003/b"]
    for w in (1, 3):
        found = value(stage, f"/World/env_000{w}/b.points", 1)
        np.testing.assert_array_equal(found, position[1, 8 * w + 4 : 8 * w + 8])


def test_links_need_both_ends(tmp_path, device):
    scene = flying()
    scene.add_interaction(ps.Springs([(0, 1), (3, 4), (4, 5)], 0.0))
    sim = ps.Simulation(scene, SETTINGS, device=device)
    record(sim, tmp_path / "out.usda", 0, groups=scene["b"])
    stage = checked(tmp_path / "out.usda")
    ends = value(stage, "/World/env_0000/Springs.points", 0)
    np.testing.assert_array_equal(ends, scene.position[[4, 5]])


def test_every_kth_frame_counts_one_by_one(tmp_path, device):
    # Free flight: x(next) = x + v dt exactly, also from each recorded frame to the next.
    sim = ps.Simulation(flying(), SETTINGS, device=device)
    sim.run(1)  # a start that is not recorded itself
    position, _ = record(sim, tmp_path / "out.usda", 9, every=3)
    stage = checked(tmp_path / "out.usda")
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
    stage = checked(tmp_path / "out.usda")
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
    stage = checked(tmp_path / "out.usda")
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
    stage = checked(tmp_path / "out.usda")
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
    stage = checked(tmp_path / "out.usda")
    prim = "/World/env_0000/b.primvars:"
    np.testing.assert_array_equal(value(stage, f"{prim}charge", 2), 10 + np.arange(4))
    np.testing.assert_array_equal(value(stage, f"{prim}mass", 2), 1)
    np.testing.assert_array_equal(value(stage, f"{prim}force", 2), np.tile((1, 0, 2), (4, 1)))
    expected = np.linalg.norm(velocity[2, 4:], axis=1)  # not scaled to playback
    np.testing.assert_allclose(value(stage, f"{prim}speed", 2), expected, rtol=1e-6)


def test_densities_are_there_at_the_start_and_change_nothing(tmp_path, device):
    settings = ps.Settings(dt=0.01, substeps=2)
    sims = [ps.Simulation(pool(), settings, device=device) for _ in range(3)]
    record(sims[0], tmp_path / "out.usda", 3, fields=["density"], color_by="pressure")
    for _ in range(3):
        sims[1].step()
    np.testing.assert_array_equal(sims[0].position, sims[1].position)
    sims[2].forces(0.005)
    stage = checked(tmp_path / "out.usda")
    start = value(stage, "/World/env_0000/water.primvars:density", 0)
    np.testing.assert_array_equal(start, sims[2].get("density")[:-1].astype(np.float32))
    assert (start > 0).all()


def test_colors_follow_a_value_through_a_map(tmp_path, device):
    sim = ps.Simulation(flying(), SETTINGS, device=device, worlds=2)
    ramp = [(0, 0, 0), (1, 0.5, 0)]
    options = {"color_by": "velocity", "color_map": ramp, "color_range": (1, 14)}
    _, velocity = record(sim, tmp_path / "out.usda", 1, **options)
    stage = checked(tmp_path / "out.usda")
    found = value(stage, "/World/env_0001/b.primvars:displayColor", 1)
    share = (np.linalg.norm(velocity[1, 12:], axis=1) - 1) / 13
    # A map has 256 steps: half of one off at most.
    np.testing.assert_allclose(found, share[:, None] * ramp[1], atol=0.5 / 255 + 1e-6)


def test_the_range_of_colors_is_that_of_the_frames_so_far(tmp_path, device):
    scene = flying()
    scene.add_interaction(ps.ParticleForce(push))
    sim = ps.Simulation(scene, SETTINGS, device=device)
    sim.velocity = 0.0  # nothing differs at the start
    _, velocity = record(sim, tmp_path / "out.usda", 3, color_by="speed", groups=["b"])
    stage = checked(tmp_path / "out.usda")
    speed = np.linalg.norm(velocity, axis=-1)[:, 4:]
    assert not speed[0].any() and speed[3].max() > speed[1].max()
    for frame in range(4):
        spans = (
            np.quantile(speed[1 : frame + 1], (0.01, 0.99), axis=1) if frame else np.zeros((2, 1))
        )
        lower, upper = spans[0].min(), spans[1].max()
        found = value(stage, "/World/env_0000/b.primvars:displayColor", frame)
        np.testing.assert_array_equal(found, colored(speed[frame], "viridis", lower, upper))
    clip = Sdf.Layer.FindOrOpen(str(tmp_path / "out.clips/f.000003.usdc"))
    notes = clip.customLayerData["particlesim"]
    assert (notes["colorLower"], notes["colorUpper"]) == (lower, upper)


def test_what_starts_from_rest_is_not_of_one_colour(tmp_path, device):
    rng = np.random.default_rng(0)
    scene = ps.Scene()
    scene.add_particles(
        rng.uniform(0, 1, (2000, 3)), radius=0.01, group="dust", pace=rng.uniform(0, 1, 2000)
    )

    @ps.law
    def hasten(pace: float):
        return wp.vec3(pace, 0.0, 0.0)

    scene.add_interaction(ps.ParticleForce(hasten))
    sim = ps.Simulation(scene, SETTINGS, device=device)
    record(sim, tmp_path / "out.usda", 20, color_by="speed")
    stage = checked(tmp_path / "out.usda")
    last = colored([1.0], "viridis", 0.0, 1.0)
    for frame in (1, 2, 10, 20):
        found = value(stage, "/World/env_0000/dust.primvars:displayColor", frame)
        # 1 % are beyond the range, and half of the last of 256 steps.
        assert np.mean((found == last).all(axis=1)) < 0.02
        assert len(np.unique(found, axis=0)) > 200


def test_a_resumed_recording_keeps_its_range_of_colors(tmp_path, device):
    path = tmp_path / "out.usda"
    sim = ps.Simulation(flying(), SETTINGS, device=device)
    with ps.UsdRecorder(sim, path, color_by="speed") as out:
        out.write()
    sim.step()
    sim.velocity = 2 * sim.velocity  # a range of its own would be from 2
    with ps.UsdRecorder(sim, path, color_by="speed", resume=0) as out:
        out.write()
    stage = checked(path)
    speed = np.linalg.norm(sim.velocity, axis=1)
    found = value(stage, "/World/env_0000/a.primvars:displayColor", 1)
    lower, upper = np.quantile(speed / 2, 0.01), np.quantile(speed, 0.99)
    np.testing.assert_array_equal(found, colored(speed[:4], "viridis", lower, upper))
