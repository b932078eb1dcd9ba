"""Every ready interaction, constraint and boundary in a scene of its own, in any frame.

Parts are found among the public names, and their arguments by name in ``QUANTITIES``; so a part
that is added later is tested like the others, once each of its arguments has a meaning here.
"""

import functools
import inspect

import numpy as np
import warp as wp

import particlesim as ps
from cases.frames import Frame, Quantity
from particlesim.scene.constraint_base import ConstraintBase
from particlesim.scene.part import Interaction

FORCE, STIFFNESS = (1, 1, -2), (0, 1, -2)
COUNT = 8
PAIRS = [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (6, 7)]
TUPLES = {
    "pairs": PAIRS, "particles": PAIRS, "triples": [(0, 1, 3), (1, 3, 7), (4, 5, 7), (2, 6, 4)],
    "quadruples": [(0, 1, 3, 7), (5, 4, 6, 2), (0, 2, 6, 7)],
    "clusters": [(0, 1, 3, 7, 2), (5, 4, 6, 2, 0)], "a": [(0, 1, 3, 7)], "b": [(5, 4, 6, 2)],
    "triangles": [(0, 3, 1), (0, 1, 4), (1, 3, 4), (3, 0, 4)],
    "tetrahedra": [(0, 1, 3, 7), (5, 2, 4, 0)],
    "hinges": [(0, 1, 3, 7), (5, 4, 6, 2), (0, 2, 6, 7)],
}  # fmt: skip


@ps.law
def screened(r: float, strength: float, reach: float):
    return strength * wp.exp(-r / reach) / r


@ps.law
def repulsion(r: float, stiffness: float, reach: float):
    return stiffness * wp.max(reach - r, 0.0)


@ps.law
def bending(cosine: float, epsilon: float):
    return epsilon * (1.0 + cosine) * (1.0 + cosine)


@ps.law
def torsion(dihedral: float, epsilon: float):
    return epsilon * (1.0 + wp.cos(3.0 * dihedral))


@ps.law
def trap(position: wp.vec3, velocity: wp.vec3, stiffness: float, middle: wp.vec3):
    return -stiffness * (position - middle)


@ps.law
def separation(a: wp.vec3, b: wp.vec3, rest_length: float):
    return wp.length(b - a) - rest_length


@ps.law
def bowl(x: wp.vec3, middle: wp.vec3, size: float):
    return size - wp.length(x - middle)


