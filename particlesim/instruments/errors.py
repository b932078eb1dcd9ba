"""Errors that a running simulation raises; bad arguments are ``ValueError`` and ``TypeError``."""


class SimulationError(RuntimeError):
    """A simulation that cannot go on, with the particle, world, time and cause in the message."""


class SimulationWarning(UserWarning):
    """A world went wrong and the simulation goes on: what ``sim.incidents`` has, as it happens."""
