"""Boundaries of sampled distances."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import warp as wp

from ... import validate
from ...kernels.constraints.boundaries import grids as kernels
from ...kernels.constraints.boundaries.volume import lookup_kernel
from ...kernels.precision import Precision
from ...scene.law import Law
from ..boundary import Boundary
from .combined import ShapedBoundary
from .drawing import level_set
from .motion import Motion
from .solid import STILL


class SDFBoundary(ShapedBoundary):
    """What is where a sampled signed distance is positive.

    Between its nodes the distance is linear along each axis (trilinear), and the normal is its
    gradient, so that a smooth surface is off by the second order in the spacing. Beyond the grid it
    goes on: where it is positive at the nearest place of the grid, away from the surface, and else
    deeper into the solid, out of which particles are led back to the grid.

    A law is asked once for every node, at the start. That pays where it costs much: as it is,
    ``Boundary(law)`` takes it exactly.

    Args:
        distance: Signed distances [length], positive where particles may be: those of the nodes,
            (n, m, k), 2 or more along each axis; a law ``d(x, ...)`` as of ``Boundary``; or a
            ``wp.Volume`` of numbers, whose active voxels fill their box.
        lower: Where node (0, 0, 0) is, (3,) [length]; None: as a ``wp.Volume`` says.
        spacing: Of the nodes [length]; None: as a ``wp.Volume`` says.
        upper: The corner up to which a law is sampled at least, (3,) [length].
        friction: mu, at least 0.
        restitution: e, 0 to 1: speed after over speed before, both against the surface's.
        group: Which particles it holds; None: all.
        velocity: Of the boundary, (3,) [length/time].
        angular_velocity: About the pivot, (3,) [rad/time].
        pivot: What it turns about, as described, (3,) [length].
        slip: A fluid slips along it; False: a viscous one sticks to it.
        motion: A ``Trajectory`` or ``Keyframes`` in the place of both velocities.
        **parameters: The law's further parameters.

    Raises:
        ValueError: Values out of range; a law without ``upper``; a volume that is turned, skewed or
            of other values; a periodic scene.

    Example:
        >>> x = np.mgrid[-1:1:21j, -1:1:21j, -1:1:21j]
        >>> ball = SDFBoundary(np.sqrt((x**2).sum(axis=0)) - 0.5, (-1, -1, -1), 0.1, friction=0.3)
        >>> ball.values.shape
        (21, 21, 21)
    """

    sides = 3

    def __init__(
        self, distance: Any, lower: Sequence[float] | None = None, spacing: float | None = None,
        friction: float = 0.0, restitution: float = 0.0, group: Any = None, *,
        upper: Sequence[float] | None = None, velocity: Sequence[float] = STILL,
        angular_velocity: Sequence[float] = STILL, pivot: Sequence[float] = STILL,
        slip: bool = True, motion: Motion | None = None, **parameters: Any,
    ):  # fmt: skip
        self._holds(friction, restitution, group, velocity, angular_velocity, slip, motion)
        self.pivot = validate.vector(self.name, "pivot", pivot, unit="length")
        is_law = isinstance(distance, Law | Callable) and not isinstance(distance, wp.Volume)
        if isinstance(distance, wp.Volume):
            distance, lower, spacing = _dense(self.name, distance, lower, spacing)
        self.lower = validate.vector(self.name, "lower", lower, unit="length")
        self.spacing = validate.number(self.name, "spacing", spacing, above=0.0, unit="length")
        if is_law:
            distance = self._sampled(distance, upper, parameters)
        else:
            validate.known(self.name, parameters, [], "argument of sampled distances")
            if upper is not None:
                raise validate.fail(
                    self.name, "upper", "be left out, as samples say how far they go", upper,
                    "leave it out",
                )  # fmt: skip
        self.values = validate.grid(self.name, "distance", distance, 3)
        self._made: dict[tuple[str, str], wp.array] = {}

    def _sampled(self, law: Any, upper: Any, parameters: dict[str, Any]) -> np.ndarray:
        """The law at the nodes of a grid."""
        corner = validate.vector(self.name, "upper", upper, unit="length")
        if not (corner > self.lower).all():
            raise validate.fail(
                self.name, "upper", f"be above lower {self.lower.tolist()} [length]", corner,
                "swap the corners",
            )  # fmt: skip
        counts = 1 + np.ceil((corner - self.lower) / self.spacing - 1e-9).astype(int)
        axes = [np.arange(n) * self.spacing + at for n, at in zip(counts, self.lower, strict=True)]
        nodes = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
        return Boundary(law, **parameters).distance(nodes).reshape(counts)

    def near(self, precision: Precision, params: Any) -> wp.Function:
        return kernels.sampled_near(precision, params)

    def _geometry(self, device: Any, precision: Precision) -> dict[str, Any]:
        key = str(device), precision.name
        if key not in self._made:
            self._made[key] = wp.array(self.values, dtype=precision.scalar, device=device)
        return {
            "values": self._made[key], "lower": self.lower, "inverse": 1.0 / self.spacing,
            "size": (np.array(self.values.shape) - 1) * self.spacing, "room": np.inf,
        }  # fmt: skip

    def width(self) -> float:
        """The depth of a solid that ends in the grid: what is faster may pass its middle."""
        faces = [np.take(self.values, end, axis).min() for axis in range(3) for end in (0, -1)]
        return -float(self.values.min()) if min(faces) > 0 > self.values.min() else np.inf

    def shapes(self) -> list[dict[str, Any]]:
        upper = self.lower + (np.array(self.values.shape) - 1) * self.spacing
        mesh = level_set(self.values, self.lower, upper)
        return [self._shape("mesh", **mesh)] if mesh else []


def _dense(owner: str, volume: wp.Volume, lower: Any, spacing: Any) -> tuple[Any, Any, Any]:
    """Values, corner and spacing of a volume's voxels."""
    if lower is not None or spacing is not None:
        raise validate.fail(
            owner, "lower", "be left out, as a volume has a place of its own", lower,
            "leave lower and spacing out",
        )  # fmt: skip
    info = volume.get_grid_info()
    axes = np.array(info.transform_matrix, dtype=np.float64).reshape(3, 3)
    size = float(axes[0, 0])
    if volume.dtype is not wp.float32 or not np.allclose(axes, size * np.eye(3), atol=1e-6 * size):
        raise validate.fail(
            owner, "distance", "be a volume of float32, along the axes and as fine along each",
            f"{volume.dtype.__name__}, {axes.tolist()}", "resample it",
        )  # fmt: skip
    voxels = volume.get_voxels().numpy()
    first, last = voxels.min(axis=0), voxels.max(axis=0)
    counts = last - first + 1
    here = wp.Volume(wp.array(volume.array().numpy(), dtype=wp.uint8, device="cpu"))
    values = wp.empty(tuple(int(n) for n in counts), dtype=float, device="cpu")
    inputs = [here.id, wp.vec3i(*(int(n) for n in first))]
    wp.launch(lookup_kernel(), values.shape, inputs, [values], device="cpu")
    corner = np.array(info.translation, dtype=np.float64) + size * first
    return values.numpy().astype(np.float64), corner, size
