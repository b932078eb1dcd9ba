"""The public names, by room: what ``import particlesim`` offers, and where it is."""

from .accuracy.measure.measuring import measure
from .accuracy.measure.report import Measured
from .accuracy.stress.sweep import Stress, stress
from .accuracy.tradeoff.sweep import tradeoff
from .accuracy.tradeoff.table import Tradeoff
from .accuracy.tune.report import Tuned
from .accuracy.tune.tuning import tune
from .constraints.bodies.body import Body
from .constraints.bodies.scene import Scene
from .constraints.boundaries.combined import ComplementBoundary, UnionBoundary
from .constraints.boundaries.heightfield import HeightfieldBoundary
from .constraints.boundaries.mesh import MeshBoundary
from .constraints.boundaries.motion import Keyframes, Trajectory
from .constraints.boundaries.round import CapsuleBoundary, CylinderBoundary
from .constraints.boundaries.sampled import SDFBoundary
from .constraints.boundary import Boundary
from .constraints.boundary_shapes import BoxBoundary, PlaneBoundary, SphereBoundary
from .constraints.clusters.hinge import Hinge
from .constraints.clusters.joints import BallJoint
from .constraints.clusters.mesh_volume import MeshVolume
from .constraints.clusters.shape_matching import ShapeMatching
from .constraints.constraint import Constraint
from .constraints.contact import Contact
from .constraints.distance import Distance
from .constraints.fluids.density import FluidDensity
from .constraints.force import ConstraintForce
from .constraints.gradient import check_gradient
from .constraints.kinds.angle import Angle
from .constraints.kinds.area import Area
from .constraints.kinds.attachment import Attachment
from .constraints.kinds.bending import Bending, hinges
from .constraints.kinds.isometric_bending import IsometricBending
from .constraints.kinds.neo_hookean import NeoHookean
from .constraints.kinds.volume import Volume
from .engine.execution.launch import launch
from .engine.integrators.integrator import Integrator
from .instruments.correlations import (
    RadialDistribution,
    mean_square_displacement,
    radial_distribution,
    velocity_autocorrelation,
)
from .instruments.ledger.ledger import Ledger
from .instruments.profile import Profile
from .instruments.stability import Stability, StabilityWarning
from .instruments.watchdog.incident import Incident, SimulationError, SimulationWarning
from .interactions.bonded.angles import Angles, HarmonicAngles
from .interactions.bonded.bonds import Bonds
from .interactions.bonded.dihedrals import Dihedrals
from .interactions.bonded.fene_bonds import FENEBonds
from .interactions.bonded.harmonic_bonds import HarmonicBonds
from .interactions.bonded.springs import Springs
from .interactions.electrostatics.electrostatics import Electrostatics
from .interactions.fields.field_force import FieldForce
from .interactions.fields.poisson import PoissonField
from .interactions.fields.wave import GridField
from .interactions.fluid.density.continuity import ContinuityDensity
from .interactions.fluid.equations_of_state import (
    EquationOfState,
    IdealGas,
    Isothermal,
    Polytrope,
    Tait,
)
from .interactions.fluid.incompressible.dfsph import DFSPH
from .interactions.fluid.interfaces.surface_tension import SurfaceTension
from .interactions.fluid.lengths import AdaptiveSmoothing
from .interactions.fluid.smoothing.gaussian import Gaussian
from .interactions.fluid.smoothing.mueller import MuellerViscosity, Poly6, Spiky
from .interactions.fluid.smoothing.smoothing_function import SmoothingFunction
from .interactions.fluid.smoothing.splines import CubicSpline, QuinticSpline
from .interactions.fluid.smoothing.wendland import WendlandC2, WendlandC4, WendlandC6
from .interactions.fluid.sph import SPH
from .interactions.fluid.viscosities import (
    XSPH,
    ArtificialViscosity,
    LaminarViscosity,
    ParticleShifting,
    Viscosity,
)
from .interactions.grains import HertzianGrains
from .interactions.gravity.gravity import Gravity
from .interactions.pair_laws import PairForce, PairPotential
from .interactions.pair_sum import PairSum
from .interactions.particle import ConstantForce, Drag, ParticleForce, UniformGravity
from .interactions.potentials.coulomb import Coulomb
from .interactions.potentials.mie import LennardJones, Mie
from .interactions.potentials.morse import Morse
from .interactions.potentials.soft_sphere import SoftSphere
from .interactions.potentials.yukawa import Yukawa
from .interactions.solid.elastic_solid import ElasticSolid
from .interactions.thermostats.cell_rescaling import CellRescaling
from .interactions.thermostats.langevin import Langevin
from .interactions.thermostats.velocity_rescaling import VelocityRescaling
from .output.history.writer import History, read_history
from .output.surface import Surface
from .output.usd.recorder import UsdRecorder
from .pictures.render.camera import Camera
from .scene import __version__, sample
from .scene.constraint_base import ConstraintBase
from .scene.group import Group
from .scene.law import Law, law
from .scene.part import Interaction
from .scene.settings import Settings
from .scene.table import Table
from .scene.thermostat import Barostat, Thermostat
from .simulation.simulation import Simulation

