"""Forces along given pairs: every particle gathers over its own bonds, so nothing collides."""

import functools
from typing import Any

import warp as wp

from ..engine.loops import Periodicity, box_type, minimum_image
from ..precision import APART, Precision, function, register, structure


@wp.struct
class Incidence:
    """Bonds of every particle that has some: row k is particle ``particle[k]``."""

    particle: wp.array(dtype=wp.int32)
    begin: wp.array(dtype=wp.int32)
    partner: wp.array(dtype=wp.int32)
    bond: wp.array(dtype=wp.int32)
    world: wp.array(dtype=wp.int32)


def spring_type(precision: Precision) -> Any:
    """Parameters of one spring."""
    names = ("stiffness", "rest_length", "damping")
    return structure(f"Spring_{precision.name}", {name: precision.scalar for name in names})


def bond_function(precision: Precision, periodic: Periodicity) -> wp.Function:
    """``view(i, e, bonds, box, x) -> (j, n, r)``: the partner in bond e, and where i is from it.

    Coincident ends push apart along a fixed direction, equally and opposite.
    """
    vec3, real, Box = precision.vec3, precision.scalar, box_type(precision)
    image, along = minimum_image(precision, periodic), vec3(*APART)

    def view(i: int, e: int, bonds: Incidence, box: Box, x: wp.array(dtype=vec3)):
        j = bonds.partner[e]
        x_ij = image(x[i] - x[j], box)
        r = wp.length(x_ij)
        side = wp.where(i < j, real(-1.0), real(1.0))
        apart = r > real(0.0)
        n = wp.where(apart, x_ij / wp.where(apart, r, real(1.0)), along * side)
        return j, n, r

    return function(view)


@functools.cache
def force_kernel(precision: Precision, periodic: Periodicity) -> wp.Kernel:
    """Kernel: forces of damped springs."""
    vec3, Box, Spring = precision.vec3, box_type(precision), spring_type(precision)
    view = bond_function(precision, periodic)

    @register
    def spring_force(
        first: int,
        bonds: Incidence,
        springs: wp.array(dtype=Spring),
        box: wp.array(dtype=Box),
        x: wp.array(dtype=vec3),
        v: wp.array(dtype=vec3),
        f_io: wp.array(dtype=vec3),
    ):
        k = first + wp.tid()
        i = bonds.particle[k]
        b = box[bonds.world[k]]
        total = f_io[i]
        for e in range(bonds.begin[k], bonds.begin[k + 1]):
            j, n, r = view(i, e, bonds, b, x)
            s = springs[bonds.bond[e]]
            rate = wp.dot(v[i] - v[j], n)
            total = total - n * (s.stiffness * (r - s.rest_length) + s.damping * rate)
        f_io[i] = total

    return spring_force


@functools.cache
def measure_kernel(precision: Precision, periodic: Periodicity) -> wp.Kernel:
    """Kernel: energies and virials of springs, half to each end."""
    vec3, real = precision.vec3, precision.scalar
    Box, Spring, view = (
        box_type(precision), spring_type(precision), bond_function(precision, periodic),
    )  # fmt: skip

    @register
    def spring_measure(
        first: int,
        bonds: Incidence,
        springs: wp.array(dtype=Spring),
        box: wp.array(dtype=Box),
        x: wp.array(dtype=vec3),
        energy_io: wp.array(dtype=wp.float64),
        virial_io: wp.array(dtype=wp.float64),
    ):
        k = first + wp.tid()
        i = bonds.particle[k]
        b = box[bonds.world[k]]
        for e in range(bonds.begin[k], bonds.begin[k + 1]):
            _j, _n, r = view(i, e, bonds, b, x)
            s = springs[bonds.bond[e]]
            stretch = r - s.rest_length
            energy_io[i] = energy_io[i] + wp.float64(real(0.25) * s.stiffness * stretch * stretch)
            virial_io[i] = virial_io[i] - wp.float64(real(0.5) * s.stiffness * stretch * r)

    return spring_measure
