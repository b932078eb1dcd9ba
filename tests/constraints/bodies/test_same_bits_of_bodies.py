"""Bodies go bit for bit alike: in a batch or alone, on any number of threads, after a restart."""

import numpy as np
import pytest

import particlesim as ps
from cases.worlds import equal_alone, goes_on_after_reset_and_save, same


def falling(tilt):
    """A rope that bends, a cloth that tears and a rigid body, which fall onto each other."""
    scene = ps.Scene()
    scene.add_interaction(ps.UniformGravity((0, -9.81, 0)))
    sheet, triangles = ps.sample.rectangle((-0.5, 0.3, -0.5), [(0, 0, 1), (1, 0, 0)], cells=8)
    scene.add_cloth(
        sheet, triangles, areal_density=0.2, stiffness=500.0, radius=0.05, break_force=3.0,
        bending_stiffness=1e-3, self_collision=True,
        pinned=np.abs(sheet[:, 0]) > 0.49,
    )  # fmt: skip
    line = ps.sample.curve([(-0.4, 0.5, 0), (0.4, 0.5 + tilt, 0.1)], 0.1)
    scene.add_rope(line, linear_density=0.1, bending_stiffness=0.02, radius=0.04)
    ball = ps.sample.sphere((0, 0.9, tilt), 0.2, 0.1)
    scene.add_rigid_body(ball, spacing=0.1, density=700.0, angular_velocity=(1, 2, 0))
    scene.add_constraint(ps.Contact(friction=0.3))
    scene.add_constraint(ps.PlaneBoundary((0, -0.5, 0), (0, 1, 0), friction=0.3))
    return scene


def simulate(scenes, device, **knobs):
    return ps.Simulation(scenes, ps.Settings(dt=1 / 60, substeps=5, **knobs), device=device)


@pytest.mark.slow
def test_worlds_threads_and_restarts(device, tmp_path):
    scenes = [falling(tilt) for tilt in (0.05, 0.1)]
    graph = equal_alone(simulate, scenes, device, 30, execution="graph")
    assert graph.constraints[0].broken.any()
    goes_on_after_reset_and_save(simulate, scenes, device, tmp_path / "run.npz")
    for threads in (1, 2):
        shared = simulate(scenes, device, execution="threads", threads=threads)
        shared.run(30)
        same(shared, graph)
