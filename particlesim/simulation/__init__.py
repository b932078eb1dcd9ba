"""The simulation: a face over the rooms below, none of which knows it."""
