"""Interactions: what acts at the start of a substep."""

from .base import Interaction
from .gravity import Gravity
from .lennard_jones import LennardJones
from .pair import PairForce, PairPotential
from .particle import ConstantForce, Drag, ParticleForce, UniformGravity
from .springs import Springs

__all__ = [
    "ConstantForce",
    "Drag",
    "Gravity",
    "Interaction",
    "LennardJones",
    "PairForce",
    "PairPotential",
    "ParticleForce",
    "Springs",
    "UniformGravity",
]
