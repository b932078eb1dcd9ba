"""Thermostats: heat baths that particles exchange energy with, one file a kind."""
