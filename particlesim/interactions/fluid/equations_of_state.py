"""Equations of state: the pressure of a fluid from its density, with the energy it stores."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

import warp as wp

from ... import validate
from ...scene.law import Law, law


class FluidPart:
    """Base of what an ``SPH`` is made of: a member gives its laws, and the values they are fed."""

    law_names: tuple[str, ...]
    parameters: Mapping[str, Any] = MappingProxyType({})

    @property
    def name(self) -> str:
        """What reports and errors call it."""
        return type(self).__name__

    @property
    def laws(self) -> dict[str, Law]:
        """The laws by name.

        Raises:
            TypeError: One is missing, or no function.
        """
        for name in self.law_names:
            if not hasattr(self, name):
                wanted = ", ".join(self.law_names)
                raise TypeError(f"{self.name}: laws must be {wanted}, got no {name}; give it one.")
        return {name: law(getattr(self, name)) for name in self.law_names}


class EquationOfState(FluidPart):
    """Base of barotropic equations of state P(rho), for those of one's own too.

    A member sets ``parameters``, a dict of numbers that may differ from world to world, and gives
    three laws, which return numbers and choose by ``wp.where``, ``wp.min`` or ``wp.max``:

    - ``pressure``: P [mass / (length time^2)];
    - ``energy``: u = int P / rho^2 drho per mass [length^2/time^2], the potential of the pressure:
      what diagnostics report, and what P must derive from for energy to be conserved;
    - ``sound_speed``: c = sqrt(dP/drho) [length/time], which bounds the step.

    Each may name ``density``, ``rest_density`` and ``smoothing_length`` of the ``SPH``, and the
    ``parameters``; ``sound_speed`` may name ``pressure`` too.

    Example:
        >>> @law
        ... def pressure(density: float, speed: float):
        ...     return speed * speed * density
        >>> @law
        ... def energy(density: float, rest_density: float, speed: float):
        ...     return speed * speed * wp.log(density / rest_density)
        >>> @law
        ... def sound_speed(speed: float):
        ...     return speed
        >>> class Isothermal(EquationOfState):
        ...     pressure, energy, sound_speed = pressure, energy, sound_speed
        ...     def __init__(self, speed):
        ...         self.parameters = {"speed": speed}
        >>> gas = SPH(smoothing_length=0.1, rest_density=1.0, equation_of_state=Isothermal(300.0))
        >>> sorted(gas.parameters)
        ['rest_density', 'smoothing_length', 'state_speed']
    """

    pressure: Law
    energy: Law
    sound_speed: Law
    law_names = ("pressure", "energy", "sound_speed")


@law
def tait_pressure(density: float, rest_density: float, sound_speed: float, exponent: float):
    scale = sound_speed * sound_speed * rest_density / exponent
    return scale * (wp.pow(density / rest_density, exponent) - 1.0)


@law
def tait_energy(density: float, rest_density: float, sound_speed: float, exponent: float):
    s = density / rest_density
    stored = (wp.pow(s, exponent - 1.0) - 1.0) / (exponent - 1.0) + 1.0 / s - 1.0
    return sound_speed * sound_speed / exponent * stored


@law
def tait_sound_speed(
    density: float, pressure: float, rest_density: float, sound_speed: float, exponent: float
):
    """c^2 = gamma (P + B) / rho, which spares the power."""
    return wp.sqrt((exponent * pressure + sound_speed * sound_speed * rest_density) / density)


@law
def repulsive_tait_pressure(
    density: float, rest_density: float, sound_speed: float, exponent: float
):
    return tait_pressure(wp.max(density, rest_density), rest_density, sound_speed, exponent)


@law
def repulsive_tait_energy(density: float, rest_density: float, sound_speed: float, exponent: float):
    return tait_energy(wp.max(density, rest_density), rest_density, sound_speed, exponent)


@law
def repulsive_tait_sound_speed(
    density: float, pressure: float, rest_density: float, sound_speed: float, exponent: float
):
    return tait_sound_speed(
        wp.max(density, rest_density), pressure, rest_density, sound_speed, exponent
    )


class Tait(EquationOfState):
    """A slightly compressible liquid, P = B ((rho/rho0)^gamma - 1), B = c^2 rho0 / gamma.

    Stores u = c^2/gamma ((s^(gamma-1) - 1)/(gamma - 1) + 1/s - 1), s = rho/rho0, from u = 0 at
    rest (Cole 1948; Monaghan 1994). Density varies by about (speed/c)^2: choose c ten
    times the largest speed for one percent, and so the step (see ``SPH``).

    Args:
        sound_speed: c at the rest density [length/time], above 0.
        exponent: gamma, above 1. 7 is water's; small ones are softer under compression.
        negative_pressure: False: P = 0 below the rest density. A density that is summed over
            particles falls to about half at a free surface, where there is nothing to sum over;
            tension there would pull the surface into clumps (Monaghan 2000), so a liquid with a
            surface, at rest or breaking, wants none. True keeps the tension, for a fluid that
            fills its box.

    Example:
        >>> water = Tait(sound_speed=30.0)
        >>> water.parameters
        {'sound_speed': 30.0, 'exponent': 7.0}
    """

    def __init__(
        self, sound_speed: float, exponent: float = 7.0, negative_pressure: bool = False
    ) -> None:
        self.parameters = {
            "sound_speed": validate.number(
                self.name, "sound_speed", sound_speed, above=0.0, unit="length/time"
            ),
            "exponent": validate.number(self.name, "exponent", exponent, above=1.0),
        }
        self.negative_pressure = bool(negative_pressure)
        if self.negative_pressure:
            self.pressure, self.energy = tait_pressure, tait_energy
            self.sound_speed = tait_sound_speed
        else:
            self.pressure, self.energy = repulsive_tait_pressure, repulsive_tait_energy
            self.sound_speed = repulsive_tait_sound_speed


@law
def polytrope_pressure(density: float, constant: float, index: float):
    return constant * density * wp.pow(density, 1.0 / index)


@law
def polytrope_energy(density: float, constant: float, index: float):
    return constant * index * wp.pow(density, 1.0 / index)


@law
def polytrope_sound_speed(density: float, pressure: float, index: float):
    return wp.sqrt((1.0 + 1.0 / index) * pressure / density)


class Polytrope(EquationOfState):
    """A gas of constant entropy, P = K rho^((n+1)/n), storing u = n K rho^(1/n) per mass.

    (Chandrasekhar 1939, ch. IV.)

    Args:
        constant: K, above 0.
        index: n, above 0; the adiabatic exponent is 1 + 1/n.

    Example:
        >>> Polytrope(constant=2.0, index=1.0).parameters
        {'constant': 2.0, 'index': 1.0}
    """

    pressure = polytrope_pressure
    energy = polytrope_energy
    sound_speed = polytrope_sound_speed

    def __init__(self, constant: float, index: float = 1.0) -> None:
        self.parameters = {
            "constant": validate.number(self.name, "constant", constant, above=0.0),
            "index": validate.number(self.name, "index", index, above=0.0),
        }
