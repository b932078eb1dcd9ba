"""Scenes whose simulations launch every kernel, at least in one variant."""

import numpy as np
import warp as wp

import particlesim as ps
from particlesim.commands.scene_files import load_scene, ready_scenes


@ps.law
def screened(r: float, charge_i: float, charge_j: float, screening: float, power: int):
    return charge_i * charge_j * wp.exp(-r / screening) * wp.pow(r, float(power))


@ps.law
def repel(r: float, mass_j: float, radius_i: float, spin_j: wp.vec3):
    return mass_j * radius_i * spin_j[0] / r


@ps.law
def swing(position: wp.vec3, velocity: wp.vec3, time: float, axis: wp.vec3):
    return wp.cross(axis, velocity) - wp.sin(time) * position


@ps.law
def swing_energy(position: wp.vec3):
    return 0.5 * wp.dot(position, position)


@ps.law
def morse(distance_squared: float, charge_i: float, depth: float):
    x = 1.0 - wp.exp(1.0 - distance_squared)
    return charge_i * depth * x * x


@ps.law
def wave(cosine: float, depth: float):
    return depth * cosine * cosine


@ps.law
def torsion(dihedral: float, multiplicity: int):
    return wp.cos(float(multiplicity) * dihedral)


@ps.law
def bell(q: float):
    s = wp.max(1.0 - 0.5 * q, 0.0)
    return s * s * s * s * (1.0 + 2.0 * q)


class Bell(ps.SmoothingFunction):
    weight = bell


@ps.law
def flat(a: wp.vec3, b: wp.vec3, c: wp.vec3, area: float):
    return 0.5 * wp.length(wp.cross(b - a, c - a)) - area


def particles(count=600, periodic=None, **attributes):
    scene = ps.Scene(periodic=periodic)
    x = np.random.default_rng(0).uniform(0, 10, (count, 3))
    scene.add_particles(x, radius=0.1, charge=1.0, spin=[(0, 0, 1)] * len(x), **attributes)
    return scene


def forces():
    scene = particles()
    some = range(0, 600, 2)
    scene.add_interaction(ps.LennardJones())
    scene.add_interaction(ps.LennardJones(some, cutoff=2.5))
    scene.add_interaction(ps.PairPotential(screened, cutoff=2.4, screening=1.0, power=2))
    scene.add_interaction(ps.PairForce(repel, cutoff=1.0))
    scene.add_interaction(ps.PairPotential(screened, cutoff=None, screening=1.0, power=-1))
    scene.add_interaction(ps.Gravity(some))
    scene.add_interaction(ps.Springs([(0, 1)], 1.0, 1.0))
    scene.add_interaction(ps.Bonds([(0, 1)], morse, depth=1.0))
    scene.add_interaction(ps.FENEBonds([(0, 1)], 1.0, 100.0))
    scene.add_interaction(ps.Angles([(0, 1, 2)], wave, depth=1.0))
    scene.add_interaction(ps.HarmonicAngles([(0, 1, 2)], 1.0, 1.0))
    scene.add_interaction(ps.Dihedrals([(0, 1, 2, 3)], torsion, multiplicity=3))
    scene.add_interaction(ps.UniformGravity())
    scene.add_interaction(ps.Drag(1.0))
    scene.add_interaction(ps.ConstantForce((0, 1, 0)))
    scene.add_interaction(ps.ParticleForce(swing, potential=swing_energy, axis=(0, 0, 1)))
    scene.add_thermostat(ps.Langevin(temperature=1.0, friction=1.0))
    scene.add_thermostat(ps.VelocityRescaling(temperature=1.0, relaxation_time=1.0))
    return scene


def few_forces(periodic, count, pressed=False):
    scene = particles(count, periodic)
    scene.add_interaction(ps.PairPotential(screened, cutoff=2.4, screening=1.0, power=2))
    scene.add_interaction(ps.Springs([(0, 1)], 1.0, 1.0))
    if pressed:
        given = {"compressibility": 1.0, "relaxation_time": 1.0, "temperature": 1.0}
        scene.add_barostat(ps.CellRescaling(pressure=1.0, **given))
    return scene


