"""Tuning: the cheapest settings under a tolerance, found by searching."""
