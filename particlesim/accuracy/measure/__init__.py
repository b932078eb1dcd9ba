"""Measure: a number of a scene, with its error.

Runs are refined in time and space until Richardson's extrapolation settles, and repeated with other
seeds, or for longer, until chance is small enough.
"""
