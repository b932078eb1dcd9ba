"""Histories: what a run measures of itself, frame by frame, and their plots."""
