"""Short runs, how they are ended, and what their recordings hold."""

import numpy as np
from pxr import Sdf

import particlesim as ps

FORMATS = [".usda", ".usdc", ".npz", ".ply", ".gsd", ".vtkhdf"]


NEEDS = {".gsd": "gsd", ".vtkhdf": "h5py"}


def small(speed=1.0, **options):
    """Two bouncing balls on a spring: no two frames are the same."""
    scene = ps.Scene(**options)
    scene.add_particles([(0, 1, 0), (1, 1, 0)], velocity=(speed, 0, 0), radius=0.1, group="balls")
    scene.add_interaction(ps.UniformGravity())
    scene.add_interaction(ps.Springs([(0, 1)], stiffness=50.0, rest_length=0.9))
    scene.add_constraint(ps.PlaneBoundary((0, 0, 0), (0, 1, 0), restitution=0.9))
    return scene


def sim(speed=1.0, substeps=4):
    return ps.Simulation(small(speed), ps.Settings(dt=1 / 30, substeps=substeps), device="cpu")


class Ended(Exception):
    """What ends a run in these tests where nothing has to be killed."""


def end_at(frame):
    def progress(done, frames):
        if done == frame:
            raise Ended

    return progress


def frames_of(path):
    """What a recording holds, by the names of its files or frames, as bytes."""
    if path.suffix == ".gsd":
        import gsd.hoomd

        with gsd.hoomd.open(str(path)) as file:
            return {
                str(frame.configuration.step): b"".join(
                    np.ascontiguousarray(each).tobytes()
                    for each in (
                        frame.particles.position, frame.particles.velocity,
                        frame.particles.typeid, *(frame.log[name] for name in sorted(frame.log)),
                    )
                )
                for frame in file
            }  # fmt: skip
    folder = path.with_suffix(".clips" if path.suffix.startswith(".usd") else ".frames")
    return {each.name: each.read_bytes() for each in folder.glob("f.*") if ".tmp" not in each.name}


def assert_same_root(ours, theirs):
    """The file that leads to the frames says the same in two recordings of one name."""
    if ours.suffix.startswith(".usd"):
        texts = [Sdf.Layer.OpenAsAnonymous(str(path)).ExportToString() for path in (ours, theirs)]
        assert texts[0] == texts[1]
    elif ours.suffix == ".npz":
        assert ours.read_bytes() == theirs.read_bytes()
    elif ours.suffix == ".vtkhdf":
        import h5py

        with h5py.File(ours) as a, h5py.File(theirs) as b:
            for name in ("VTKHDF/Points", "VTKHDF/PointData/velocity", "VTKHDF/Steps/Values"):
                np.testing.assert_array_equal(a[name], b[name])
