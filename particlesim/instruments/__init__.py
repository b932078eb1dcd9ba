"""Instruments: what is measured of a simulation, and what watches over it."""
