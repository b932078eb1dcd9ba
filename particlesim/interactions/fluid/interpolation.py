"""SPH interpolation: a field of the particles, anywhere in space."""

from __future__ import annotations

from typing import Any

import numpy as np
import warp as wp

from ... import validate
from ...engine.execution.launch import launch
from ...engine.neighbors.cells import grid_over
from ...kernels.engine.neighbors.renewal import cell_coordinates_kernel
from ...kernels.interactions.fluid import sph as kernels
from .sph import SPH


def interpolate(sph: SPH, points: Any, field: Any, world: int, normalized: bool) -> np.ndarray:
    """See ``Simulation.interpolate``; ``sph`` is bound."""
    owner, model = "Simulation.interpolate", sph.model
    where = validate.rows(owner, "points", points, None, 3)
    if validate.whole(owner, "world", world) >= model.world_count:
        raise validate.fail(
            owner, "world", f"be from 0 to {model.world_count - 1}", world, "choose one of these"
        )
    slots = slice(int(sph.pairs.begin_host[world]), int(sph.pairs.end_host[world]))
    sph.update_density()
    order = sph.pairs.order.numpy()[slots]
    values = _values(sph, owner, field, world, order)
    width = values.shape[1] if values.ndim == 2 else None
    sums = np.zeros((len(where), 4))
    if len(where) and len(order):
        mass, density = sph.slot_state.numpy()[slots, :2].astype(np.float64).T
        samples = np.zeros((len(order), 4))
        samples[:, : width or 1] = values.reshape(len(order), -1)
        samples[:, 3] = 1.0
        sums = _sums(sph, world, slots, where, samples * (mass / density)[:, None])
    if normalized:
        weight = sums[:, 3:]
        sums = np.divide(sums, weight, out=np.zeros_like(sums), where=weight > 0)
    return sums[:, 0] if width is None else sums[:, :width]


def _values(sph: SPH, owner: str, field: Any, world: int, order: np.ndarray) -> np.ndarray:
    """Values of the fluid's particles in slot order, (n,) or (n, 3)."""
    model, members = sph.model, np.sort(order)
    first, last = (int(edge) for edge in model.offsets[world : world + 2])
    if isinstance(field, str):
        names = sorted({*sph.state.arrays, *model.attributes} - {"world", "time", "image"})
        validate.choice(owner, "field", field, names)
        if field in sph.state:
            return sph.state[field].numpy()[order].astype(np.float64)
        return model.column(field)[order]
    given = np.asarray(field.numpy() if hasattr(field, "numpy") else field)
    width = 3 if given.ndim == 2 else None
    count = len(given) if given.ndim else 0
    if count == last - first:
        rows = order - first
    elif count == len(members):
        rows = np.searchsorted(members, order)
    else:
        raise validate.fail(
            owner, "field", f"have a row for each of the fluid's {len(members)} particles",
            given.shape, "give (n,) or (n, 3) values in the order of the particles",
        )  # fmt: skip
    return validate.rows(owner, "field", given, count, width)[rows]


def _sums(sph: SPH, world: int, slots: slice, where: np.ndarray, samples: np.ndarray) -> np.ndarray:
    """The sums of (V A, V) W at the points, by a grid over the particles as they are now."""
    model, device = sph.model, sph.model.device
    precision = model.precision
    x = sph.pairs.fields["position"][slots]
    host = x.numpy().astype(np.float64)
    block = next(each for each in sph.pairs.blocks if each.world == world)
    own, widest = sph.lengths, sph.pairs.reach[world]
    sizes = wp.empty(0, dtype=precision.vector(2), device=device)
    if own is not None:
        sizes, widest = own.size[slots], own.widest(slots)
    grid, cells = grid_over(model, block, float(widest), host)
    cells.first = 0  # of the slots at hand
    points = model.array(model.wrapped(where, world)[0], precision.vec3)
    # Points out of reach look into the outermost cells, so that cell numbers stay small.
    reach = 1.1 * widest
    near = np.clip(points.numpy(), host.min(axis=0) - reach, host.max(axis=0) + reach)
    to_cells = cell_coordinates_kernel(precision)
    u_particles, u_points = wp.empty_like(x), wp.empty_like(points)
    launch(to_cells, len(x), [cells, x, u_particles], device)
    launch(to_cells, len(near), [cells, model.array(near, precision.vec3), u_points], device)
    grid.build(u_particles, 1.0)
    kinds = precision, model.periodic, sph.Params
    kernel = kernels.interpolation_kernel(sph.weight, *kinds, own is not None)
    sums = wp.zeros(len(points), dtype=precision.vector(4), device=device)
    launch(
        kernel, len(points),
        [grid.id, world, model.box, sph.params, x, model.array(samples, sums.dtype), sizes,
         points, u_points, sums],
        device,
    )  # fmt: skip
    return sums.numpy().astype(np.float64)
