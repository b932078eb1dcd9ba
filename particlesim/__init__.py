"""particlesim: a general particle-physics framework on NVIDIA Warp."""

from . import sample
from .constraints import (
    BoxBoundary,
    Constraint,
    ConstraintForce,
    Contact,
    Distance,
    PlaneBoundary,
)
from .errors import SimulationError
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
from .record import UsdRecorder
from .scene import Group, Scene
from .settings import Settings
from .simulation import Simulation
from .tradeoff import Tradeoff, tradeoff

__version__ = "0.1.0"

__all__ = [
    "SPH",
    "ArtificialViscosity",
    "BoxBoundary",
    "ConstantForce",
    "Constraint",
    "ConstraintForce",
    "Contact",
    "Distance",
    "Drag",
    "Gravity",
    "Group",
    "Interaction",
    "Law",
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
    "Springs",
    "Tait",
    "Tradeoff",
    "UniformGravity",
    "UsdRecorder",
    "law",
    "sample",
    "tradeoff",
]
