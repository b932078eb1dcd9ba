"""Tuples of particles solved: sweeps over positions and velocities, and what is read of them."""
