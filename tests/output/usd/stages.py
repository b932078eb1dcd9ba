"""A good recording of beads, and stages made by hand."""

import numpy as np
from pxr import UsdGeom, Vt

import particlesim as ps

FRAMES, COUNT = 5, 12  # the start state is one frame more


PLANT = 3  # the frame in which faults are planted


def build(offset: float) -> ps.Scene:
    """A rope of beads in a box."""
    scene = ps.Scene()
    points = np.random.default_rng(0).uniform((0, 0.2, 0), (1, 1.2, 1), (COUNT, 3))
    points[:, 1] += offset
    beads = scene.add_particles(
        points, velocity=(1, 0, 0), radius=np.linspace(0.02, 0.05, COUNT), group="beads"
    )
    pairs = np.stack([beads.indices[:-1], beads.indices[1:]], axis=1)
    scene.add_interaction(ps.Springs(pairs, stiffness=10.0))
    scene.add_interaction(ps.UniformGravity((0, -9.81, 0)))
    scene.add_constraint(ps.BoxBoundary((-5, 0, -5), (5, 5, 5)))
    return scene


def vectors(array: np.ndarray) -> Vt.Vec3fArray:
    return Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(array, dtype=np.float32))


def surface(stage) -> UsdGeom.Mesh:
    """A fan of 2, 3 and 4 triangles in the three frames."""
    mesh = UsdGeom.Mesh.Define(stage, "/World/surface")
    for frame in range(3):
        count = frame + 2
        angle = np.linspace(0, np.pi, count + 1)
        ring = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
        points = vectors(np.concatenate([[[0, 0, 0]], ring]))
        mesh.GetPointsAttr().Set(points, frame)
        mesh.GetNormalsAttr().Set(vectors(np.tile([0, 0, 1.0], (count + 2, 1))), frame)
        mesh.GetFaceVertexCountsAttr().Set([3] * count, frame)
        faces = [(0, k + 1, k + 2) for k in range(count)]
        mesh.GetFaceVertexIndicesAttr().Set(np.ravel(faces).tolist(), frame)
        mesh.GetExtentAttr().Set(UsdGeom.PointBased.ComputeExtent(points), frame)
    return mesh


def spheres(stage) -> UsdGeom.PointInstancer:
    """One, two and three instances in the three frames."""
    instancer = UsdGeom.PointInstancer.Define(stage, "/World/drops")
    ball = UsdGeom.Sphere.Define(stage, "/World/drops/ball")
    ball.GetRadiusAttr().Set(0.5)
    ball.GetExtentAttr().Set(vectors([[-0.5] * 3, [0.5] * 3]))
    instancer.GetPrototypesRel().SetTargets([ball.GetPath()])
    for frame in range(3):
        count = frame + 1
        instancer.GetPositionsAttr().Set(vectors(np.eye(3)[:count]), frame)
        instancer.GetProtoIndicesAttr().Set([0] * count, frame)
        instancer.GetExtentAttr().Set(instancer.ComputeExtentAtTime(frame, frame), frame)
    return instancer
