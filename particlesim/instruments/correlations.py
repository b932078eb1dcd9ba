"""Correlations: of places with each other, and of places and velocities with earlier ones."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import warp as wp

from .. import validate
from ..engine.execution.launch import launch
from ..engine.source import Source
from ..kernels.instruments.distances import distances_kernel
from ..scene.group import Group


@dataclass(frozen=True)
class RadialDistribution:
    """g(r) of every world: ``distance`` (bins,), the middles of the bins [length], and ``value``
    (worlds, bins).
    """

    distance: np.ndarray
    value: np.ndarray


def radial_distribution(
    sim: Source,
    group: Any = None,
    other: Any = None,
    *,
    bins: int = 100,
    reach: float | None = None,
) -> RadialDistribution:
    """g(r): how many particles are at a distance, over how many were there if none cared.

    g = V n_b / (N_a N_b' V_b), with n_b pairs of a centre and another particle in a shell of the
    volume V_b, and N_b' = N_b less the centre where it is among the others (Allen and Tildesley
    1987, section 6.2). It is 1 for an ideal gas. All pairs are looked at, on the device.

    Args:
        sim: The simulation, periodic along all axes.
        group: The centres; None: all particles.
        other: Which are counted about them; None: the same.
        bins: How many shells, equally thick.
        reach: Outer radius of the last [length], at most half the shortest side of a box; None:
            that.

    Raises:
        ValueError: An axis is open, or the reach is longer.

    Example:
        >>> from particlesim import Scene, Settings, Simulation, sample
        >>> scene = Scene(periodic=((0, 0, 0), (4, 4, 4)))
        >>> atoms = scene.add_particles(sample.lattice("sc", (4, 4, 4), 1.0))
        >>> g = radial_distribution(Simulation(scene, device="cpu"), bins=4)
        >>> float(g.distance[2]), (g.value[0] > 0).tolist()
        (1.25, [False, False, True, True])
    """
    owner, model = "radial_distribution", sim.model
    bins = validate.whole(owner, "bins", bins, minimum=1)
    most = _reach(sim, owner, reach)
    centres = _members(sim, group, owner)
    others = centres if other is None else _members(sim, other, owner)
    world, apart = model.world_of[centres], model.world_of[others]
    begin = np.searchsorted(apart, np.arange(model.world_count + 1))
    count = wp.zeros(model.world_count * bins, dtype=wp.int64, device=model.device)
    inputs = [
        *(model.array(each.astype(np.int32), wp.int32) for each in (centres, world, others, begin)),
        model.box, sim.state.position, most, bins, count,
    ]  # fmt: skip
    kernel = distances_kernel(model.precision, model.periodic)
    launch(kernel, len(centres), inputs, model.device)
    edges = np.linspace(0.0, most, bins + 1)
    shells = 4.0 / 3.0 * np.pi * np.diff(edges**3)
    here = np.isin(centres, others)
    pairs = np.bincount(world, np.diff(begin)[world] - here, model.world_count)
    density = pairs / model.box_length.prod(axis=1)
    expected = density[:, None] * shells
    found = count.numpy().astype(np.float64).reshape(-1, bins)
    value = np.divide(found, expected, out=np.zeros_like(found), where=expected > 0)
    return RadialDistribution(0.5 * (edges[1:] + edges[:-1]), value)


def _reach(sim: Source, owner: str, reach: float | None) -> float:
    """The reach, checked; by default half of the shortest side of a box."""
    length = sim.model.box_length
    if not (length > 0).all():
        raise validate.fail(
            owner, "scene", "be periodic along all axes", list(sim.model.periodic),
            "without a volume there is no density to compare with",
        )  # fmt: skip
    half = 0.5 * float(length.min())
    # A side may have been rounded on the way.
    return validate.number(
        owner, "reach", half if reach is None else reach, above=0.0, maximum=half * (1 + 1e-9)
    )


def mean_square_displacement(sim: Source, group: Any = None, since: Any = None) -> np.ndarray:
    """<|x(t) - x(0)|^2> [length^2], (worlds,): over time 6 D t of what diffuses in space.

    Paths go on across the faces of a periodic box.

    Args:
        sim: The simulation.
        group: Which particles; None: all.
        since: Places at time 0, (n, 3) as ``sim.state.unwrapped()`` had them; None: the start.

    Example:
        >>> from particlesim import Scene, Settings, Simulation
        >>> scene = Scene(periodic=((0, 0, 0), (1, 1, 1)))
        >>> atom = scene.add_particles([(0, 0, 0)], velocity=(3, 0, 0))
        >>> sim = Simulation(scene, Settings(dt=0.5, precision="float64"), device="cpu")
        >>> sim.run(4)
        >>> mean_square_displacement(sim).round(9).tolist()
        [36.0]
    """
    start = _rows(sim, "mean_square_displacement", "position", since)
    moved = sim.state.unwrapped() - start
    return _mean(sim, "mean_square_displacement", (moved**2).sum(axis=1), group)


def velocity_autocorrelation(sim: Source, group: Any = None, since: Any = None) -> np.ndarray:
    """<v(t) . v(0)> [length^2/time^2], (worlds,): its integral over time is 3 D (Green 1954).

    Args:
        sim: The simulation.
        group: Which particles; None: all.
        since: Velocities at time 0, (n, 3) as ``sim.velocity`` had them; None: the start.

    Example:
        >>> from particlesim import Scene, Settings, Simulation
        >>> scene = Scene()
        >>> atoms = scene.add_particles([(0, 0, 0), (1, 0, 0)], velocity=[(3, 0, 0), (0, 4, 0)])
        >>> velocity_autocorrelation(Simulation(scene, device="cpu")).tolist()
        [12.5]
    """
    start = _rows(sim, "velocity_autocorrelation", "velocity", since)
    now = sim.get("velocity").astype(np.float64)
    return _mean(sim, "velocity_autocorrelation", (now * start).sum(axis=1), group)


def _members(sim: Source, group: Any, owner: str) -> np.ndarray:
    """Rows of what ``group`` is in every world; a group stands for all of its name."""
    if isinstance(group, Group) and any(group.scene is scene for scene in sim.scenes):
        group = group.name
    return sim.model.members([group] * sim.model.world_count, owner)


def _rows(sim: Source, owner: str, name: str, since: Any) -> np.ndarray:
    """What there was at time 0, (n, 3)."""
    if since is None:
        return sim.model.column(name)
    return validate.rows(owner, "since", since, sim.model.particle_count, 3)


def _mean(sim: Source, owner: str, values: np.ndarray, group: Any) -> np.ndarray:
    """Over the particles of each world; 0 where there is none."""
    model = sim.model
    members = _members(sim, group, owner)
    world = model.world_of[members]
    count = np.bincount(world, minlength=model.world_count)
    return np.bincount(world, values[members], model.world_count) / np.maximum(count, 1)
