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
        first: int, constant: wp.array(dtype=wp.float64), world: wp.array(dtype=wp.int32),
        field: wp.array(dtype=vec3), f_io: wp.array(dtype=vec3),
    ):  # fmt: skip
        i = first + wp.tid()
        f_io[i] = f_io[i] + vec3(constant[world[i]] * wp.vec3d(field[i]))

    @register
    def add_energies(
        first: int, constant: wp.array(dtype=wp.float64), world: wp.array(dtype=wp.int32),
        smooth: wp.array(dtype=wp.vec2d), total: wp.array(dtype=wp.float64),
        charge: wp.array(dtype=real), raw: wp.array(dtype=wp.float64),
        near: wp.array(dtype=wp.float64), own: wp.float64, background: wp.float64,
        energy_io: wp.array(dtype=wp.float64),
    ):  # fmt: skip
        """What charges have by themselves is taken out, and what neutralises them."""
        i = first + wp.tid()
        w = world[i]
        q = wp.float64(charge[i])
        alone = own * q * smooth[w][0] + background * total[w] * smooth[w][1]
        u = constant[w] * (raw[i] - wp.float64(0.5) * q * alone)
        energy_io[i] = energy_io[i] + near[i] + u

    return SimpleNamespace(take=take_charges, force=add_forces, energy=add_energies)


@register
def weigh_waves(
    first: int, weight: wp.array(dtype=wp.float64), re_io: wp.array(dtype=wp.float64),
    im_io: wp.array(dtype=wp.float64),
):  # fmt: skip
    k = first + wp.tid()
    re_io[k] = re_io[k] * weight[k]
    im_io[k] = im_io[k] * weight[k]