# What arguments mean, by name; where classes differ, by class and name.
QUANTITIES = {
    "epsilon": Quantity(0.8, (2, 1, -2)),
    "sigma": Quantity(0.9, (1, 0, 0)),
    "cutoff": Quantity(2.1, (1, 0, 0)),
    "G": Quantity(0.7, (3, -1, -2)),
    "softening": Quantity(0.3, (1, 0, 0)),
    "stiffness": Quantity(6.0, STIFFNESS),
    "rest_length": Quantity(1.1, (1, 0, 0)),
    "damping": Quantity(0.4, (0, 1, -1)),
    "acceleration": Quantity((0.3, -1.0, 0.2), (1, 0, -2), "vector"),
    "force": Quantity((0.3, -1.0, 0.2), FORCE, "vector"),
    "linear": Quantity(0.3, (0, 1, -1)),
    "quadratic": Quantity(0.2, (-1, 1, 0)),
    "flow": Quantity((0.5, 0.1, -0.2), (1, 0, -1), "velocity"),
    "start": Quantity((-1.6, -1.8, 0), (1, 0, 0), "point"),
    "end": Quantity((1.7, -1.5, 0.2), (1, 0, 0), "point"),
    "vertices": Quantity(
        [(-4, -1.2, -4), (4, -1.1, -4), (0, -1.3, 5), (0, -5, 0)], (1, 0, 0), "point"
    ),
    "thickness": Quantity(0.1, (1, 0, 0)),
    ("CapsuleBoundary", "radius"): Quantity(1.3, (1, 0, 0)),
    ("CylinderBoundary", "radius"): Quantity(1.3, (1, 0, 0)),
    "compliance": Quantity(0.05, (0, -1, 2)),
    "friction": Quantity(0.3),
    "restitution": Quantity(0.5),
    "point": Quantity((0, -1.2, 0), (1, 0, 0), "point"),
    "normal": Quantity((0.1, 1, 0.2), kind="vector"),
    "center": Quantity((0.1, 0, 0), (1, 0, 0), "point"),
    "lower": Quantity((-1.5, -1.4, -1.6), (1, 0, 0), "corner"),
    "upper": Quantity((1.5, 1.6, 1.4), (1, 0, 0), "corner"),
    "velocity": Quantity((0.1, 0.2, 0.1), (1, 0, -1), "velocity"),
    "angular_velocity": Quantity((0.0, 0.0, 0.0), (0, 0, -1), "axial"),
    "smoothing_length": Quantity(0.9, (1, 0, 0)),
    "rest_density": Quantity(1.0, (-3, 1, 0)),
    "strength": Quantity(0.8, (3, 1, -2)),
    "reach": Quantity(1.4, (1, 0, 0)),
    "middle": Quantity((0.1, 0.2, -0.1), (1, 0, 0), "point"),
    "size": Quantity(1.9, (1, 0, 0)),
    "length": Quantity(2.5, (1, 0, 0)),
    "constant": Quantity(0.6, (3, 1, -2)),
    "modulus": Quantity(40.0, (-1, 1, -2)),
    "ratio": Quantity(0.3),
    "youngs_modulus": Quantity(40.0, (-1, 1, -2)),
    "poissons_ratio": Quantity(0.3),
    "hourglass": Quantity(0.5),
    "dissipation": Quantity(0.02, (0, 0, 1)),
    "sliding": Quantity(0.05, (0, 0, 1)),
    "depth": Quantity(0.8, (2, 1, -2)),
    "steepness": Quantity(1.7, (-1, 0, 0)),
    "distance": Quantity(1.1, (1, 0, 0)),
    "exponent": Quantity(2.5),
    "screening": Quantity(0.9, (1, 0, 0)),
    ("Coulomb", "damping"): Quantity(0.3, (-1, 0, 0)),
    ("SoftSphere", "sigma"): Quantity(1.6, (1, 0, 0)),
    "rest_angle": Quantity(1.9),
    ("BallJoint", "point"): Quantity([(0.1, 0.2, 0.0)], (1, 0, 0), "point"),
    ("Hinge", "point"): Quantity([(0.1, 0.2, 0.0)], (1, 0, 0), "point"),
    "axis": Quantity([(0.3, 1, 0.2)], kind="axial"),
    ("Hinge", "lower"): Quantity(-0.5),
    ("Hinge", "upper"): Quantity(0.1),
    ("MeshVolume", "pressure"): Quantity(1.2),
    ("MeshVolume", "rest_volume"): Quantity(0.3, (3, 0, 0)),
    ("MeshVolume", "compliance"): Quantity(0.05, (4, -1, 2)),
    ("HarmonicAngles", "stiffness"): Quantity(3.0, (2, 1, -2)),
    ("Bending", "rest_angle"): Quantity(0.7, kind="signed"),
    ("Bending", "compliance"): Quantity(0.3, (-2, -1, 2)),
    ("Bending", "damping"): Quantity(0.2, (2, 1, -1)),
    "rest_area": Quantity(0.9, (2, 0, 0)),
    "rest_volume": Quantity(0.4, (3, 0, 0), "signed"),
    ("Angle", "compliance"): Quantity(0.3, (-2, -1, 2)),
    ("Angle", "damping"): Quantity(0.2, (2, 1, -1)),
    ("Area", "compliance"): Quantity(0.3, (2, -1, 2)),
    ("Area", "damping"): Quantity(0.2, (-2, 1, -1)),
    ("Volume", "compliance"): Quantity(0.3, (4, -1, 2)),
    ("Volume", "damping"): Quantity(0.2, (-4, 1, -1)),
    ("NeoHookean", "damping"): Quantity(0.02, (0, 0, 1)),
    ("IsometricBending", "compliance"): Quantity(0.3, (-2, -1, 2)),
    ("IsometricBending", "damping"): Quantity(0.2, (2, 1, -1)),
    ("SphereBoundary", "radius"): Quantity(1.9, (1, 0, 0)),
    ("Distance", "damping"): Quantity(0.5, (0, 1, -1)),
    # Two of the cluster fill a place: C is above 0 at its middle.
    ("FluidDensity", "rest_density"): Quantity(0.6, (-3, 1, 0)),
    ("FluidDensity", "compliance"): Quantity(0.05, (-2, -1, 2)),
}
# What laws are given to the parts that take one, with the parameters that come with it.
LAWS = {
    "PairPotential": (screened, ("strength", "reach")),
    "PairForce": (repulsion, ("stiffness", "reach")),
    "Bonds": (screened, ("strength", "reach")),
    "Angles": (bending, ("epsilon",)),
    "Dihedrals": (torsion, ("epsilon",)),
    "ParticleForce": (trap, ("stiffness", "middle")),
    "Constraint": (separation, ("rest_length",)),
    "Boundary": (bowl, ("middle", "size")),
}
TETRAHEDRON = [(0, 1, 2), (0, 3, 1), (1, 3, 2), (2, 3, 0)]
PLAIN = {**TUPLES, "triangles": TETRAHEDRON, "group": None, "exponents": (12, 6)}
LEFT_OUT = {
    "break_force", "inequality", "tension_only", "truncation", "inside", "potential", "smoothing",
    "density", "dimension", "viscosity", "pivot", "drawn", "mixing", "groups", "exclude", "switch",
    "method", "tolerance", "slip", "capped", "sheet", "motion", "rest", "yield_strain", "creep",
    "largest_strain", ("Electrostatics", "cutoff"), ("Electrostatics", "damping"), ("Gravity",
    "cutoff"), "burst_pressure", "yield_angle", "largest_angle", "edges",
}  # fmt: skip
# What is of one machinery is tried by its kin in every run, and itself in the long one.
KIN = {
    "ElasticSolid": "Springs", "BallJoint": "Constraint", "Hinge": "Constraint",
    "MeshVolume": "Constraint", "ShapeMatching": "Constraint",
    "HarmonicBonds": "Springs", "FENEBonds": "Bonds", "HarmonicAngles": "Angles",
    "Mie": "LennardJones", "Yukawa": "PairPotential", "Morse": "PairPotential",
    "FluidDensity": "Contact",
    "CapsuleBoundary": "Boundary", "CylinderBoundary": "Boundary", "MeshBoundary": "Boundary",
    "DFSPH": "SPH", "NeoHookean": "Constraint", "Angle": "Constraint", "Area": "Constraint",
    "Volume": "Constraint",
    "Bending": "Constraint", "IsometricBending": "Constraint",
    "SoftSphere": "PairPotential", "Coulomb": "PairPotential", "Electrostatics": "PairPotential",
}  # fmt: skip
# To a grid, which rests in the frame that it is made in, and to groups of several fluids.
BOUND = ("Attachment", "FieldForce", "SurfaceTension", "HeightfieldBoundary", "SDFBoundary",
         "UnionBoundary", "ComplementBoundary")  # fmt: skip


