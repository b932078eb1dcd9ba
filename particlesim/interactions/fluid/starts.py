"""What is to be said of a fluid's start: places, masses, lengths and sounds that do not fit."""

from __future__ import annotations

from typing import Any

import numpy as np
import warp as wp

from ...scene.scene import Scene
from ..particle import UniformGravity
from .equations_of_state import Tait
from .heat import ENERGY

# Parts of the rest density between which that of a start lies whose masses fit. Free surfaces halve
# it there, so what is dense is looked at: of a film of two layers nothing else is left.
LEAST_DENSE, MOST_DENSE, DENSE = 0.4, 1.4, 90
MANY = 0.02  # of the particles may have the largest smoothing length
CLUMPED = 0.01  # of them may be as dense; moved by half a spacing at random fewer are
# Of its density, what a particle makes by itself, in the median: at a spacing of h it is 0.4.
ALONE, NOBODY = 0.6, 0.999
SOFT = 1e-3  # of the stiffest, what presses on others as no liquid would: a solid among fluids
STIFF, NEARLY = 10.0, 1.01  # times the speeds in a liquid its sound is to have, but for rounding


def complaint(fluid: Any) -> str:
    """What is to be said of an ``SPH`` at the start; empty where it fits."""
    members = fluid.pairs.members_host
    if not len(members):
        return ""
    model, columns, number = fluid.model, fluid.by_member(), fluid.fluid_numbers()
    h = columns["smoothing_length"] = fluid.smoothing_lengths(members)
    rho, kinds = _densities(fluid)[members], range(len(fluid.fluids.groups))
    own = [number[members] == k for k in kinds]
    densities = (
        _of_density(fluid, members[k], rho[k], {name: each[k] for name, each in columns.items()})
        for k in own if k.any()
    )  # fmt: skip
    return (
        _of_energy(fluid, members)
        or model.unresolved(fluid.name, "smoothing_length", h, members)
        or _of_lengths(fluid)
        or _of_walls(fluid)
        or next(filter(None, densities), "")
        or _of_speed(fluid, members, columns)
    )


def gravity(scene: Scene) -> np.ndarray:
    """Of all that is in a scene, (3,) [length/time^2]."""
    fields = [each for each in scene.interactions if isinstance(each, UniformGravity)]
    return np.sum([each.parameters["acceleration"] for each in fields] or [np.zeros(3)], axis=0)


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


def _of_walls(fluid: Any) -> str:
    """A wall gives way to what starts a spacing behind it; what is farther has its face at 0."""
    if not fluid.walls:
        return ""
    behind = fluid.walls.distance.numpy() == 0.0
    slots = np.flatnonzero(behind.any(axis=1))
    if not len(slots):
        return ""
    row = int(fluid.pairs.order.numpy()[slots].min())
    walls = zip(fluid.walls.walls, fluid.walls.places, strict=True)
    names = {wall.name for wall, places in walls if behind[:, list(places)].any()}
    x = fluid.state.position.numpy()[row].round(6).tolist()
    return (
        f"{fluid.name}: position must be in front of {' and '.join(sorted(names))} [length], got "
        f"{len(slots)} of {len(behind)} particles more than a spacing behind, as particle {row} at "
        f"{x}; move them, or what is to hold them."
    )


def _of_density(
    fluid: Any, members: np.ndarray, rho: np.ndarray, columns: dict[str, np.ndarray]
) -> str:
    h, mass = columns["smoothing_length"], fluid.model.column("mass")[members]
    own = fluid.smoothing.sigma * fluid.smoothing.center
    alone = float(np.median(mass * own / h**fluid.dimension / rho))
    asked = any("rest_density" in each.parameters for each in fluid.equation_of_state.laws.values())
    shares = rho / columns["rest_density"] if asked else np.ones(len(rho))
    share = float(np.percentile(shares, DENSE))
    fits = LEAST_DENSE < share < MOST_DENSE
    unseen = bool((fluid.smoothing.support * h <= _spacing(fluid, members)).any())
    if alone > ALONE and (alone < NOBODY or share >= MOST_DENSE or unseen):
        return (
            f"{fluid.name}: smoothing_length must be above the spacing of the particles [length], "
            f"got {np.median(h):.4g}, at which each makes {alone:.0%} of its density by itself; "
            "give about 1.3 spacings or more."
        )
    dense = shares >= MOST_DENSE
    if dense.mean() > CLUMPED and np.median(shares) < MOST_DENSE:
        k = int(np.argmax(shares))
        return (
            f"{fluid.name}: position must leave particles a spacing apart [length], got "
            f"{dense.sum()} of {len(shares)} with {MOST_DENSE:g} of the rest density or more, "
            f"particle {members[k]} with {shares[k]:.3g} of it; seed every place once."
        )
    if fits:
        return ""
    given = float(np.median(mass))
    return (
        f"{fluid.name}: mass must make the rest density at the particles' spacing, got "
        f"{given:.4g}, which makes {share:.3g} of it; give about {given / share:.4g}."
    )


def _spacing(fluid: Any, members: np.ndarray) -> np.ndarray:
    """Of the lattice that its masses make at the rest density, of each; 0: not known."""
    return fluid.spacings[fluid.model.world_of[members]]


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
    """A liquid is to be slower than its sound by far; what drifts as a whole is not fast.

    Where it is held it will be as fast as what falls from its surface to its bottom.
    """
    if not isinstance(fluid.equation_of_state, Tait):
        return ""
    model, v = fluid.model, fluid.state.velocity.numpy().astype(np.float64)[members]
    world = model.world_of[members]
    count = np.maximum(np.bincount(world, minlength=model.world_count), 1)
    for axis in range(3):
        v[:, axis] -= (np.bincount(world, v[:, axis], model.world_count) / count)[world]
    speed, c = np.linalg.norm(v, axis=1), columns["state_sound_speed"]
    stiffness = columns["rest_density"] * c**2
    c = np.where(stiffness >= SOFT * stiffness.max(), c, np.inf)
    fall = _falls(fluid, members)[world]
    fastest = np.maximum(speed, fall)
    k = int(np.argmax(fastest / c))
    if STIFF * fastest[k] <= NEARLY * c[k]:
        return ""
    how = "at the start" if speed[k] >= fall[k] else "by a fall from its surface to its bottom"
    return (
        f"{fluid.name}: sound_speed must be about ten times the speeds in a liquid [length/time], "
        f"got {c[k]:.4g} with a speed of {fastest[k]:.4g} {how}; give about "
        f"{STIFF * fastest[k]:.3g}, or a Polytrope for a gas."
    )


def _falls(fluid: Any, members: np.ndarray) -> np.ndarray:
    """sqrt(2 g H) of each world's fluid, H how deep it lies along gravity [length/time]."""
    model, x = fluid.model, fluid.state.position.numpy().astype(np.float64)[members]
    found = np.zeros(model.world_count)
    if not (fluid.walls or model.column("pinned")[members].any()):
        return found  # it falls as a whole
    for w, scene in enumerate(model.scenes):
        own = x[model.world_of[members] == w] @ gravity(scene)  # g times the depth
        found[w] = np.sqrt(2.0 * np.ptp(own)) if len(own) else 0.0
    return found
