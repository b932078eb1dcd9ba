"""What is not a number is refused by every public part, in every argument, with its name."""

import re

import numpy as np
import pytest
import warp as wp
from hypothesis import given
from hypothesis import strategies as st

import particlesim as ps


@ps.law
def pull(r: float, strength: float):
    """A linear force."""
    return -strength * r


@ps.law
def above(a: wp.vec3, level: float):
    """The height over a level."""
    return a[1] - level


FLUIDS = ps.SPH(["oil", "water"], smoothing_length=0.1, rest_density=[0.9, 1.0],
                equation_of_state=ps.Tait(10.0))  # fmt: skip


@ps.law
def wave(angle: float, level: float):
    """A law of an angle or a dihedral."""
    return level * wp.cos(angle)


TETRAHEDRON = [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)]
# Arguments that each part can be made with.
PARTS = {
    ps.AdaptiveSmoothing: {"eta": 1.2, "largest": 1.0},
    ps.Angle: {"triples": [(0, 1, 2)], "rest_angle": 1.0, "compliance": 0.1, "damping": 0.1,
               "break_force": 10.0, "yield_angle": 0.1, "creep": 2.0, "largest_angle": 0.5},
    ps.Area: {"triangles": [(0, 1, 2)], "rest_area": 1.0, "compliance": 0.1, "damping": 0.1,
              "break_force": 10.0},
    ps.Angles: {"triples": [(0, 1, 2)], "law": wave, "level": 1.0},
    ps.ArtificialViscosity: {"alpha": 0.1, "beta": 0.2},
    ps.BallJoint: {"a": [0, 1, 2], "b": [3, 4, 5], "point": (0, 0, 0), "compliance": 0.1,
                   "break_force": 1.0},
    ps.Attachment: {"particles": [0], "target": (0, 1, 0), "compliance": 0.1, "damping": 0.1,
                    "break_force": 10.0},
    ps.Bending: {"hinges": [(0, 1, 2, 3)], "rest_angle": 1.0, "compliance": 0.1, "damping": 0.1,
                 "break_force": 10.0, "yield_angle": 0.1, "creep": 2.0, "largest_angle": 0.5},
    ps.Bonds: {"pairs": [(0, 1)], "law": pull, "strength": 1.0},
    ps.Boundary: {
        "law": above, "friction": 0.1, "restitution": 0.5, "velocity": (0, 1, 0),
        "angular_velocity": (0, 0, 1), "pivot": (0, 1, 0), "drawn": ((0, 0, 0), (1, 1, 1)),
        "level": 0.0,
    },
    ps.BoxBoundary: {"lower": (0, 0, 0), "upper": (1, 1, 1), "friction": 0.1, "restitution": 0.5},
    ps.CapsuleBoundary: {"start": (0, 0, 0), "end": (1, 0, 0), "radius": 0.2, "friction": 0.1},
    ps.CellRescaling: {"pressure": 1.0, "compressibility": 1.0, "relaxation_time": 1.0,
                       "temperature": 1.0, "interval": 5},
    ps.ConstantForce: {"force": (0, 1, 0)},
    ps.Constraint: {
        "law": above, "particles": [[0]], "compliance": 0.1, "damping": 0.1, "break_force": 1.0,
        "level": 0.0,
    },
    ps.Contact: {"friction": 0.1, "restitution": 0.5, "compliance": 1e-6},
    ps.ContinuityDensity: {"diffusion": 0.1},
    ps.Coulomb: {"cutoff": 2.0, "damping": 0.1},
    ps.Dihedrals: {"quadruples": [(0, 1, 2, 3)], "law": wave, "level": 1.0},
    ps.Distance: {"pairs": [(0, 1)], "rest_length": 1.0, "compliance": 0.1, "damping": 0.1,
                  "break_force": 10.0, "yield_strain": 0.1, "creep": 2.0, "largest_strain": 0.5},
    ps.Drag: {"linear": 1.0, "quadratic": 1.0, "flow": (1, 0, 0)},
    ps.Electrostatics: {"method": "particle_mesh_ewald", "cutoff": 2.0, "tolerance": 1e-5},
    ps.ElasticSolid: {
        "group": "g", "youngs_modulus": 1.0, "poissons_ratio": 0.3, "smoothing_length": 0.1,
        "rest_density": 1.0, "hourglass": 1.0, "dissipation": 0.1,
    },
    ps.FENEBonds: {"pairs": [(0, 1)], "stiffness": 30.0, "length": 1.5},
    ps.Gravity: {"G": 1.0, "softening": 0.1, "method": "particle_mesh_ewald", "cutoff": 2.0,
                 "tolerance": 1e-5},
    ps.CylinderBoundary: {"start": (0, 0, 0), "end": (1, 0, 0), "radius": 0.2},
    ps.DFSPH: {"smoothing_length": 0.1, "rest_density": 1.0},
    ps.FluidDensity: {"rest_density": 1.0, "smoothing_length": 0.1, "compliance": 1e-6},
    ps.HarmonicAngles: {"triples": [(0, 1, 2)], "stiffness": 1.0, "rest_angle": 2.0},
    ps.HarmonicBonds: {"pairs": [(0, 1)], "stiffness": 1.0, "rest_length": 1.0},
    ps.HeightfieldBoundary: {
        "heights": [(0, 1), (0, 2)], "lower": (0, 0, 0), "spacing": 0.5, "pivot": (0, 0, 0),
    },
    ps.Hinge: {"a": [0, 1, 2], "b": [3, 4, 5], "point": (0, 0, 0), "axis": (0, 0, 1),
               "lower": -0.5, "upper": 0.5, "compliance": 0.1, "break_force": 1.0},
    ps.IdealGas: {"gamma": 1.4},
    ps.Isothermal: {"sound_speed": 1.0},
    ps.Keyframes: {"times": [0.0, 1.0], "places": [(0, 0, 0), (0, 1, 0)],
                   "turns": [(0, 0, 0), (0, 1, 0)]},
    ps.IsometricBending: {"hinges": [(0, 1, 2, 3)], "compliance": 0.1, "damping": 0.1,
                          "break_force": 10.0},
    ps.LaminarViscosity: {"kinematic_viscosity": 0.1},
    ps.LennardJones: {"epsilon": 1.0, "sigma": 1.0, "cutoff": 2.5},
    ps.GridField: {"lower": (0, 0, 0), "upper": (1, 1, 1), "spacing": 0.1, "speed": 1.0,
                   "density": 1.0, "damping": 0.1},
    ps.MeshBoundary: {
        "vertices": [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], "triangles": TETRAHEDRON,
        "thickness": 0.1,
    },
    ps.MeshVolume: {"triangles": [(0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3)], "pressure": 1.2,
                    "rest_volume": 1.0, "compliance": 0.1, "burst_pressure": 1.0},
    ps.Mie: {"epsilon": 1.0, "sigma": 1.0, "cutoff": 2.5},
    ps.Morse: {"depth": 1.0, "steepness": 1.0, "distance": 1.0, "cutoff": 2.5},
    ps.NeoHookean: {"tetrahedra": [(0, 1, 2, 3)], "youngs_modulus": 1.0, "poissons_ratio": 0.3,
                    "damping": 0.1},
    ps.PairForce: {"law": pull, "cutoff": 1.0, "strength": 1.0},
    ps.PairPotential: {"law": pull, "cutoff": 1.0, "strength": 1.0},
    ps.ParticleShifting: {"speed": 1.0},
    ps.PlaneBoundary: {"point": (0, 0, 0), "normal": (0, 1, 0), "friction": 0.1},
    ps.PoissonField: {"lower": (0, 0, 0), "upper": (1, 1, 1), "spacing": 0.1},
    ps.Polytrope: {"constant": 1.0, "index": 1.0},
    ps.SDFBoundary: {"distance": np.ones((2, 2, 3)), "lower": (0, 0, 0), "spacing": 0.5},
    ps.SPH: {"smoothing_length": 0.1, "rest_density": 1.0,
             "equation_of_state": ps.Polytrope(1.0, 1.0)},
    ps.Scene: {"meters_per_unit": 1.0, "periodic": ((0, 0, 0), (1, 1, 1))},
    ps.Settings: {"dt": 0.1, "skin": 0.1, "relaxation": 0.5, "depenetration_speed": 1.0,
                  "opening_angle": 0.5, "substeps": 2, "iterations": 2, "threads": 1},
    ps.ShapeMatching: {"clusters": [[0, 1, 2]], "compliance": 0.1, "yield_strain": 0.1,
                       "creep": 1.0, "largest_strain": 0.5, "break_force": 1.0},
    ps.SoftSphere: {"epsilon": 1.0, "sigma": 1.0, "exponent": 2.0},
    ps.Springs: {"pairs": [(0, 1)], "stiffness": 1.0, "rest_length": 1.0, "damping": 0.1},
    ps.SurfaceTension: {"fluid": FLUIDS, "coefficient": 1.0},
    ps.Tait: {"sound_speed": 10.0, "exponent": 7.0},
    ps.UniformGravity: {"acceleration": (0, -9.81, 0)},
    ps.Volume: {"tetrahedra": [(0, 1, 2, 3)], "rest_volume": 1.0, "compliance": 0.1,
                "damping": 0.1, "break_force": 10.0},
    ps.XSPH: {"epsilon": 0.5},
    ps.Yukawa: {"strength": 1.0, "screening": 1.0, "cutoff": 2.5},
}  # fmt: skip
OPEN = {(ps.BoxBoundary, "lower"), (ps.BoxBoundary, "upper")}  # a side may be infinitely far
NEVER = {
    (ps.Angle, "break_force"),
    (ps.Area, "break_force"),
    (ps.BallJoint, "break_force"),
    (ps.Attachment, "break_force"),
    (ps.Bending, "break_force"),
    (ps.Constraint, "break_force"),
    (ps.Distance, "break_force"),
    (ps.Hinge, "break_force"),
    (ps.IsometricBending, "break_force"),
    (ps.MeshVolume, "burst_pressure"),
    (ps.ShapeMatching, "break_force"),
    (ps.Volume, "break_force"),
}  # may be infinite: unbreakable
INDICES = {
    "a", "b", "clusters", "hinges", "pairs", "particles", "quadruples", "tetrahedra", "triangles",
    "triples",
}  # fmt: skip
SIGNED = {
    "G", "acceleration", "angular_velocity", "axis", "drawn", "end", "flow", "force", "heights",
    "level", "lower", "normal", "periodic", "pivot", "places", "point", "pressure",
    (ps.Bending, "rest_angle"), (ps.Volume, "rest_volume"), "start", "strength", "target", "times",
    "turns", "upper", "velocity", "vertices",
}  # fmt: skip


