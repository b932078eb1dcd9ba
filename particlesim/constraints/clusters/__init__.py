"""Constraints over many particles: shapes that are kept, joints between them, enclosed volumes."""
