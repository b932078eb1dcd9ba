"""A block held together by distance constraints bounces on the ground."""

import particlesim as ps

frames = 180
settings = ps.Settings(dt=1 / 60, substeps=20, iterations=4)


def build(
    size: int = 5,
    spacing: float = 0.1,
    height: float = 0.8,
    restitution: float = 0.7,
    compliance: float = 1e-6,
    tilt: float = 0.4,
) -> ps.Scene:
    """A cube of size^3 particles, each kept at its distance from its 26 nearest.

    Args:
        size: Particles along an edge.
        spacing: Between neighbours [m].
        height: Of the lowest corner above the ground [m].
        restitution: Of the ground.
        compliance: Of the constraints [m/N].
        tilt: Turn about z and x [rad].
    """
    side = size * spacing / 2
    cube = ps.sample.box((-side,) * 3, (side,) * 3, spacing)
    x = ps.sample.rotate(ps.sample.rotate(cube, (0, 0, 1), tilt), (1, 0, 0), tilt)
    pairs = ps.sample.links(x, 1.8 * spacing)
    x[:, 1] += height - x[:, 1].min()
    scene = ps.Scene()
    block = scene.add_particles(x, mass=0.02, radius=spacing / 2, group="block")
    scene.add_interaction(ps.UniformGravity((0, -9.81, 0)))
    scene.add_constraint(ps.Distance(block[pairs], compliance=compliance))
    scene.add_constraint(
        ps.PlaneBoundary((0, 0, 0), (0, 1, 0), friction=0.3, restitution=restitution)
    )
    return scene
