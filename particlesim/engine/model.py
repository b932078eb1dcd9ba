"""Model: the scenes of a batch merged into one set of host arrays, on a device and a precision."""

from __future__ import annotations

import functools
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import warp as wp

from .. import validate
from ..kernels.engine.loops import Periodicity, box_type
from ..kernels.parameters import parameter_types, structures
from ..kernels.precision import PRECISIONS, structure
from ..kernels.self_check import fast_ways
from ..scene import ranges
from ..scene.group import select
from ..scene.scene import Scene
from ..scene.settings import Settings
from ..scene.thermostat import Barostat
from .start import start_warp

ROOM = 8  # powers of two that a unit keeps from the ends of a precision


def choose_device(device: Any) -> Any:
    """The Warp device of that name; None: CUDA where there is one, else the CPU."""
    start_warp()
    cuda = wp.is_cuda_available()
    if device is None:
        return wp.get_device("cuda:0" if cuda else "cpu")
    there = [each.alias for each in wp.get_devices()]
    if str(device) in there or (cuda and str(device) == "cuda"):
        return wp.get_device(str(device))
    raise validate.fail(
        "Simulation", "device", f"be one of {', '.join(there)}", str(device), "choose one"
    )


def batch(given: Any, worlds: int | None) -> list[Scene]:
    """The scenes of a batch, checked to be of one kind."""
    owner = "Simulation"
    if isinstance(given, Scene):
        count = 1 if worlds is None else validate.whole(owner, "worlds", worlds, minimum=1)
        return [given] * count
    if not isinstance(given, Sequence) or not all(isinstance(each, Scene) for each in given):
        raise TypeError(f"{owner}: scene must be a Scene or a list of Scenes, got {given!r}; "
                        "build one with particlesim.Scene().")  # fmt: skip
    if worlds is not None:
        raise validate.fail(
            owner, "worlds", "be left out with a list of scenes", worlds, "each scene is a world"
        )
    if not given:
        raise validate.fail(owner, "scene", "hold at least one Scene", given, "add a scene")
    first = given[0]
    for w, other in enumerate(given):
        for what in ("interactions", "constraints", "thermostats"):
            ours = [part.kind() for part in getattr(first, what)]
            theirs = [part.kind() for part in getattr(other, what)]
            if ours != theirs:
                mine = [part.name for part in getattr(first, what)]
                names = [part.name for part in getattr(other, what)]
                raise validate.fail(
                    owner, f"scenes[{w}].{what}", f"be of the kinds of scenes[0] ({mine})", names,
                    "make a batch of scenes of one kind",
                )  # fmt: skip
        if [group.name for group in first.groups] != [group.name for group in other.groups]:
            raise validate.fail(
                owner, f"scenes[{w}].groups", "have the names of scenes[0]'s",
                [group.name for group in other.groups], "make a batch of scenes of one kind",
            )  # fmt: skip
    return list(given)


