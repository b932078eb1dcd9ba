"""Constraints in a substep: sweeps over positions, and over velocities where something bounces."""
