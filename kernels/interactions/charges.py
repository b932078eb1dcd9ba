"""What an Ewald sum takes of the particles, and gives them."""

import functools
from types import SimpleNamespace

import warp as wp

from ..precision import Precision, register


@functools.cache
def charge_kernels(precision: Precision) -> SimpleNamespace:
    """Kernels over particles: the charges that take part, and forces of fields of unit constant."""
    vec3, real = precision.vec3, precision.scalar

    @register
    def take_charges(
        first: int, charge: wp.array(dtype=real), part: wp.array(dtype=real),
        taken_out: wp.array(dtype=real),
    ):  # fmt: skip
        i = first + wp.tid()
        taken_out[i] = charge[i] * part[i]

    @register
    def add_forces(
        first: int, constant: wp.array(dtype=real), world: wp.array(dtype=wp.int32),
        field: wp.array(dtype=vec3), f_io: wp.array(dtype=vec3),
    ):  # fmt: skip
        i = first + wp.tid()
        f_io[i] = f_io[i] + constant[world[i]] * field[i]

    @register
    def add_energies(
        first: int, constant: wp.array(dtype=real), world: wp.array(dtype=wp.int32),
        own: wp.array(dtype=wp.float64), near: wp.array(dtype=wp.float64),
        energy_io: wp.array(dtype=wp.float64), virial_io: wp.array(dtype=wp.float64),
    ):  # fmt: skip
        """Coulomb energy is homogeneous of degree -1, whose virial it therefore is."""
        i = first + wp.tid()
        u = near[i] + wp.float64(constant[world[i]]) * own[i]
        energy_io[i] = energy_io[i] + u
        virial_io[i] = virial_io[i] + u

    return SimpleNamespace(take=take_charges, force=add_forces, energy=add_energies)
