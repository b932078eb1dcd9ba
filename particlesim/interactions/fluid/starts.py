"""What is to be said of a fluid's start: masses, smoothing lengths and sounds that do not fit."""

from __future__ import annotations

from typing import Any

import numpy as np
import warp as wp

from .equations_of_state import Tait
from .heat import ENERGY

# Parts of the rest density between which that of a start lies whose masses fit. Free surfaces halve
# it there, so what is dense is looked at: of a film of two layers nothing else is left.
LEAST_DENSE, MOST_DENSE, DENSE = 0.4, 1.4, 90
MANY = 0.02  # of the particles may have the largest smoothing length
# Of its density, what a particle makes by itself, in the median: at a spacing of h it is 0.4.
ALONE, NOBODY = 0.6, 0.999


def complaint(fluid: Any) -> str:
    """What is to be said of an ``SPH`` at the start; empty where it fits."""
    members = fluid.pairs.members_host
    if not len(members):
        return ""
    model, columns, number = fluid.model, fluid.by_member(), fluid.fluid_numbers()
    h = columns["smoothing_length"] = fluid.smoothing_lengths(members)
    own = [number[members] == k for k in range(len(fluid.fluids.groups))]
    densities = (
        _of_density(fluid, members[each], {name: column[each] for name, column in columns.items()})
        for each in own if each.any()
    )  # fmt: skip
    return (
        _of_energy(fluid, members)
        or model.unresolved(fluid.name, "smoothing_length", h, members)
        or _of_lengths(fluid)
        or next(filter(None, densities), "")
        or _of_speed(fluid, members, columns)
    )


def _of_energy(fluid: Any, members: np.ndarray) -> str:
    """The start is one of a run, perhaps of one that went before."""
    if not fluid.hot:
        return ""
    u = fluid.state[ENERGY].numpy()[members]
    if not (u < 0).any():
        return ""
    return (
        f"{fluid.name}: {ENERGY} must be at least 0 [length^2/time^2], got {u.min():.4g} in "
        f"particle {members[u.argmin()]}, and below 0 in {(u < 0).sum()} of {len(u)}, whose "
        "pressure is 0; give a shorter substep."
    )


def _of_lengths(fluid: Any) -> str:
    """Some that fly off by themselves may well have the largest length."""
    if fluid.lengths is None:
        return ""
    bound = fluid.lengths.at_bound()
    if bound.mean() <= MANY:
        return ""
    return (
        f"{fluid.name}: largest must be above the smoothing lengths that densities ask for "
        f"[length], got {fluid.lengths.most.max():.4g}, which {bound.sum()} of {len(bound)} "
        "particles have; give AdaptiveSmoothing a larger one."
    )


def _of_density(fluid: Any, members: np.ndarray, columns: dict[str, np.ndarray]) -> str:
    rho = _densities(fluid)[members]
    h, mass = columns["smoothing_length"], fluid.model.column("mass")[members]
    own = fluid.smoothing.sigma * fluid.smoothing.center
    alone = float(np.median(mass * own / h**fluid.dimension / rho))
    asked = any("rest_density" in each.parameters for each in fluid.equation_of_state.laws.values())
    share = float(np.percentile(rho / columns["rest_density"], DENSE)) if asked else 1.0
    fits = LEAST_DENSE < share < MOST_DENSE
    if alone > ALONE and (alone < NOBODY or share >= MOST_DENSE):
        return (
            f"{fluid.name}: smoothing_length must be above the spacing of the particles [length], "
            f"got {np.median(h):.4g}, at which each makes {alone:.0%} of its density by itself; "
            "give about 1.3 spacings or more."
        )
    if fits:
        return ""
    given = float(np.median(mass))
    return (
        f"{fluid.name}: mass must make the rest density at the particles' spacing, got "
        f"{given:.4g}, which makes {share:.3g} of it; give about {given / share:.4g}."
    )


def _densities(fluid: Any) -> np.ndarray:
    """Sums at the present positions, of all particles; the state's densities stay."""
    if fluid.continuity is not None:
        return fluid.continuity.summed(fluid.weight)
    kept = [(each, wp.clone(each)) for each in (fluid.state.density, fluid.state.pressure)]
    fluid.update_density()
    rho = fluid.state.density.numpy().astype(np.float64)
    for array, before in kept:
        wp.copy(array, before)
    return rho


def _of_speed(fluid: Any, members: np.ndarray, columns: dict[str, np.ndarray]) -> str:
    """A liquid is to be slower than its sound by far; what drifts as a whole is not fast."""
    if not isinstance(fluid.equation_of_state, Tait):
        return ""
    model, v = fluid.model, fluid.state.velocity.numpy().astype(np.float64)[members]
    world = model.world_of[members]
    count = np.maximum(np.bincount(world, minlength=model.world_count), 1)
    for axis in range(3):
        v[:, axis] -= (np.bincount(world, v[:, axis], model.world_count) / count)[world]
    speed, c = np.linalg.norm(v, axis=1), columns["state_sound_speed"]
    k = int(np.argmax(speed / c))
    if speed[k] <= c[k]:
        return ""
    return (
        f"{fluid.name}: sound_speed must be about ten times the speeds in a liquid [length/time], "
        f"got {c[k]:.4g} with a speed of {speed[k]:.4g} at the start; give about "
        f"{10 * speed[k]:.2g}, or a Polytrope for a gas."
    )
