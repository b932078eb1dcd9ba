"""Densities of a fluid that are a state of their own."""
