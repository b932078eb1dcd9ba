"""Forces along given pairs: every particle gathers over its own bonds, so nothing collides."""

import functools

import warp as wp

from ..engine.loops import Periodicity, box_type, minimum_image
from ..precision import Precision, function, register, structure


@wp.struct
class Incidence:
    """Bonds of every particle that has some: row k is particle ``particle[k]``."""

    particle: wp.array(dtype=wp.int32)
    begin: wp.array(dtype=wp.int32)
    partner: wp.array(dtype=wp.int32)
    bond: wp.array(dtype=wp.int32)
    world: wp.array(dtype=wp.int32)


@functools.cache
def spring_type(precision: Precision):
    """Parameters of one spring."""
    names = ("stiffness", "rest_length", "damping")
    return structure(f"Spring_{precision.name}", {name: precision.scalar for name in names})


@functools.cache
def spring_kernels(precision: Precision, periodic: Periodicity) -> tuple[wp.Kernel, wp.Kernel]:
    """Forces and energies of damped springs."""
    vec3, real, Box = precision.vec3, precision.scalar, box_type(precision)
    Spring, image = spring_type(precision), minimum_image(precision, periodic)

    def extent(x_ij: vec3, i: int, j: int):
        # Coincident ends push apart along a fixed direction, equally and opposite.
        r = wp.length(x_ij)
        side = wp.where(i < j, real(-1.0), real(1.0))
        apart = r > real(0.0)
        n = wp.where(
            apart,
            x_ij / wp.where(apart, r, real(1.0)),
            vec3(real(0.48), real(0.6), real(0.64)) * side,
        )
        return n, r

    direction = function(extent)

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
            j = bonds.partner[e]
            s = springs[bonds.bond[e]]
            n, r = direction(image(x[i] - x[j], b), i, j)
            rate = wp.dot(v[i] - v[j], n)
            total = total - n * (s.stiffness * (r - s.rest_length) + s.damping * rate)
        f_io[i] = total

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
            j = bonds.partner[e]
            s = springs[bonds.bond[e]]
            _n, r = direction(image(x[i] - x[j], b), i, j)
            stretch = r - s.rest_length
            # Half to each end.
            energy_io[i] = energy_io[i] + wp.float64(real(0.25) * s.stiffness * stretch * stretch)
            virial_io[i] = virial_io[i] - wp.float64(real(0.5) * s.stiffness * stretch * r)

    return spring_force, spring_measure
