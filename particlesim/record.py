"""Recording a simulation into USD: what of it is drawn, and how."""

from __future__ import annotations

import os
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from .usd import UsdWriter
from .usd_info import LinksPrim, PointsPrim, Shape, StageInfo

if TYPE_CHECKING:
    from .simulation import Simulation

PLAYBACK_FPS = 24.0  # where a frame is not a sensible part of a second
FPS_RANGE = (1.0, 1000.0)
LINK_WIDTH = 0.5  # of the mean particle diameter
LINK_COLOR = (0.75, 0.72, 0.65)


class UsdRecorder:
    """Records the frames of a simulation into a USD file, each safe as soon as it is written.

    Args:
        sim: The simulation.
        path: The root file, ``.usda``, ``.usd`` or ``.usdc``; frames go to ``<stem>.clips``.
        frames: How many more frames are planned; more or fewer may come.
        fields: Names of further per-particle arrays to write as primvars (``"density"``).
        fps: Frames a second of playback; None: 1 / dt where that is sensible, else 24.
        overwrite: Replace an existing recording.

    Raises:
        FileExistsError, FileNotFoundError, ValueError: As :class:`~particlesim.usd.UsdWriter`.

    Example:
        >>> from particlesim import Scene, Simulation
        >>> scene = Scene()
        >>> ball = scene.add_particles([(0, 1, 0)], velocity=(1, 0, 0), radius=0.1)
        >>> sim = Simulation(scene, device="cpu")
        >>> with UsdRecorder(sim, "ball.usda", frames=1) as recorder:
        ...     recorder.write()
        ...     sim.step()
        ...     recorder.write()
    """

    def __init__(
        self,
        sim: Simulation,
        path: str | os.PathLike[str],
        *,
        frames: int = 1,
        fields: Iterable[str] = (),
        fps: float | None = None,
        overwrite: bool = False,
    ):
        self.sim = sim
        self.fields = tuple(fields)
        widths = {name: 3 if sim.state[name].dtype.__name__.startswith("vec") else 1
                  for name in self.fields}  # fmt: skip
        self.writer = UsdWriter(
            path, stage_info(sim, frames, fps), fields=widths, overwrite=overwrite
        )

    def write(self) -> None:
        """Write the simulation's present state as its present frame."""
        sim = self.sim
        self.writer.write(
            sim.frame, sim.position, sim.velocity, {name: sim.get(name) for name in self.fields}
        )

    def close(self) -> None:
        """Give the file the end that was reached."""
        self.writer.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: Any) -> None:
        self.writer.__exit__(*error)


def stage_info(sim: Simulation, frames: int, fps: float | None) -> StageInfo:
    """What the recording of a simulation holds."""
    dt, first = sim.settings.dt, sim.scenes[0]
    if fps is None:
        natural = 1.0 / dt if dt > 0 else 0.0
        fps = natural if FPS_RANGE[0] <= natural <= FPS_RANGE[1] else PLAYBACK_FPS
        fps = round(fps) if abs(fps - round(fps)) < 1e-6 else fps
    return StageInfo(
        points=_points(sim),
        links=_links(sim),
        shapes=_shapes(sim),
        frames=frames + 1,
        fps=fps,
        frame_time=dt if dt > 0 else None,
        up_axis=first.up_axis,
        meters_per_unit=first.meters_per_unit,
        periodic=_periodic(sim),
    )


def _points(sim: Simulation) -> list[PointsPrim]:
    points = []
    for w, scene in enumerate(sim.scenes):
        offset = int(sim.model.offsets[w])
        for group in scene.groups:
            if not len(group):
                continue
            diameter = 2.0 * scene.radius[group.slice]
            width: np.ndarray | float | None = diameter if diameter.any() else None
            if width is not None and np.ptp(diameter) == 0:
                width = float(diameter[0])
            points.append(
                PointsPrim(
                    w, group.name, slice(offset + group.start, offset + group.stop),
                    group.indices, width, group.color,
                )
            )  # fmt: skip
    return points


def _links(sim: Simulation) -> list[LinksPrim]:
    links = []
    for part in [*sim.interactions, *sim.constraints]:
        for w, peer in enumerate(part.peers):
            pairs = peer.links()
            if len(pairs):
                radius = sim.scenes[w].radius
                mean = float(radius[np.unique(pairs)].mean()) or _size(sim.scenes[w].position)
                offset = int(sim.model.offsets[w])
                links.append(
                    LinksPrim(w, part.name, pairs + offset, 2 * LINK_WIDTH * mean, LINK_COLOR)
                )
    return links


def _size(position: np.ndarray) -> float:
    """A visible radius for scenes whose particles have none."""
    return 0.005 * float(np.linalg.norm(np.ptp(position, axis=0))) or 0.01


def _shapes(sim: Simulation) -> list[Shape]:
    shapes = []
    for part in sim.constraints:
        for w, peer in enumerate(part.peers):
            for each in peer.shapes():
                described = {
                    key: _drawable(key, value, sim.scenes[w].position)
                    for key, value in each.items()
                }
                make = getattr(Shape, described.pop("kind"))
                shapes.append(make(world=w, name=part.name, **described))
    return shapes


def _periodic(sim: Simulation) -> tuple[np.ndarray, np.ndarray] | None:
    """The box, where all worlds have the same."""
    length, lower = sim.model.box_length, sim.model.box_lower
    if not sim.model.periodic or np.ptp(length, axis=0).any() or np.ptp(lower, axis=0).any():
        return None
    on = length[0] > 0
    return np.where(on, lower[0], np.nan), np.where(on, lower[0] + length[0], np.nan)


def _drawable(name: str, value: Any, position: np.ndarray) -> Any:
    """Open sides of a box end where the particles start."""
    if name not in ("lower", "upper"):
        return value
    corner = np.asarray(value, dtype=float)
    reached = position.min(axis=0) if name == "lower" else position.max(axis=0)
    return np.where(np.isfinite(corner), corner, reached)
