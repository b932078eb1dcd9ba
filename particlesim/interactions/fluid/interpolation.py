"""SPH interpolation: a field of the particles and its derivatives, anywhere in space."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np
import warp as wp

from ... import validate
from ...engine.execution.launch import launch
from ...engine.neighbors.cells import grid_over
from ...kernels.engine.neighbors.renewal import cell_coordinates_kernel
from ...kernels.interactions.fluid import interpolation as kernels
from ..pair_loop import PairLoop
from .sph import SPH

OWNER = "Simulation.interpolate"
VECTORS = ("divergence", "curl")  # of vectors only
DERIVATIVES = ("gradient", *VECTORS, "laplacian")
# Of the gradient dA_a/dx_b in a row, 3 a + b.
DIVERGENCE = np.zeros((3, 9))
DIVERGENCE[0, [0, 4, 8]] = 1.0
CURL = np.zeros((3, 9))
CURL[[0, 1, 2], [7, 2, 3]], CURL[[0, 1, 2], [5, 6, 1]] = 1.0, -1.0
OF_GRADIENT = {"gradient": np.eye(3, 9), "divergence": DIVERGENCE, "curl": CURL}


def interpolate(
    sph: SPH, points: Any, field: Any, world: int, normalized: bool, derivative: str | None
) -> np.ndarray | wp.array:
    """See ``Simulation.interpolate``; ``sph`` is bound."""
    if validate.whole(OWNER, "world", world) >= sph.model.world_count:
        raise validate.fail(
            OWNER, "world", f"be from 0 to {sph.model.world_count - 1}", world,
            "choose one of these",
        )  # fmt: skip
    if derivative is not None:
        validate.choice(OWNER, "derivative", derivative, DERIVATIVES)
        if sph.lengths is not None:
            raise validate.fail(
                OWNER, "derivative", "be None of a fluid with an AdaptiveSmoothing", derivative,
                "give it one smoothing_length",
            )  # fmt: skip
    at = None if points is None else _points(sph, points, world)
    sph.update_density()
    of = _Field(sph, field, world)
    if derivative in VECTORS and not of.vector:
        raise validate.fail(
            OWNER, "field", f"be a vector, to have a {derivative}", field, "ask for its gradient"
        )
    samples = of.derived(derivative, normalized)
    if at is None and derivative is not None:
        found = of.gathered(samples, of.slots_of_members)
    else:
        if at is None:
            at = of.combined(np.eye(3), of.members, sph.state.position)
        found = of.summed(samples, at, normalized)
    width = 1 if derivative == "divergence" or not (of.vector or derivative == "gradient") else 3
    shape = (3, 3) if len(found.dtype()) == 9 else (3,) if width == 3 else ()
    if isinstance(points if points is not None else field, wp.array):
        return _on_device(of, found, shape)
    rows = found.numpy().astype(np.float64)
    return rows[:, 0] if shape == () else rows.reshape(len(rows), *shape)


def _points(sph: SPH, points: Any, world: int) -> wp.array:
    """Points in an array of their own, wrapped into the box."""
    model = sph.model
    if isinstance(points, wp.array):
        _check_array(sph, "points", points, (model.precision.vec3,))
        return wp.clone(points)
    where = validate.rows(OWNER, "points", points, None, 3)
    return model.array(model.wrapped(where, world)[0], model.precision.vec3)


def _check_array(sph: SPH, argument: str, given: wp.array, kinds: tuple[Any, ...]) -> None:
    names = " or ".join(kind.__name__ for kind in kinds)
    alike = any(wp.types.types_equal(given.dtype, kind) for kind in kinds)
    if given.ndim != 1 or not alike or given.device != sph.model.device:
        raise validate.fail(
            OWNER, argument, f"be (n,) of {names} on {sph.model.device}, where it is a Warp array",
            f"{given.shape} of {given.dtype.__name__} on {given.device}", "give such, or NumPy's",
        )  # fmt: skip


def _on_device(of: _Field, found: wp.array, shape: tuple[int, ...]) -> wp.array:
    """As an array of numbers, vectors or matrices."""
    precision = of.sph.model.precision
    if shape == ():
        return of.combined(np.eye(1, 3), np.arange(len(found)), found).view(precision.scalar)
    return found if shape == (3,) else found.view(precision.mat33)


class _Field:
    """A field of the fluid in one world, as 3-vectors in the slots of the fluid."""

    def __init__(self, sph: SPH, field: Any, world: int) -> None:
        self.sph, self.world, model, pairs = sph, world, sph.model, sph.pairs
        self.slots = slice(int(pairs.begin_host[world]), int(pairs.end_host[world]))
        order = pairs.order.numpy()[self.slots]
        self.members = np.sort(order)
        self.slots_of_members = self.slots.start + np.argsort(order, kind="stable")
        first, last = (int(edge) for edge in model.offsets[world : world + 2])
        given = self._given(field, slice(first, last))
        rows = order - first
        if len(given) != last - first:
            rows = np.searchsorted(self.members, order)
        self.vector = len(given.dtype()) == 3
        self.values = pairs.array(model.precision.vec3)
        if len(order):
            of = np.eye(3, len(given.dtype()))
            self.combined(of, rows, given, self.values[self.slots])

    def _given(self, field: Any, particles: slice) -> wp.array:
        """The field's values, of all particles of the world or of the fluid's."""
        sph, model = self.sph, self.sph.model
        precision = model.precision
        if isinstance(field, str):
            names = sorted({*sph.state.arrays, *model.attributes} - {"world", "time", "image"})
            validate.choice(OWNER, "field", field, names)
            column = sph.state[field].numpy() if field in sph.state else model.column(field)
            return self._array(column[particles])
        counts = (particles.stop - particles.start, len(self.members))
        if isinstance(field, wp.array):
            _check_array(sph, "field", field, (precision.scalar, precision.vec3))
        given = field if isinstance(field, wp.array) else np.asarray(field)
        count = len(given) if given.ndim else 0
        if count not in counts:
            raise validate.fail(
                OWNER, "field", f"have a row for each of the fluid's {counts[1]} particles",
                given.shape, "give (n,) or (n, 3) values in the order of the particles",
            )  # fmt: skip
        if isinstance(given, np.ndarray):
            width = 3 if given.ndim == 2 else None
            return self._array(validate.rows(OWNER, "field", given, count, width))
        return given if given.dtype is precision.vec3 else given.view(precision.vector(1))

    def _array(self, column: np.ndarray) -> wp.array:
        width = 3 if column.ndim == 2 else 1
        kind = self.sph.model.precision.vector(width)
        return self.sph.model.array(column.reshape(-1, width), kind)

    def combined(
        self, of: np.ndarray, rows: np.ndarray, values: wp.array, out: wp.array | None = None
    ) -> wp.array:
        """Combinations ``of`` the numbers in these rows."""
        model, (width, given) = self.sph.model, of.shape
        if out is None:
            kind = model.precision.vector(width)
            out = wp.empty(len(rows), dtype=kind, device=model.device)
        kernel = kernels.combination_kernel(model.precision, width, given)
        matrix = wp.types.matrix(shape=of.shape, dtype=model.precision.scalar)(*of.ravel())
        inputs = [matrix, model.array(rows, wp.int32), values, out]
        launch(kernel, len(rows), inputs, model.device)
        return out

    def derived(self, derivative: str | None, normalized: bool) -> wp.array:
        """What is asked for at the particles, in their slots."""
        if derivative is None:
            return self.values
        gradient = None
        if derivative != "laplacian" or normalized:
            gradient = self._gradient(normalized)
        if derivative == "laplacian":
            return self._laplacian(gradient)
        assert gradient is not None
        if derivative == "gradient" and self.vector:
            return gradient
        return self.combined(OF_GRADIENT[derivative], np.arange(len(gradient)), gradient)

    def gathered(self, values: wp.array, slots: np.ndarray) -> wp.array:
        """The values in these slots."""
        return self.combined(np.eye(len(values.dtype())), slots, values)

    def _loop(self, **more: wp.array) -> PairLoop:
        sph = self.sph
        fields = {name: sph.fields[name] for name in ("x", "m", "state")} | {"a": self.values}
        return PairLoop.over(
            sph.model, sph.pairs, "FluidField", {**fields, **more}, sph.Params, sph.params
        )

    @functools.cached_property
    def _slope(self) -> wp.Function:
        return self.sph.smoothing.slope.function(self.sph.model.precision)

    def _gradient(self, normalized: bool) -> wp.array:
        """dA_a/dx_b in slots, as nine numbers."""
        precision, loop = self.sph.model.precision, self._loop()
        gradient = self.sph.pairs.array(precision.vector(9))
        term = kernels.gradient_term(self._slope, *loop.types)
        store = functools.partial(kernels.keep_gradient, normalized)
        loop.sum(term, store, {"gradient": gradient})
        return gradient

    def _laplacian(self, gradient: wp.array | None) -> wp.array:
        """lap A_a in slots; normalized where there is a gradient."""
        precision, normalized = self.sph.model.precision, gradient is not None
        loop = self._loop(**({} if gradient is None else {"gradient": gradient}))
        laplacian = self.sph.pairs.array(precision.vec3)
        term = kernels.laplacian_term(self._slope, normalized, *loop.types)
        store = functools.partial(kernels.keep_laplacian, normalized, self.sph.dimension)
        loop.sum(term, store, {"laplacian": laplacian})
        return laplacian

    def summed(self, samples: wp.array, points: wp.array, normalized: bool) -> wp.array:
        """Sums at points, by a grid over the particles as they are now."""
        sph, world = self.sph, self.world
        model, device, precision = sph.model, sph.model.device, sph.model.precision
        sums = wp.zeros(len(points), dtype=samples.dtype, device=device)
        x = sph.pairs.fields["position"][self.slots]
        if not (len(points) and len(self.members)):
            return sums
        host = x.numpy().astype(np.float64)
        block = next(each for each in sph.pairs.blocks if each.world == world)
        sizes = wp.empty(0, dtype=precision.vector(2), device=device)
        widest = sph.pairs.reach[world]
        if sph.lengths is not None:
            sizes, widest = sph.lengths.size[self.slots], sph.lengths.widest(self.slots)
        grid, cells = grid_over(model, block, float(widest), host)
        cells.first = 0  # of the slots at hand
        u_particles, u_points = wp.empty_like(x), wp.empty_like(points)
        launch(cell_coordinates_kernel(precision), len(x), [cells, x, u_particles], device)
        reach = 1.1 * widest
        corners = (host.min(axis=0) - reach, host.max(axis=0) + reach)
        lower, upper = (precision.vec3(*corner) for corner in corners)
        seek = kernels.seeking_kernel(precision, model.periodic)
        inputs = [world, cells, lower, upper, model.box, points, u_points]
        launch(seek, len(points), inputs, device)
        grid.build(u_particles, 1.0)
        kernel = kernels.interpolation_kernel(
            sph.weight, len(samples.dtype()), precision, model.periodic, sph.Params,
            sph.lengths is not None,
        )  # fmt: skip
        launch(
            kernel, len(points),
            [grid.id, world, bool(normalized), model.box, sph.params, x,
             sph.slot_state[self.slots], samples[self.slots], sizes, points, u_points, sums],
            device,
        )  # fmt: skip
        return sums