def charged():
    """Kinds, pairs that are left out, Ewald sums, by a mesh and softened, and fields."""
    scene = particles(periodic=BOX)
    more = scene.add_particles([(1, 1, 1)], group="more")
    kinds = [scene.groups[0], more]
    pairs = ps.LennardJones(kinds, sigma=[1.0, 0.8], truncation="xplor", exclude=[(0, 1)])
    scene.add_interaction(pairs)
    scene.add_interaction(ps.Electrostatics("particle_mesh_ewald", tolerance=1e-2))
    scene.add_interaction(ps.Gravity(softening=0.1, method="ewald", tolerance=1e-2))
    scene.add_interaction(ps.FieldForce(ps.GridField(*BOX, 1.0, speed=1.0)))
    scene.add_interaction(ps.FieldForce(ps.PoissonField(*BOX, 1.0), coupling="charge"))
    return scene


def damped():
    scene = particles()
    scene.add_interaction(ps.Springs([(0, 1)], 1.0, 1.0, damping=1.0))
    scene.add_interaction(ps.Drag(1.0))
    scene.add_interaction(ps.ElasticSolid(None, 1.0, 0.3, smoothing_length=2.0, dissipation=1.0))
    return scene


def fluid(periodic, walls=(), **options):
    scene = particles(periodic=periodic, internal_energy=1.0)
    scene.add_interaction(
        ps.SPH(**{"smoothing_length": 1.0, "rest_density": 1.0, "equation_of_state": ps.Tait(10.0),
                  **options})
    )  # fmt: skip
    for wall in walls:
        scene.add_constraint(wall)
    return scene


def heated(walls=(), **options):
    thick = ps.ArtificialViscosity(1.0)
    return fluid(None, walls, equation_of_state=ps.IdealGas(1.4), viscosity=thick, **options)


def kinds():
    """One constraint of each kind on tuples."""
    scene = particles()
    soft, four = {"compliance": 0.1}, [(9, 10, 11, 12)]
    for part in (
        ps.Bending(four, 0.1, **soft),
        ps.IsometricBending(four, **soft),
        ps.Angle([(9, 10, 11)], 1.0, **soft),
        ps.Area([(9, 10, 11)], 1.0, **soft),
        ps.Volume(four, 1.0, **soft),
        ps.NeoHookean(four, 1.0, 0.3),
        ps.Attachment([13], [(0, 0, 0), (1, 0, 0)], times=[0.0, 1.0], **soft),
    ):
        scene.add_constraint(part)
    return scene


def constrained(periodic, *, breaks, bounces):
    scene = particles(periodic=periodic)
    limit = {"break_force": 1.0} if breaks else {}
    triangle = ps.Constraint(flat, [(3, 4, 5)], area=1.0, inequality=True, **limit)
    wire = {"compliance": 1e-6, "damping": 0.1, "yield_strain": 0.1}
    edges = scene.add_constraint(ps.Distance([(0, 1), (1, 2)], 1.0, **wire, **limit))
    scene.add_constraint(triangle)
    if breaks:
        scene.add_constraint(ps.Bending([(0, 1, 2, 3)], 0.1, edges=edges))
    if not breaks:
        scene.add_interaction(ps.Constraint(flat, [(6, 7, 8)], area=1.0, compliance=1e-3)
                              .as_force())  # fmt: skip
    touch = {"friction": 0.1, "restitution": 0.5} if bounces else {}
    scene.add_constraint(ps.Contact(**touch))
    if periodic is None:
        scene.add_interaction(ps.DFSPH(smoothing_length=1.0, rest_density=1.0))
        scene.add_constraint(ps.PlaneBoundary((0, -9, 0), (0, 1, 0), **touch))
        scene.add_constraint(ps.BoxBoundary((-9, -9, -9), (20, 20, 20), **touch))
        sheet = [(0, -9, 0), (9, -9, 0), (0, -9, 9)], [(0, 1, 2)]
        scene.add_constraint(
            ps.MeshBoundary(*sheet, sheet=True, thickness=0.1, motion=KEYS, **touch)
        )
    return scene


def held():
    """Inside of boundaries of every further shape."""
    scene = particles()
    touch = {"friction": 0.1, "restitution": 0.5}
    walls = [
        ps.CapsuleBoundary((0, -50, 0), (0, -50, 5), 30.0, **touch),
        ps.CylinderBoundary((0, 0, 0), (0, 0, 30), 60.0, True, motion=KEYS, **touch),
        ps.SphereBoundary((0, 0, 0), 60.0, velocity=(1, 0, 0), **touch),
        ps.SDFBoundary(np.ones((3, 3, 3)), (0, 0, 0), 5.0, **touch),
        ps.HeightfieldBoundary(np.zeros((3, 3)), (0, -20, 0), 5.0, **touch),
        ps.SphereBoundary((0, 0, 0), 90.0, **touch) - ps.PlaneBoundary((0, -40, 0), (0, 1, 0)),
    ]  # fmt: skip
    for wall in walls:
        scene.add_constraint(wall)
    return scene


