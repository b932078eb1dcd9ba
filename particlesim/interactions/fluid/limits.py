"""Limits of SPH: sound with viscosity, and acceleration."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np

from ...engine.limit import Limit
from ...engine.probe import Probe
from ...kernels.interactions.fluid.viscosity import SHIFT
from .smoothing.smoothing_function import Smoothing
from .viscosities import ArtificialViscosity, ParticleShifting

ACCELERATION = 0.25
ADVISED = 0.4  # of h / c, for accuracy (Monaghan 1992)
POINTS = 400  # of quadratures over the support
WAVENUMBERS = np.linspace(0.02, 8.0, 400)  # kappa = k h; k W_hat is largest near 1.8


def fluid_limits(part: Any, probe: Probe) -> list[Limit]:
    """The tightest of both kinds over the fluid, at present densities, speeds and accelerations.

    - sound: that of an oscillation omega = c max(k W_hat(k)) damped by gamma, where W_hat is the
      Fourier transform of W: summing the density smooths a wave by W_hat, and the gradient of the
      pressure again. Artificial viscosity damps by at most gamma = D (alpha c + 2 beta mu) / h
      (:func:`damping`), mu being the speed at which the fastest meets a typical particle; that of
      another viscosity is asked of its force.
    - acceleration: 0.25 sqrt(h / |a|) (Monaghan 1992).
    - speed, where substeps are adaptive: the time in which the fastest goes through the reach of
      one that it meets. It may meet nobody, but within a frame nobody asks again.
    - shifting: 2 over the rate at which :class:`ParticleShifting` evens out the concentration.
    """
    rows = part.pairs.members_host
    if not len(rows):
        return []
    each = part.by_member()
    c = _heard(part, probe, part.sound_speeds(probe))
    h = each["smoothing_length"] = part.smoothing_lengths(rows)
    omega = c * steepest(part.smoothing, part.dimension) / h
    gamma = _damping_rates(part, probe, each, c) + _spreading_rates(part, each, c)
    k = int(np.argmax(gamma + np.sqrt(gamma**2 + 4.0 * omega**2)))  # by either integrator
    reason = f"h = {h[k]:.4g}, c = {c[k]:.4g}, omega = {omega[k]:.4g} /s, gamma = {gamma[k]:.4g} /s"
    dt = probe.loop.integrator.largest_step(float(omega[k]) ** 2, float(gamma[k]))
    if c[k] > 0 and (advised := ADVISED * h[k] / c[k]) < dt:
        reason += f"; for accuracy {ADVISED} h / c = {advised:.3g} s is advised"
    limits = [Limit(part.name, "sound", dt, reason, *probe.place(int(rows[k])))]
    return (
        limits
        + acceleration_limit(part, probe, h, probe.acceleration[rows])
        + _speed_limit(part, probe, h)
        + _shifting_limit(part, probe, each)
    )


def acceleration_limit(
    part: Any, probe: Probe, h: np.ndarray, acceleration: np.ndarray
) -> list[Limit]:
    """0.25 sqrt(h / |a|), with the smoothing length and the acceleration of every member."""
    rows, a = part.pairs.members_host, np.linalg.norm(acceleration, axis=1)
    k = int(np.argmax(a / h))
    if a[k] == 0:
        return []
    reason = f"0.25 sqrt(h / a), h = {h[k]:.4g}, a = {a[k]:.4g}"
    dt = ACCELERATION * float(np.sqrt(h[k] / a[k]))
    return [Limit(part.name, "acceleration", dt, reason, *probe.place(int(rows[k])))]


def _speed_limit(part: Any, probe: Probe, h: np.ndarray) -> list[Limit]:
    """support h over the speed of the fastest and a typical one, in the frame of their world."""
    if not probe.settings.adaptive:
        return []
    speed = _meeting(part, probe)
    if not speed > 0.0:
        return []
    k = int(np.argmin(h))
    reach = part.smoothing.support * float(h[k])
    reason = f"reach / v, reach = {reach:.4g}, v = {speed:.4g} of two that meet"
    place = probe.place(int(part.pairs.members_host[k]))
    return [Limit(part.name, "speed", reach / speed, reason, *place)]


def _meeting(part: Any, probe: Probe) -> float:
    """The speed at which the fastest meets a typical particle."""
    speed = probe.relative_speed(part.pairs.members_host)
    return float(speed.max() + np.sqrt((speed**2).mean()))


def _heard(part: Any, probe: Probe, c: np.ndarray) -> np.ndarray:
    """Speeds of sound; of several fluids a light one's particles feel the stiffest at hand."""
    if not part.fluids.several:
        return c
    rows = part.pairs.members_host
    rho, world = probe.state.density.numpy()[rows].astype(np.float64), probe.model.world_of[rows]
    stiffest = np.zeros(probe.model.world_count)
    np.maximum.at(stiffest, world, rho * c**2)
    return np.sqrt(stiffest[world] / rho)


