"""Stress: does a scene hold at the extremes of its knobs and of its state, or does it say so?"""