def numbers_of(part):
    """Names of the arguments that are numbers."""
    return [name for name, value in PARTS[part].items() if np.asarray(value).dtype.kind in "if"]


CASES = [(part, name) for part in PARTS for name in numbers_of(part)]


def spoiled(value, bad, at):
    """``value`` with ``bad`` in one of its numbers."""
    array = np.array(value, dtype=float)
    array.ravel()[at % array.size] = bad
    return array.tolist()


def refuses(make, name):
    with pytest.raises((ValueError, TypeError)) as caught:
        make()
    text = str(caught.value)
    assert re.match(r"\w[\w.]*: .+ must .+, got .+; .+\.$", text, re.DOTALL), text
    assert name.rstrip("s") in text, text  # "particles" may be refused as "particle"


def may_be(part, name, bad):
    """Whether an infinite value means something."""
    return np.isinf(bad) and ((part, name) in OPEN or (bad > 0 and (part, name) in NEVER))


@pytest.mark.parametrize(
    ("part", "name", "bad"),
    [(*case, bad) for case in CASES for bad in (np.nan, np.inf, -np.inf) if not may_be(*case, bad)],
)
def test_what_is_not_finite(part, name, bad):
    part(**PARTS[part])
    for at in range(np.size(PARTS[part][name])):
        given = {**PARTS[part], name: spoiled(PARTS[part][name], bad, at)}
        refuses(lambda given=given: part(**given), name)


