"""Fluids by Smoothed Particle Hydrodynamics."""
