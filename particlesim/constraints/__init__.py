"""Constraints: what projects positions after integration."""

from .constraint import Constraint
from .distance import Distance
from .force import ConstraintForce

__all__ = ["Constraint", "ConstraintForce", "Distance"]
