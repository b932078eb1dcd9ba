"""Solids that keep their shape."""
