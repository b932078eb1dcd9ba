"""particlesim: a general particle-physics framework on NVIDIA Warp."""

from . import sample
from .constraints import (
    BoxBoundary,
    Constraint,
    ConstraintForce,
    Contact,
    Distance,
    PlaneBoundary,
    SphereBoundary,
)
from .errors import SimulationError, SimulationWarning
from .history import History, read_history
from .interactions import (
    SPH,
    ArtificialViscosity,
    ConstantForce,
    Drag,
    Gravity,
    Interaction,
    LennardJones,
    PairForce,
    PairPotential,
    ParticleForce,
    Polytrope,
    Springs,
    Tait,
    UniformGravity,
)
from .law import Law, law
from .ledger import Ledger
from .render import Camera
from .scene import Group, Scene
from .settings import Settings
from .simulation import Simulation
from .stability import Stability, StabilityWarning
from .stress import Stress, stress
from .surface import Surface
from .tradeoff import Tradeoff, tradeoff
from .tune import Tuned, tune
from .usd import UsdRecorder
from .watchdog.incident import Incident

__version__ = "0.1.0"

__all__ = [
    "SPH",
    "ArtificialViscosity",
    "BoxBoundary",
    "Camera",
    "ConstantForce",
    "Constraint",
    "ConstraintForce",
    "Contact",
    "Distance",
    "Drag",
    "Gravity",
    "Group",
    "History",
    "Incident",
    "Interaction",
    "Law",
    "Ledger",
    "LennardJones",
    "PairForce",
    "PairPotential",
    "ParticleForce",
    "PlaneBoundary",
    "Polytrope",
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
    "law",
    "read_history",
    "sample",
    "stress",
    "tradeoff",
    "tune",
]
