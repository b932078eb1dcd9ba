"""Tuples of particles solved: all at once, by velocities, and what they are off by."""