__all__ = [
    "DFSPH",
    "SPH",
    "XSPH",
    "AdaptiveSmoothing",
    "Angle",
    "Angles",
    "Area",
    "ArtificialViscosity",
    "Attachment",
    "BallJoint",
    "Barostat",
    "Bending",
    "Body",
    "Bonds",
    "Boundary",
    "BoxBoundary",
    "Camera",
    "CapsuleBoundary",
    "CellRescaling",
    "ComplementBoundary",
    "ConstantForce",
    "Constraint",
    "ConstraintBase",
    "ConstraintForce",
    "Contact",
    "ContinuityDensity",
    "Coulomb",
    "CubicSpline",
    "CylinderBoundary",
    "Dihedrals",
    "Distance",
    "Drag",
    "ElasticSolid",
    "Electrostatics",
    "EquationOfState",
    "FENEBonds",
    "FieldForce",
    "FluidDensity",
    "Gaussian",
    "Gravity",
    "GridField",
    "Group",
    "HarmonicAngles",
    "HarmonicBonds",
    "HeightfieldBoundary",
    "HertzianGrains",
    "Hinge",
    "History",
    "IdealGas",
    "Incident",
    "Integrator",
    "Interaction",
    "IsometricBending",
    "Isothermal",
    "Keyframes",
    "LaminarViscosity",
    "Langevin",
    "Law",
    "Ledger",
    "LennardJones",
    "Measured",
    "MeshBoundary",
    "MeshVolume",
    "Mie",
    "Morse",
    "MuellerViscosity",
    "NeoHookean",
    "PairForce",
    "PairPotential",
    "PairSum",
    "ParticleForce",
    "ParticleShifting",
    "PlaneBoundary",
    "PoissonField",
    "Poly6",
    "Polytrope",
    "Profile",
    "QuinticSpline",
    "RadialDistribution",
    "SDFBoundary",
    "Scene",
    "Settings",
    "ShapeMatching",
    "Simulation",
    "SimulationError",
    "SimulationWarning",
    "SmoothingFunction",
    "SoftSphere",
    "SphereBoundary",
    "Spiky",
    "Springs",
    "Stability",
    "StabilityWarning",
    "Stress",
    "Surface",
    "SurfaceTension",
    "Table",
    "Tait",
    "Thermostat",
    "Tradeoff",
    "Trajectory",
    "Tuned",
    "UniformGravity",
    "UnionBoundary",
    "UsdRecorder",
    "VelocityRescaling",
    "Viscosity",
    "Volume",
    "WendlandC2",
    "WendlandC4",
    "WendlandC6",
    "Yukawa",
    "__version__",
    "check_gradient",
    "hinges",
    "launch",
    "law",
    "mean_square_displacement",
    "measure",
    "radial_distribution",
    "read_history",
    "sample",
    "stress",
    "tradeoff",
    "tune",
    "velocity_autocorrelation"
]  # fmt: skip