NU = Quantity(0.1, (2, 0, -1))


def fluid_parts(name, frame):
    """The parts of a fluid, which are objects of their own."""
    if name == "DFSPH":
        return {"viscosity": [ps.LaminarViscosity(frame.of(NU))]}
    speed = frame.of(Quantity(3.0, (1, 0, -1)))
    return {
        "equation_of_state": ps.Tait(sound_speed=speed),
        "viscosity": [
            ps.ArtificialViscosity(0.2, balsara=True),
            ps.LaminarViscosity(frame.of(NU)),
            ps.XSPH(),
        ],
    }


@functools.cache
def kinds():
    """Public classes that can be added to a scene, by name."""
    found = {}
    for name in ps.__all__:
        kind = getattr(ps, name)
        if isinstance(kind, type) and issubclass(kind, Interaction | ConstraintBase):
            abstract = kind in (Interaction, ConstraintBase)
            if not abstract and name not in BOUND:
                found[name] = kind
    return found


def arguments(name, frame):
    """What a part is made with, as an observer of that frame gives it."""
    if name == "ConstraintForce":
        return {"constraint": make("Constraint", frame)}
    given = {}
    extra = ()
    for key, parameter in inspect.signature(kinds()[name]).parameters.items():
        if key == "law":
            given["law"], extra = LAWS[name]
        elif key in PLAIN:
            given[key] = PLAIN[key]
        elif key in fluid_parts(name, frame):
            given[key] = fluid_parts(name, frame)[key]
        elif not {key, (name, key)} & LEFT_OUT and parameter.kind is not parameter.VAR_KEYWORD:
            given[key] = frame.of(quantity(name, key))
    if "lower" in given:  # corners are turned, and the box is then named by its new ones
        corners = given["lower"], given["upper"]
        given["lower"], given["upper"] = np.minimum(*corners), np.maximum(*corners)
    return given | {key: frame.of(quantity(name, key)) for key in extra}


