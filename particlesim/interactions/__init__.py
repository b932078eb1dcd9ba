"""Interactions: what acts at the start of a substep."""

from ..scene.part import Interaction
from .fluid.equations_of_state import Polytrope, Tait
from .fluid.sph import SPH
from .fluid.viscosities import ArtificialViscosity
from .gravity import Gravity
from .lennard_jones import LennardJones
from .pair import PairForce, PairPotential
from .pair_sum import PairSum
from .particle import ConstantForce, Drag, ParticleForce, UniformGravity
from .springs import Springs

__all__ = [
    "SPH",
    "ArtificialViscosity",
    "ConstantForce",
    "Drag",
    "Gravity",
    "Interaction",
    "LennardJones",
    "PairForce",
    "PairPotential",
    "PairSum",
    "ParticleForce",
    "Polytrope",
    "Springs",
    "Tait",
    "UniformGravity",
]