def clustered():
    """A small cluster, and one of several chunks; all that they can do."""
    scene = particles()
    scene.add_constraint(
        ps.ShapeMatching([range(8), range(6, 600)], [0.0, 1.0], yield_strain=0.1, break_force=1.0)
    )
    scene.add_constraint(ps.Hinge(range(8), range(8, 16), (0, 0, 0), (0, 0, 1), break_force=1.0))
    scene.add_constraint(ps.Attachment([0], [[(0, 0, 0)], [(0, 1, 0)]], times=[0.0, 1.0]))
    tetrahedron = [(0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3)]
    scene.add_constraint(ps.MeshVolume(tetrahedron, rest_volume=1.0, burst_pressure=1.0))
    return scene


def attracted(s, **attributes):
    scene = particles(**attributes)
    scene.add_interaction(ps.Gravity(softening=s))
    return scene


def dense(*walls, **options):
    scene = particles(**options)
    scene.add_constraint(ps.FluidDensity(rest_density=0.5, smoothing_length=1.0))
    for wall in walls:
        scene.add_constraint(wall)
    return scene


KEYS = ps.Keyframes([0.0, 1.0], [(0, 0, 0), (0, 0.1, 0)])
BELT = ps.PlaneBoundary((0, -9, 0), (0, 1, 0), velocity=(1, 0, 0), slip=False)
BOX, XSPH, VERLET = ((0, 0, 0), (10, 10, 10)), ps.XSPH(), {"integrator": "velocity_verlet"}
SCENES = {
    "gas": (lambda: particles(), {}),
    "uncompensated_gas": (lambda: particles(), {"compensated": False}),
    "forces": (forces, {"ledger": True}),
    "charged": (charged, {}),
    "damped": (damped, VERLET),
    "periodic_forces": (lambda: few_forces(BOX, 600, True), VERLET | {"compensated": False}),
    "small_periodic_world": (lambda: few_forces(BOX, 20), {}),
    "fluid": (
        lambda: fluid(
            None, [BELT], smoothing=Bell(),
            viscosity=[ps.ArtificialViscosity(0.1, balsara=True), ps.LaminarViscosity(0.1), XSPH],
        ),
        {"most_substeps": 64},
    ),
    "periodic_fluid": (
        lambda: fluid(BOX, smoothing="cubic_spline", equation_of_state=ps.Polytrope(1.0, 1.5),
                      viscosity=[ps.ArtificialViscosity(0.1), ps.ParticleShifting(1.0)]), {}
    ),
    "continuity": (lambda: fluid(None, density=ps.ContinuityDensity()), VERLET),
    "continuity_beside_walls": (lambda: fluid(None, [BELT], density=ps.ContinuityDensity()), {}),
    "heated_fluid": (heated, {}),
    "heated_beside_walls": (lambda: heated([BELT]), VERLET),
    "gas_dynamics": (lambda: heated(smoothing_length=ps.AdaptiveSmoothing()), VERLET),
    "constraints": (lambda: constrained(None, breaks=False, bounces=True), {"ledger": True}),
    "boundaries": (held, {}),
    "breaking": (
        lambda: constrained(BOX, breaks=True, bounces=False),
        {"compensated": False, "solver": "jacobi", "acceleration": 0.5,
         "constraint_tolerance": 1e-3, **VERLET},
    ),
    "clusters": (clustered, {"compensated": False}),
    "kinds": (lambda: kinds(), {}),
    "density": (lambda: dense(BELT), {}),
    "periodic_density": (lambda: dense(periodic=BOX), {"compensated": False}),
    "tree": (lambda: attracted(0.1), {"opening_angle": 0.5}),
    "own_softening": (lambda: attracted(None, softening=0.1), {"opening_angle": 0.5}),
    **{name: (lambda name=name: load_scene(name).build(), {}) for name in ready_scenes()},
}  # fmt: skip

EVERY_KERNEL = (
    "forces", "charged", "damped", "periodic_forces", "fluid", "constraints", "breaking",
    "gas_dynamics", "star_collision", "tree", "continuity", "clusters", "density",
)  # fmt: skip
