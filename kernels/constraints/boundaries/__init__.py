"""Surfaces of boundaries of further shapes, each from one function: the nearest point of it."""
