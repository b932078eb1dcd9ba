"""Constraints: what projects positions after integration."""

from .boundary import Boundary
from .boundary_shapes import BoxBoundary, PlaneBoundary, SphereBoundary
from .constraint import Constraint
from .contact import Contact
from .distance import Distance
from .force import ConstraintForce

__all__ = [
    "Boundary",
    "BoxBoundary",
    "Constraint",
    "ConstraintForce",
    "Contact",
    "Distance",
    "PlaneBoundary",
    "SphereBoundary",
]