def _shifting_limit(part: Any, probe: Probe, each: dict[str, np.ndarray]) -> list[Limit]:
    """Of x' = -lambda x, lambda = 8 U / h kappa^2 W_hat (1 - W_hat / 2) of a wave: 2 / lambda.

    Volumes follow the density, whose wave is W_hat of that of the places; half of it is a mean's.
    """
    if not any(isinstance(viscosity, ParticleShifting) for viscosity in part.viscosity):
        return []
    speed, h = each["viscosity_speed"], each["smoothing_length"]
    k = int(np.argmax(speed / h))
    w = transform(part.smoothing, part.dimension)
    rate = SHIFT * float(speed[k] / h[k] * np.abs(WAVENUMBERS**2 * w * (1.0 - 0.5 * w)).max())
    if rate == 0.0:
        return []
    row = int(part.pairs.members_host[k])
    return [Limit(part.name, "shifting", 2.0 / rate, f"rate {rate:.4g} /s", *probe.place(row))]


def _damping_rates(
    part: Any, probe: Probe, each: dict[str, np.ndarray], c: np.ndarray
) -> np.ndarray:
    """gamma of every member."""
    forces = [each for each in part.viscosity if each.laws]
    if not forces:
        return np.zeros_like(c)
    if not (len(forces) == 1 and isinstance(forces[0], ArtificialViscosity)):
        with part.still():
            return np.full_like(c, probe.damping(part))
    strength = each["viscosity_alpha"] * c + 2.0 * each["viscosity_beta"] * _meeting(part, probe)
    return damping(part.smoothing, part.dimension) * strength / each["smoothing_length"]


def _spreading_rates(part: Any, each: dict[str, np.ndarray], c: np.ndarray) -> np.ndarray:
    """By how fast what evens out densities takes a wave away, which its gradients hardly see.

    lambda = 2 delta c h int (1 - cos k.x) |W'| / r d^dx, at most, of each member.
    """
    if part.density is None:
        return np.zeros_like(c)
    spread = 2.0 * spreading(part.smoothing, part.dimension) * each["density_diffusion"]
    return spread * c / each["smoothing_length"]


@functools.cache
def spreading(smoothing: Smoothing, dimension: int) -> float:
    """max over k of int (1 - cos k.x) |W'| / r d^dx h^2."""
    q, w = _samples(smoothing)
    slope = np.abs(np.gradient(w, q)) / q
    shell = slope * (
        _shells(0.0 * q, q, dimension) - _shells(WAVENUMBERS[:, None] * q, q, dimension)
    )
    return float(shell.sum(axis=1).max() * smoothing.support / POINTS)


def steepest(smoothing: Smoothing, dimension: int) -> float:
    """max of kappa W_hat(kappa), kappa = k h: the largest omega is that times c / h."""
    return float(np.abs(WAVENUMBERS * transform(smoothing, dimension)).max())


@functools.cache
def transform(smoothing: Smoothing, dimension: int) -> np.ndarray:
    """W_hat(k) = int W cos(k.x) d^dx, 1 at k = 0, at ``WAVENUMBERS`` / h."""
    q, w = _samples(smoothing)
    shell = _shells(WAVENUMBERS[:, None] * q, q, dimension)
    return (shell * w).sum(axis=1) * smoothing.support / POINTS


def _shells(angles: np.ndarray, q: np.ndarray, dimension: int) -> np.ndarray:
    """Of shells of radius q their surface times the mean of cos(k.x), for these k q."""
    if dimension == 1:
        return 2.0 * np.cos(angles)
    if dimension == 2:
        turn = (np.arange(64) + 0.5) * np.pi / 64
        return 2.0 * np.pi * q * np.cos(angles[..., None] * np.cos(turn)).mean(axis=-1)
    return 4.0 * np.pi * q**2 * np.sinc(angles / np.pi)


@functools.cache
def damping(smoothing: Smoothing, dimension: int) -> float:
    """D of gamma = D (alpha c + 2 beta mu) / h, an upper bound by Gershgorin's circles.

    A pair that approaches damps v_ij along x_ij at the rate m h (alpha c + 2 beta mu) |W'| r / (rho
    (r^2 + 0.01 h^2)). Summed over all neighbours, 1/d of each along a direction, twice for the row
    of the matrix: D = 2/d int |W'| r / (r^2 + 0.01 h^2) d^dx h^2.
    """
    q, w = _samples(smoothing)
    surface = {1: 2.0, 2: 2.0 * np.pi, 3: 4.0 * np.pi}[dimension]
    rate = np.abs(np.gradient(w, q)) * q**dimension / (q**2 + 0.01)
    return float(2.0 / dimension * surface * rate.sum() * smoothing.support / POINTS)


def _samples(smoothing: Smoothing) -> tuple[np.ndarray, np.ndarray]:
    """Midpoints q and W h^d there."""
    q = (np.arange(POINTS) + 0.5) * smoothing.support / POINTS
    return q, smoothing.sigma * smoothing.at(q)
