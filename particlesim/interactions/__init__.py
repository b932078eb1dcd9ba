"""Interactions: what acts at the start of a substep."""

from .base import Interaction
from .equations_of_state import Polytrope, Tait
from .gravity import Gravity
from .lennard_jones import LennardJones
from .pair import PairForce, PairPotential
from .particle import ConstantForce, Drag, ParticleForce, UniformGravity
from .sph import SPH
from .springs import Springs
from .viscosities import ArtificialViscosity

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
    "ParticleForce",
    "Polytrope",
    "Springs",
    "Tait",
    "UniformGravity",
]
