"""Time integration: one class a method, each saying what happens around the forces."""

from __future__ import annotations

from ... import validate
from ...scene.settings import INTEGRATORS, Settings
from .integrator import Integrator
from .symplectic_euler import SymplecticEuler
from .velocity_verlet import VelocityVerlet
from .yoshida4 import Yoshida4
from .yoshida6 import Yoshida6

ROUNDING = 1e-12  # of the sum of the stages

METHODS: dict[str, type[Integrator]] = dict(
    zip(INTEGRATORS, (SymplecticEuler, VelocityVerlet, Yoshida4, Yoshida6), strict=True)
)


def method(settings: Settings) -> type[Integrator]:
    """The class that settings name or give.

    Raises:
        TypeError: A class that is no Integrator. ValueError: Stages that do not make a substep.
    """
    given = settings.integrator
    if isinstance(given, str):
        return METHODS[given]
    if not issubclass(given, Integrator):
        raise TypeError(
            f"Settings: integrator must be a name or a subclass of Integrator, got {given!r}; "
            "derive it from particlesim.Integrator."
        )
    if abs(sum(given.stages) - 1.0) > ROUNDING:
        raise validate.fail(
            given.__name__, "stages", "add up to 1", given.stages, "give parts of a substep"
        )
    return given