class Model:
    """What the kernels are built for: worlds, particles, device, precision and settings.

    Particles of world w are the rows ``offsets[w]:offsets[w + 1]`` of every per-particle array.
    """

    def __init__(self, scenes: Sequence[Scene], settings: Settings, device: Any):
        self.scenes = list(scenes)
        self.settings = settings
        self.device = choose_device(device)
        self.precision = PRECISIONS[settings.precision]
        self.world_count = len(self.scenes)
        counts = np.array([scene.particle_count for scene in self.scenes], dtype=np.int64)
        self.offsets = np.concatenate([[0], np.cumsum(counts)])
        self.particle_count = int(self.offsets[-1])
        if self.particle_count >= 2**31:
            raise validate.fail(
                "Simulation", "particles", "number below 2^31", self.particle_count, "use fewer"
            )
        self.world_of = np.repeat(np.arange(self.world_count), counts)
        ranges.step_fits(settings.substep, self.precision.numpy)
        self.periodic = self._periodicity()
        self.flexible = any(isinstance(bath, Barostat) for bath in self.scenes[0].thermostats)
        self.box = self._boxes()
        self.attributes = self._attributes()
        for scene in {id(scene): scene for scene in self.scenes}.values():
            names = ("position", "velocity", *scene.attributes)
            self.fits("Scene.add_particles", {name: scene.column(name) for name in names})

    def rows(self, world: int) -> slice:
        """The rows of a world's particles."""
        return slice(int(self.offsets[world]), int(self.offsets[world + 1]))

    @property
    def vectorised(self) -> bool:
        """Loops over pairs are C++ for the CPU's vector units, rather than Warp's own."""
        return self.device.is_cpu and fast_ways()

    def _attributes(self) -> dict[str, int | None]:
        result: dict[str, int | None] = {}
        for w, scene in enumerate(self.scenes):
            for name, width in scene.attributes.items():
                if result.setdefault(name, width) != width:
                    raise validate.fail(
                        "Simulation", f"scenes[{w}].{name}",
                        f"be {'numbers' if width else 'vectors'} as in the scenes before",
                        "vectors" if width else "numbers", "make a batch of scenes of one kind",
                    )  # fmt: skip
        return result

    def _periodicity(self) -> Periodicity:
        kinds = {scene.periodic[2] if scene.periodic else (False,) * 3 for scene in self.scenes}
        if len(kinds) > 1:
            raise validate.fail(
                "Simulation", "scenes", "be periodic along the same axes", sorted(kinds),
                "make a batch of scenes of one kind",
            )  # fmt: skip
        return Periodicity(*kinds.pop())

    def _boxes(self) -> wp.array:
        Box = box_type(self.precision)
        self.box_lower = np.zeros((self.world_count, 3))
        self.box_start = np.zeros((self.world_count, 3))
        for w, scene in enumerate(self.scenes):
            if scene.periodic:
                self.box_lower[w] = scene.periodic[0]
                self.box_start[w] = scene.periodic[1] - scene.periodic[0]
        lower, length, inverse = np.split(self.boxes_at_start(), 3, axis=1)
        self.fits("Scene", {"periodic": np.stack([length, inverse])})
        return self.structures(Box, {"lower": lower, "length": length, "inverse": inverse})

    def boxes_at_start(self) -> np.ndarray:
        """The numbers of the scenes' boxes: lower corner, lengths, one over these, (worlds, 9)."""
        length = self.box_start
        inverse = np.divide(1.0, length, out=np.zeros_like(length), where=length > 0)
        return np.concatenate([self.box_lower, length, inverse], axis=1)

    @property
    def box_length(self) -> np.ndarray:
        """Lengths of the worlds' boxes at present, (worlds, 3) [length]; 0 where an axis is open.

        ``box_start`` are those of the scenes, from which a barostat takes them away.
        """
        if not self.flexible:
            return self.box_start
        return self.box.numpy()["length"].astype(np.float64)

    def numbers(self, boxes: wp.array) -> wp.array:
        """The numbers of boxes, in their own memory, a row a world: lower, length, inverse."""
        kind = self.precision.vector(9)
        return wp.array(ptr=boxes.ptr, shape=len(boxes), dtype=kind, device=self.device)

    def structures(self, kind: Any, columns: Mapping[str, Any]) -> wp.array:
        """An array of ``wp.struct`` from one host column a field."""
        return structures(kind, columns, self.device)

    def fits(self, owner: str, columns: Mapping[str, np.ndarray]) -> None:
        """Refuse numbers that the kernels' precision cannot hold (see ``scene.ranges``)."""
        ranges.fits(owner, columns, self.precision.numpy)

    def squares_fit(self, owner: str, name: str, lengths: Any) -> None:
        """Refuse lengths whose squares the kernels' precision cannot hold."""
        ranges.squares_fit(owner, name, lengths, self.precision.numpy)

    def unresolved(
        self, owner: str, name: str, lengths: Any, rows: np.ndarray, part: float = ranges.COARSE
    ) -> str:
        """What is to be said of lengths that start positions are too coarse for, or nothing.

        Args:
            owner: Whose lengths. name: What they are.
            lengths: One for all, or (m,) [length].
            rows: Of the particles that go with them, (m,) or (m, k).
            part: Of a length, what numbers may be apart unasked.
        """
        if not len(rows):
            return ""
        x, _ = self.wrapped(self.column("position"), self.world_of, self.box_start)
        far = np.abs(x).max(axis=1)[rows.reshape(len(rows), -1)].max(axis=1)
        lengths = np.broadcast_to(np.asarray(lengths, dtype=np.float64), far.shape)
        return ranges.unresolved(owner, name, lengths, far, self.precision.numpy, part)

    def unresolved_radii(self, owner: str, rows: np.ndarray) -> str:
        """The same of the diameters of these particles, which contacts go by."""
        diameter = 2.0 * self.column("radius")[rows]
        return self.unresolved(owner, "diameter", diameter, rows, ranges.COARSE_DIAMETER)

    @functools.cached_property
    def mass_unit(self) -> float:
        """About a particle's mass, a power of two, which no product with it rounds [mass]."""
        mass = self.column("mass")
        numbers = np.finfo(self.precision.numpy)
        power = np.round(np.log2(np.median(mass))) if len(mass) else 0.0
        return float(2.0 ** np.clip(power, numbers.minexp + ROOM, numbers.maxexp - ROOM))

    def apart(self) -> tuple[np.ndarray, np.ndarray]:
        """How far the particles of each world are apart along an axis, and about how far each is
        from the next, both (worlds,) [length]; 0 where they are nowhere apart.
        """
        x = [scene.position for scene in self.scenes]
        size = np.array([float(np.ptp(each, axis=0).max()) if len(each) else 0.0 for each in x])
        return size, size / np.maximum(np.diff(self.offsets), 1) ** (1.0 / 3.0)

    def parameters(self, name: str, columns: Mapping[str, Any]) -> tuple[Any, wp.array]:
        """A parameter struct and its array, one entry a world or an item.

        Columns are (count,) numbers, whole if they are integers, (count, 3) vectors, or an array of
        the device each, which whoever gives it keeps.
        """
        first = {
            key: column[0] if len(column) else np.zeros(np.shape(column)[1:], column.dtype)
            for key, column in columns.items()
        }
        kind = structure(name, parameter_types(first, self.precision))
        return kind, self.structures(kind, columns)

    def array(self, values: Any, dtype: Any) -> wp.array:
        """A device array of host values."""
        return wp.array(np.ascontiguousarray(values), dtype=dtype, device=self.device)

    def column(self, name: str) -> np.ndarray:
        """A per-particle array of all worlds, from the scenes."""
        width = self.attributes.get(name, 3 if name in ("position", "velocity") else None)
        parts = []
        for scene in self.scenes:
            shape = (scene.particle_count,) if width is None else (scene.particle_count, width)
            part = scene.column(name)
            parts.append(part if part.shape == shape else np.zeros(shape))
        return np.concatenate(parts)

    def wrapped(
        self, position: np.ndarray, world: Any, boxes: np.ndarray | None = None
    ) -> tuple[np.ndarray, np.ndarray]:
        """Positions moved into the periodic box of their world, lower <= x < lower + L, and images.

        ``boxes`` are the lengths L of the worlds; None: those at present.

        They are so in the precision of the kernels too: what would round to the upper corner comes
        to the lower, which is the same place. The images, whole numbers n, say where from: x + n L.
        """
        real = self.precision.numpy
        lower = self.box_lower[world]
        length = (self.box_length if boxes is None else boxes)[world]
        upper = lower.astype(real) + length.astype(real)
        away = np.divide(position - lower, length, out=np.zeros_like(position), where=length > 0)
        image = np.floor(away)
        image += (length > 0) & ((position - length * image).astype(real) >= upper)
        inside = position - length * image
        return np.where(length > 0, np.maximum(inside, lower), inside), image

    def members(self, groups: Sequence[Any], owner: str) -> np.ndarray:
        """Rows of the particles that each world's own ``group`` stands for, world by world."""
        chosen = [
            select(scene, group, owner) + self.offsets[w]
            for w, (scene, group) in enumerate(zip(self.scenes, groups, strict=True))
        ]
        return np.concatenate(chosen).astype(np.int32)


def structure_of(name: str, arrays: Mapping[str, wp.array]) -> Any:
    """The struct that holds arrays of these types."""
    return structure(name, {field: wp.array(dtype=each.dtype) for field, each in arrays.items()})


def filled(kind: Any, arrays: Mapping[str, wp.array]) -> Any:
    """An instance of a struct with its arrays set."""
    result = kind()
    for name, array in arrays.items():
        setattr(result, name, array)
    return result
