"""Laws that scenes of faults and controls are made of."""

import numpy as np
import warp as wp

import particlesim as ps


@ps.law
def trap(position: wp.vec3, stiffness: float):
    return 0.5 * stiffness * wp.dot(position, position)


@ps.law
def quartic(position: wp.vec3, strength: float):
    r2 = wp.dot(position, position)
    return 0.25 * strength * r2 * r2


@ps.law
def stiffening(position: wp.vec3, time: float, rate: float):
    return -wp.exp(rate * time) * position


@ps.law
def pulse(time: float, start: float, length: float, push: float):
    on = wp.where(time >= start and time < start + length, push, 0.0)
    return wp.vec3(on, 0.0, 0.0)


@ps.law
def shaking(time: float, omega: float, strength: float):
    return wp.vec3(strength * wp.cos(omega * time), 0.0, 0.0)


@ps.law
def lorentz(velocity: wp.vec3, field: wp.vec3):
    return wp.cross(velocity, field)


@ps.law
def coriolis(velocity: wp.vec3, mass: float, spin: wp.vec3):
    return -2.0 * mass * wp.cross(spin, velocity)


@ps.law
def negative_drag(velocity: wp.vec3, rate: float):
    return rate * velocity


@ps.law
def cubic_drag(velocity: wp.vec3, rate: float):
    return -rate * wp.dot(velocity, velocity) * velocity


@ps.law
def wall(position: wp.vec3, stiffness: float, place: float):
    depth = wp.max(position[0] - place, 0.0)
    return 0.5 * stiffness * depth * depth


@ps.law
def yukawa(r: float, strength: float, screening: float):
    return strength * wp.exp(-r / screening) / r


@ps.law
def morse(r: float, depth: float, width: float, rest: float):
    e = 1.0 - wp.exp(-width * (r - rest))
    return depth * e * e


@ps.law
def grains(r: float, stiffness: float, diameter: float):
    return stiffness * wp.max(diameter - r, 0.0)


@ps.law
def wca(r: float, radius: float):
    s = 1.0 / (r * r * r * r * r * r)
    return wp.where(r < radius, 4.0 * (s * s - s) + 1.0, 0.0)


@ps.law
def coulomb(r: float, charge_i: float, charge_j: float):
    return charge_i * charge_j / r


@ps.law
def inverse_square(r: float, mass_i: float, mass_j: float, constant: float):
    return -constant * mass_i * mass_j / (r * r)


@ps.law
def inverse_cube(r: float, strength: float):
    return -strength / (r * r * r)


@ps.law
def from_charge(r: float, charge_i: float):
    return charge_i / (r * r)


@ps.law
def lopsided(r: float, charge_i: float, mass_j: float):
    return charge_i * mass_j / r


@ps.law
def root(position: wp.vec3, level: float):
    return wp.vec3(-wp.sqrt(level - position[0]), 0.0, 0.0)


@ps.law
def logarithm(r: float, scale: float):
    return wp.log(r - scale)


@ps.law
def pole(position: wp.vec3, place: float):
    return wp.vec3(1.0 / (position[0] - place), 0.0, 0.0)


@ps.law
def trap_force(position: wp.vec3, stiffness: float):
    return -stiffness * position


@ps.law
def twice_the_trap(position: wp.vec3, stiffness: float):
    return stiffness * wp.dot(position, position)


@ps.law
def swirl(position: wp.vec3, stiffness: float):
    return wp.vec3(-position[1], position[0], 0.0) * stiffness


@ps.law
def height(a: wp.vec3, level: float):
    return a[1] - level


@ps.law
def squared_distance(a: wp.vec3, b: wp.vec3, rest: float):
    return wp.dot(b - a, b - a) - rest * rest


def circle(radius=1.0, omega=1.0, count=1):
    """Positions of a particle that goes clockwise round the origin, of times."""

    def at(times):
        a = omega * np.asarray(times)
        x = radius * np.stack([np.cos(a), -np.sin(a), 0 * a], axis=1)
        return np.repeat(x[:, None, :], count, axis=1)

    return at
