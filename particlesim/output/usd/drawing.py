"""What of a simulation a recording draws: which worlds and groups, as what, and where."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ... import validate
from ...engine.source import Source
from ...interactions.fluid.sph import SPH
from ...scene.group import Group, select
from ...scene.scene import Scene
from ..skin import Skin, read_broken
from ..surface import Mesh, Surface
from .description import LinksPrim, MeshPrim, PointsPrim, Shape, StageInfo
from .placement import closed, offsets, periodic_box
from .shapes import SHAPES

OWNER = "UsdRecorder"
PLAYBACK_FPS = 24.0  # where a frame is not a sensible part of a second
FPS_RANGE = (1.0, 1000.0)
LINK_WIDTH = 0.5  # of the mean particle diameter
LINK_COLOR = (0.75, 0.72, 0.65)


@dataclass(frozen=True, eq=False)
class Breakable:
    """Links of a constraint that may break, of one world."""

    prim: LinksPrim
    constraint: Any  # bound
    rows: slice  # of its ``broken``
    pairs: np.ndarray  # (m, 2), rows of the simulation's arrays
    drawn: np.ndarray  # (m,) bool

    def whole(self, broken: np.ndarray) -> np.ndarray:
        """Pairs that are drawn and not broken."""
        return self.pairs[self.drawn & ~broken[self.rows]]


@dataclass(frozen=True, eq=False)
class Fluid:
    """The members of an SPH in one world that are drawn as one surface."""

    prim: MeshPrim
    groups: frozenset[Group]
    surface: Surface


class Drawing:
    """The description of a recording, and what of it changes from frame to frame.

    Args:
        sim: The simulation.
        frames: How many frames of the file are planned.
        frame_time: Simulated time between two of them.
        fps: Frames a second of playback; None: 1 / frame_time where that is sensible, else 24.
        worlds: Which worlds, by number; None: all.
        groups: Which groups, by name or themselves; None: all.
        layout: None, ``"grid"``, or (3,) [length] from one world to the next.
        instancer: Spheres of a PointInstancer instead of Points.
        surface: Draw the members of each SPH as one surface instead; options of
            :class:`~particlesim.output.surface.Surface`, or True for none.
    """

    def __init__(
        self,
        sim: Source,
        *,
        frames: int,
        frame_time: float,
        fps: float | None,
        worlds: Iterable[int] | None = None,
        groups: Iterable[Any] | None = None,
        layout: Any = None,
        instancer: bool = False,
        surface: bool | Mapping[str, Any] = False,
    ):
        self.sim, self.instancer = sim, bool(instancer)
        self.worlds = _chosen_worlds(sim, worlds)
        self._chosen = frozenset(self.worlds)
        self.groups = _chosen_groups([sim.scenes[w] for w in self.worlds], groups)
        self.breakable: list[Breakable] = []
        self.tearable: dict[MeshPrim, Skin] = {}
        self.moving: list[tuple[Shape, Any]] = []  # with its boundary
        self.fluids: list[Fluid] = []
        if surface is not False:
            self.fluids = list(self._fluids({} if surface is True else dict(surface)))
        first = sim.scenes[0]
        self.info = StageInfo(
            points=list(self._points()),
            links=list(self._links()),
            meshes=list(self._meshes()),
            shapes=list(self._shapes()),
            layout=offsets(OWNER, layout, {w: sim.scenes[w] for w in self.worlds}),
            frames=frames,
            fps=_playback(frame_time) if fps is None else fps,
            frame_time=frame_time if frame_time > 0 else None,
            up_axis=first.up_axis,
            meters_per_unit=first.meters_per_unit,
            periodic=periodic_box(sim),
            flexible=sim.model.flexible and periodic_box(sim) is not None,
        )

    def box(self) -> np.ndarray | None:
        """Lengths of the periodic box now, where it changes."""
        return self.sim.model.box_length[0] if self.info.flexible else None

    def pairs(self) -> dict[LinksPrim, np.ndarray]:
        """The links that are whole now, of constraints that break."""
        broken = read_broken(each.constraint for each in self.breakable)
        return {each.prim: each.whole(broken[each.constraint]) for each in self.breakable}

    def meshes(self) -> dict[MeshPrim, Mesh | np.ndarray]:
        """As it is now: of fluids points, triangles and normals, of what tears its triangles."""
        skins = self.tearable.values()
        broken = read_broken(part for skin in skins for part, _ in skin.sides)
        torn = {prim: skin.whole(broken) for prim, skin in self.tearable.items()}
        return torn | {fluid.prim: fluid.surface.mesh() for fluid in self.fluids}

    def poses(self) -> dict[Shape, tuple[np.ndarray, np.ndarray]]:
        """Where the boundaries that move are now: translation and rotation."""
        if not self.moving:
            return {}
        # Each world has its own clock: one that was reset starts again.
        time = self.sim.get("time")
        return {shape: boundary.pose(float(time[shape.world])) for shape, boundary in self.moving}

    @property
    def rows(self) -> np.ndarray:
        """Rows of the simulation's arrays that are drawn, less those of fluids with a surface."""
        drawn: list[PointsPrim | MeshPrim] = [*self.info.points, *self.info.meshes]
        return np.concatenate([prim.rows for prim in drawn])

    def _drawn(self, scene: Scene) -> Iterator[Group]:
        """The groups of a scene that are drawn."""
        for group in scene.groups:
            if len(group) and (self.groups is None or group.name in self.groups):
                yield group

    def _each_group(self, meshed: bool) -> Iterator[tuple[int, Group, slice]]:
        """World, group and rows, of groups with or without triangles, less the fluids."""
        fluid = {(each.prim.world, group) for each in self.fluids for group in each.groups}
        for w in self.worlds:
            offset = int(self.sim.model.offsets[w])
            for group in self._drawn(self.sim.scenes[w]):
                if (group.triangles is not None) == meshed and (w, group) not in fluid:
                    yield w, group, slice(offset + group.start, offset + group.stop)

    def _points(self) -> Iterator[PointsPrim]:
        for w, group, rows in self._each_group(meshed=False):
            diameter = 2.0 * self.sim.scenes[w].radius[group.slice]
            width: np.ndarray | float | None = diameter if diameter.any() else None
            if np.ptp(diameter) == 0 and diameter[0] > 0:
                width = float(diameter[0])
            yield PointsPrim(w, group.name, rows, group.indices, width, group.color, self.instancer)

    def _meshes(self) -> Iterator[MeshPrim]:
        for w, group, rows in self._each_group(meshed=True):
            skin = Skin(group, self.sim.constraints, w)
            fixed = None if skin.sides else skin.triangles
            prim = MeshPrim(w, group.name, group.color, rows, fixed)
            if skin.sides:
                self.tearable[prim] = skin
            yield prim
        yield from (fluid.prim for fluid in self.fluids)

    def _fluids(self, options: dict[str, Any]) -> Iterator[Fluid]:
        parts = [part for part in self.sim.interactions if isinstance(part, SPH)]
        if not parts:
            raise validate.fail(
                OWNER, "surface", "be False in a scene without SPH", True, "leave it out"
            )
        for part in parts:
            for w in self.worlds:
                scene = self.sim.scenes[w]
                members = select(scene, part.peers[w].group, part.name)
                # A group of which only a part is fluid stays points.
                groups = [g for g in self._drawn(scene) if np.isin(g.indices, members).all()]
                if groups:
                    name = groups[0].name if len(groups) == 1 else part.name
                    prim = MeshPrim(w, name, groups[0].color)
                    yield Fluid(prim, frozenset(groups), Surface(self.sim, groups, w, **options))

    def _links(self) -> Iterator[LinksPrim]:
        for part in [*self.sim.interactions, *self.sim.constraints]:
            first = 0
            for w, peer in enumerate(part.peers):
                pairs = peer.links()
                own, first = slice(first, first + len(pairs)), first + len(pairs)
                drawn = self._links_drawn(w, pairs)
                if not drawn.any():
                    continue
                scene, offset = self.sim.scenes[w], int(self.sim.model.offsets[w])
                radius = float(scene.radius[np.unique(pairs)].mean()) or _size(scene.position)
                width, rows = 2 * LINK_WIDTH * radius, pairs + offset
                if getattr(part, "break_force", None) is None:
                    yield LinksPrim(w, part.name, rows[drawn], width, LINK_COLOR)
                else:
                    prim = LinksPrim(w, part.name, None, width, LINK_COLOR)
                    self.breakable.append(Breakable(prim, part, own, rows, drawn))
                    yield prim

    def _links_drawn(self, w: int, pairs: np.ndarray) -> np.ndarray:
        """Which pairs have both ends in what is drawn, and are not edges of one surface."""
        if w not in self._chosen or not len(pairs):
            return np.zeros(len(pairs), dtype=bool)
        scene = self.sim.scenes[w]
        group_of = np.full(scene.particle_count, -1)
        surface = np.zeros(scene.particle_count, dtype=bool)
        for k, group in enumerate(self._drawn(scene)):
            group_of[group.slice] = k
            surface[group.slice] = group.triangles is not None
        a, b = pairs[:, 0], pairs[:, 1]
        seen = (group_of[a] >= 0) & (group_of[b] >= 0)
        return seen & ~(surface[a] & (group_of[a] == group_of[b]))

    def _shapes(self) -> Iterator[Shape]:
        for part in self.sim.constraints:
            for w in self.worlds:
                for each in part.peers[w].shapes():
                    described = closed(each, self.sim.scenes[w].position)
                    names = SHAPES[described["kind"]]
                    parameters = tuple(described.pop(name) for name in names)
                    shape = Shape(parameters=parameters, world=w, name=part.name, **described)
                    if shape.moving:
                        self.moving.append((shape, part.peers[w]))
                    yield shape


