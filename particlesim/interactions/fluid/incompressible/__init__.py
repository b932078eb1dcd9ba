"""Fluids whose pressures are sought, and do not follow from their density."""
