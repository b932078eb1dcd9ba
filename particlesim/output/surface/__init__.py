"""Surfaces of fluids as meshes."""

from .surface import Surface

__all__ = ["Surface"]
