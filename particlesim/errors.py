"""Errors that a running simulation raises; bad arguments are ``ValueError`` and ``TypeError``."""


class SimulationError(RuntimeError):
    """A simulation that cannot go on, with the particle, world, time and cause in the message."""