def quantity(name, key):
    """The meaning of an argument."""
    found = QUANTITIES.get((name, key), QUANTITIES.get(key))
    assert found is not None, f"{name}: tests/cases/parts.py must say what {key} means"
    return found


def make(name, frame):
    """A part by its name."""
    return kinds()[name](**arguments(name, frame))


def along_pairs(name, frame):
    """A part by its name; of viscosities that which acts along pairs alone."""
    given = arguments(name, frame)
    if "viscosity" in given:
        given["viscosity"] = [each for each in given["viscosity"] if "term" in each.laws]
    return kinds()[name](**given)


def along_axes(name):
    """Whether a part knows the axes, so that only quarter turns leave it what it is."""
    return any(
        quantity(name, key).kind == "corner"
        for key in inspect.signature(kinds()[name]).parameters
        if key in QUANTITIES
    )


def particles():
    """Positions, velocities, masses and radii of a loose cluster, in plain numbers."""
    rng = np.random.default_rng(4)
    corners = np.array([(i, j, k) for i in (0, 1) for j in (0, 1) for k in (0, 1)], dtype=float)
    x = 1.2 * (corners - 0.5) + rng.uniform(-0.1, 0.1, (COUNT, 3))
    v = rng.normal(0, 0.3, (COUNT, 3))
    return x, v, rng.uniform(0.5, 1.5, COUNT), rng.uniform(0.4, 0.6, COUNT)


def scene(names, frame=None, order=None, changed=None, box=None, places=None):
    """A scene of the cluster and these parts, in a frame.

    order: permutes the particles. changed: makes a part of name and frame. box: side of a periodic
    box around the frame's origin. places: positions instead of the cluster's.
    """
    frame = Frame() if frame is None else frame
    order = np.arange(COUNT) if order is None else order
    x, v, m, radius = particles()
    x = x if places is None else places
    side = None if box is None else np.full(3, 0.5 * box)
    result = ps.Scene(periodic=None if box is None else (-side, side))
    result.add_particles(
        frame.point(x)[order], velocity=frame.velocity(v)[order],
        mass=m[order] * frame.mass, radius=radius[order] * frame.length,
        charge=np.resize([1.0, -1.0, 0.5], COUNT)[order],
    )  # fmt: skip
    for name in names:
        part = make(name, frame) if changed is None else changed(name, frame)
        is_force = isinstance(part, Interaction)
        (result.add_interaction if is_force else result.add_constraint)(part)
    return result
