"""Evaluations of constraints on tuples that are written by hand."""