@pytest.mark.parametrize(
    ("part", "name"), [case for case in CASES if not {case, case[1]} & (SIGNED | INDICES)]
)
def test_what_is_below_zero(part, name):
    refuses(lambda: part(**{**PARTS[part], name: -1.0}), name)


@pytest.mark.parametrize(("part", "name"), CASES)
@pytest.mark.parametrize("bad", ["many", None, {}, [[[[1]]]]])
def test_what_is_no_number(part, name, bad):
    optional = bad is None  # where nothing may be given, that is no error
    try:
        part(**{**PARTS[part], name: bad})
    except (ValueError, TypeError) as error:
        assert name.rstrip("s") in str(error), error
    else:
        assert optional


PARTICLES = {
    "position": (0, 0, 0),
    "velocity": (1, 0, 0),
    "mass": 1.0,
    "radius": 0.5,
    "charge": 1.0,
}


@given(
    name=st.sampled_from(sorted(PARTICLES)),
    bad=st.sampled_from([np.nan, np.inf, -np.inf]),
    count=st.integers(1, 40),
    data=st.data(),
)
def test_particles(name, bad, count, data):
    columns = {key: np.array([value] * count, dtype=float) for key, value in PARTICLES.items()}
    row = data.draw(st.integers(0, count - 1))
    columns[name][row] = bad
    scene = ps.Scene()
    with pytest.raises(ValueError, match=rf"{name}\[{row}"):
        scene.add_particles(columns.pop("position"), **columns)
    assert scene.particle_count == 0  # nothing of it is left
    scene.add_particles([(0, 0, 0)])


@given(
    name=st.sampled_from(["position", "velocity"]),
    bad=st.sampled_from([np.nan, np.inf, -np.inf]),
    row=st.integers(0, 6),
)
def test_values_set_in_a_simulation(name, bad, row):
    scene = ps.Scene()
    scene.add_particles(np.eye(7, 3))
    sim = ps.Simulation(scene, device="cpu")
    before = getattr(sim, name)
    value = before.copy()
    value[row, row % 3] = bad
    with pytest.raises(ValueError, match=rf"{name}\[{row}"):
        setattr(sim, name, value)
    np.testing.assert_array_equal(getattr(sim, name), before)
