"""The public names, by room: what ``import particlesim`` offers, and where it is."""

from .accuracy.measure.measuring import measure
from .accuracy.measure.report import Measured
from .accuracy.stress.sweep import Stress, stress
from .accuracy.tradeoff.sweep import tradeoff
from .accuracy.tradeoff.table import Tradeoff
from .accuracy.tune.report import Tuned
from .accuracy.tune.tuning import tune
from .constraints.boundary import Boundary
from .constraints.boundary_shapes import BoxBoundary, PlaneBoundary, SphereBoundary
from .constraints.constraint import Constraint
from .constraints.contact import Contact
from .constraints.distance import Distance
from .constraints.force import ConstraintForce
from .engine.execution.launch import launch
from .engine.integrators import Integrator
from .instruments.ledger.ledger import Ledger
from .instruments.profile import Profile
from .instruments.stability import Stability, StabilityWarning
from .instruments.watchdog.incident import Incident, SimulationError, SimulationWarning
from .interactions.fluid.equations_of_state import EquationOfState, Polytrope, Tait
from .interactions.fluid.sph import SPH
from .interactions.fluid.viscosities import ArtificialViscosity, Viscosity
from .interactions.gravity.gravity import Gravity
from .interactions.lennard_jones import LennardJones
from .interactions.pair import PairForce, PairPotential
from .interactions.pair_sum import PairSum
from .interactions.particle import ConstantForce, Drag, ParticleForce, UniformGravity
from .interactions.springs import Springs
from .output.history.writer import History, read_history
from .output.surface import Surface
from .output.usd.recorder import UsdRecorder
from .pictures.render.camera import Camera
from .scene import __version__, sample
from .scene.group import Group
from .scene.law import Law, law
from .scene.part import ConstraintBase, Interaction
from .scene.scene import Scene
from .scene.settings import Settings
from .simulation.simulation import Simulation

__all__ = [
    "SPH",
    "ArtificialViscosity",
    "Boundary",
    "BoxBoundary",
    "Camera",
    "ConstantForce",
    "Constraint",
    "ConstraintBase",
    "ConstraintForce",
    "Contact",
    "Distance",
    "Drag",
    "EquationOfState",
    "Gravity",
    "Group",
    "History",
    "Incident",
    "Integrator",
    "Interaction",
    "Law",
    "Ledger",
    "LennardJones",
    "Measured",
    "PairForce",
    "PairPotential",
    "PairSum",
    "ParticleForce",
    "PlaneBoundary",
    "Polytrope",
    "Profile",
    "Scene",
    "Settings",
    "Simulation",
    "SimulationError",
    "SimulationWarning",
    "SphereBoundary",
    "Springs",
    "Stability",
    "StabilityWarning",
    "Stress",
    "Surface",
    "Tait",
    "Tradeoff",
    "Tuned",
    "UniformGravity",
    "UsdRecorder",
    "Viscosity",
    "__version__",
    "launch",
    "law",
    "measure",
    "read_history",
    "sample",
    "stress",
    "tradeoff",
    "tune"
]  # fmt: skip