def _chosen_worlds(sim: Source, given: Iterable[int] | None) -> list[int]:
    """Numbers of worlds, in order."""
    if given is None:
        return list(range(sim.model.world_count))
    given = given if isinstance(given, Iterable) else [given]
    worlds = sorted({validate.whole(OWNER, "worlds", w) for w in given})
    if not worlds or worlds[-1] >= sim.model.world_count:
        raise validate.fail(
            OWNER, "worlds", f"be some of 0 to {sim.model.world_count - 1}", worlds,
            "name worlds of this simulation",
        )  # fmt: skip
    return worlds


def _chosen_groups(scenes: list[Scene], given: Iterable[Any] | None) -> frozenset[str] | None:
    """Names of groups; None: all."""
    if given is None:
        return None
    given = [given] if isinstance(given, str | Group) else given
    names = [each.name if isinstance(each, Group) else each for each in given]
    there = list(dict.fromkeys(group.name for scene in scenes for group in scene.groups))
    for name in names:
        validate.choice(OWNER, "groups", name, there)
    return frozenset(names)


def _playback(frame_time: float) -> float:
    """Frames a second: in real time where that can be played."""
    natural = 1.0 / frame_time if frame_time > 0 else 0.0
    fps = natural if FPS_RANGE[0] <= natural <= FPS_RANGE[1] else PLAYBACK_FPS
    return round(fps) if abs(fps - round(fps)) < 1e-6 else fps


def _size(position: np.ndarray) -> float:
    """A visible radius for scenes whose particles have none."""
    return 0.005 * float(np.linalg.norm(np.ptp(position, axis=0))) or 0.01
