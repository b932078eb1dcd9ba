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
    """Base of equations of state P(rho) and P(rho, u), for those of one's own too.

    A member sets ``parameters``, a dict of numbers that may differ from world to world, and gives
    three laws, which return numbers and choose by ``wp.where``, ``wp.min`` or ``wp.max``:

    - ``pressure``: P [mass / (length time^2)];
    - ``energy``: u = int P / rho^2 drho per mass [length^2/time^2], the potential of the pressure:
      what diagnostics report, and what P must derive from for energy to be conserved;
    - ``sound_speed``: c = sqrt(dP/drho) [length/time], which bounds the step.

    Each may name ``density``, ``rest_density`` and ``smoothing_length`` of the ``SPH``, and the
    ``parameters``; ``sound_speed`` may name ``pressure`` too. If one names ``internal_energy``,
    particles have it as an attribute, and it goes on in time, as of :class:`IdealGas`.

    Example:
        A liquid that answers to compression in proportion, P = c^2 (rho - rho0):

        >>> @law
        ... def pressure(density: float, rest_density: float, speed: float):
        ...     return speed * speed * (density - rest_density)
        >>> @law
        ... def energy(density: float, rest_density: float, speed: float):
        ...     s = density / rest_density
        ...     return speed * speed * (wp.log(s) + 1.0 / s - 1.0)
        >>> @law
        ... def sound_speed(speed: float):
        ...     return speed
        >>> class Linear(EquationOfState):
        ...     pressure, energy, sound_speed = pressure, energy, sound_speed
        ...     def __init__(self, speed):
        ...         self.parameters = {"speed": speed}
        >>> oil = SPH(smoothing_length=0.1, rest_density=1.0, equation_of_state=Linear(30.0))
        >>> sorted(oil.parameters)
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


@law
def isothermal_pressure(density: float, sound_speed: float):
    return sound_speed * sound_speed * density


@law
def isothermal_energy(density: float, sound_speed: float):
    return sound_speed * sound_speed * wp.log(density)


@law
def isothermal_sound_speed(sound_speed: float):
    return sound_speed


class Isothermal(EquationOfState):
    """A gas of constant temperature, P = c^2 rho, storing u = c^2 ln(rho) per mass.

    u is 0 at a density of 1 in the scene's units: a constant that nothing but sums of u feels.

    Args:
        sound_speed: c [length/time], above 0.

    Example:
        >>> Isothermal(sound_speed=340.0).parameters
        {'sound_speed': 340.0}
    """

    pressure = isothermal_pressure
    energy = isothermal_energy
    sound_speed = isothermal_sound_speed

    def __init__(self, sound_speed: float) -> None:
        self.parameters = {
            "sound_speed": validate.number(
                self.name, "sound_speed", sound_speed, above=0.0, unit="length/time"
            )
        }


@law
def ideal_gas_pressure(density: float, internal_energy: float, gamma: float):
    return (gamma - 1.0) * density * wp.max(internal_energy, 0.0)


@law
def ideal_gas_energy(internal_energy: float):
    return internal_energy


@law
def ideal_gas_sound_speed(density: float, pressure: float, gamma: float):
    return wp.sqrt(gamma * pressure / density)


class IdealGas(EquationOfState):
    """P = (gamma - 1) rho u, where u is the internal energy per mass of each particle.

    Particles have it as an attribute, ``add_particles(..., internal_energy=u)``, and the work of
    pressure and viscosity on them changes it (Monaghan 1992):

        du_i/dt = sum_j m_j (P_i/rho_i^2 + Pi_ij/2) (v_i - v_j) . grad_i W_ij

    so that the sum of kinetic and internal energy stays, to round-off at any step where nothing
    else acts. The temperature is u times the specific heat. Diagnostics count m u as potential
    energy. Where a step too long takes u below 0, P is 0 there, and nothing cools it further;
    the next run warns.

    Args:
        gamma: Ratio of specific heats, above 1: 5/3 of one atom, 1.4 of two.

    Example:
        >>> from particlesim import Scene, Settings, Simulation
        >>> scene = Scene(periodic=((0, None, None), (1, None, None)))
        >>> x = [(k / 20, 0, 0) for k in range(20)]
        >>> gas = scene.add_particles(x, mass=1 / 20, internal_energy=2.5)
        >>> fluid = scene.add_interaction(
        ...     SPH(gas, smoothing_length=0.1, equation_of_state=IdealGas(1.4), dimension=1))
        >>> sim = Simulation(scene, Settings(dt=0.01), device="cpu")
        >>> sim.diagnostics().energy.round(4).tolist()
        [2.5]
    """

    pressure = ideal_gas_pressure
    energy = ideal_gas_energy
    sound_speed = ideal_gas_sound_speed

    def __init__(self, gamma: float) -> None:
        self.parameters = {"gamma": validate.number(self.name, "gamma", gamma, above=1.0)}
