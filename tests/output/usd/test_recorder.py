"""Recordings of simulations: what of them is drawn."""

import numpy as np
import pytest
from pxr import Usd, UsdGeom

import particlesim as ps


def bouncing(**options):
    scene = ps.Scene(**options)
    balls = scene.add_particles(
        [(0, 1, 0), (1, 1, 0), (2, 1, 0)], radius=[0.1, 0.2, 0.3], group="balls"
    )
    scene.add_particles([(5, 5, 5)], group="dust")
    scene.add_interaction(ps.UniformGravity())
    scene.add_interaction(ps.Springs([(balls[0], balls[1])], 10.0))
    scene.add_constraint(ps.PlaneBoundary((0, 0, 0), (0, 1, 0)))
    scene.add_constraint(ps.BoxBoundary((-9, 0, -9), (9, np.inf, 9)))
    return scene


def opened(path):
    return Usd.Stage.Open(str(path))


def test_frames_are_the_states_of_the_run(tmp_path, device):
    path = tmp_path / "out.usda"
    sim = ps.Simulation(bouncing(), ps.Settings(dt=1 / 60, substeps=2), device=device)
    states = [sim.position]
    with ps.UsdRecorder(sim, path, frames=4) as out:
        out.write()
        for _ in range(4):
            sim.step()
            states.append(sim.position)
            out.write()
    stage = opened(path)
    points = UsdGeom.Points(stage.GetPrimAtPath("/World/env_0000/balls"))
    for frame, state in enumerate(states):
        np.testing.assert_array_equal(points.GetPointsAttr().Get(frame), state[:3])
    assert stage.GetStartTimeCode() == 0 and stage.GetEndTimeCode() == 4
    assert stage.GetTimeCodesPerSecond() == stage.GetFramesPerSecond() == 60
    np.testing.assert_allclose(points.GetWidthsAttr().Get(), [0.2, 0.4, 0.6], rtol=1e-6)


def test_velocity_leads_to_the_next_frame(tmp_path, device):
    # Without forces x(next) = x + v dt exactly, whatever the playback rate.
    for dt in (1 / 60, 0.005, 1e-9):
        scene = ps.Scene()
        scene.add_particles([(0, 0, 0)], velocity=(3, 2, 1), group="one")
        sim = ps.Simulation(scene, ps.Settings(dt=dt, substeps=1), device=device)
        path = tmp_path / f"{dt}.usda"
        sim.run(1, record=path)
        stage = opened(path)
        points = UsdGeom.Points(stage.GetPrimAtPath("/World/env_0000/one"))
        fps = stage.GetTimeCodesPerSecond()
        moved = np.array(points.GetVelocitiesAttr().Get(0)) / fps
        np.testing.assert_allclose(moved, np.array(points.GetPointsAttr().Get(1)), rtol=1e-5)


def test_worlds_links_and_boundaries_are_drawn(tmp_path, device):
    path = tmp_path / "out.usda"
    sim = ps.Simulation(bouncing(), ps.Settings(dt=1 / 60), device=device, worlds=2)
    sim.run(2, record=path)
    stage = opened(path)
    kinds = [prim.GetTypeName() for prim in stage.Traverse()]
    assert kinds.count("Points") == 4
    assert kinds.count("BasisCurves") >= 2  # a spring in each world, and outlines of the boxes
    assert stage.GetPrimAtPath("/World/env_0001/dust")


def test_periodic_boxes_and_fields(tmp_path, device):
    scene = ps.Scene(periodic=((0, None, 0), (4, None, 4)))
    rng = np.random.default_rng(0)
    scene.add_particles(rng.uniform(0, 4, (50, 3)), mass=0.1, group="water")
    scene.add_interaction(
        ps.SPH(smoothing_length=0.5, rest_density=1.0, equation_of_state=ps.Tait(5.0))
    )
    path = tmp_path / "out.usda"
    sim = ps.Simulation(scene, ps.Settings(dt=0.001, substeps=1), device=device)
    sim.run(1, record=path, fields=["density"])
    stage = opened(path)
    prim = stage.GetPrimAtPath("/World/env_0000/water")
    density = UsdGeom.PrimvarsAPI(prim).GetPrimvar("density").Get(1)
    np.testing.assert_allclose(density, sim.get("density"), rtol=1e-6)


@pytest.mark.parametrize(
    ("options", "error", "match"),
    [
        ({"fields": ["colour"]}, (AttributeError, ValueError), "colour"),
        ({"record": "nowhere/out.usda"}, FileNotFoundError, "existing folder"),
        ({"record": "out.abc"}, ValueError, "usda"),
    ],
)
def test_bad_recordings_are_refused_before_anything_moves(tmp_path, options, error, match):
    sim = ps.Simulation(bouncing(), device="cpu")
    record = tmp_path / options.pop("record", "out.usda")
    with pytest.raises(error, match=match):
        sim.run(2, record=record, **options)
    assert sim.frame == 0


def test_an_existing_output_is_kept(tmp_path):
    path = tmp_path / "out.usda"
    sim = ps.Simulation(bouncing(), device="cpu")
    sim.run(1, record=path)
    with pytest.raises(FileExistsError, match="overwrite=True"):
        sim.run(1, record=path)
    sim.run(1, record=path, overwrite=True)
    assert opened(path).GetStartTimeCode() == 1
