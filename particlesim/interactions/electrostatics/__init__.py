"""Charges in open space and in periodic boxes."""
