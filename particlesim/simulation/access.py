"""Writing into a running simulation: values of particles, and worlds back to their start."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from .. import validate
from ..engine.frames import Frames
from ..engine.loop import Loop
from ..instruments.ledger.accounts import Accounts, motion
from ..instruments.watchdog.rounds import Rounds
from ..instruments.watchdog.watch import Watchdog
from ..scene.scene import Scene


class Writer:
    """Writes, and has all who derive something from what is written forget it."""

    def __init__(
        self, frames: Frames, watchdog: Watchdog, rounds: Rounds, accounts: Accounts | None
    ):
        self.frames, self.loop, self.rounds = frames, frames.loop, rounds
        self.watchdog, self.accounts = watchdog, accounts

    def set(self, name: str, value: Any, rows: slice) -> None:
        """Write rows of a per-particle array (see :meth:`Simulation.set`)."""
        owner, model, state = "Simulation.set", self.loop.model, self.loop.state
        if state.is_given(name):
            state.require({name})
        array = state[name]
        host = array.numpy().copy()
        shape = host[rows].shape
        width = shape[1] if len(shape) == 2 else None
        given = validate.rows(owner, name, value, shape[0], width)
        if name == "mass" and not (given > 0).all():
            raise validate.fail(owner, "mass", "be above 0", float(given.min()), "give a mass")
        if name == "inverse_mass" and not (given >= 0).all():
            least = float(given.min())
            raise validate.fail(owner, name, "be at least 0", least, "0 holds a particle")
        model.fits(owner, {name: given})
        host[rows] = given
        if name == "radius":
            self._check_radius(owner, host)
        before = None if self.accounts is None else motion(model, state)
        array.assign(host)
        if name == "mass" and "inverse_mass" in state:
            # Pinned particles stay pinned.
            inverse = self.loop.get("inverse_mass")
            inverse[rows] = np.where(inverse[rows] > 0, 1.0 / host[rows], 0.0)
            state.inverse_mass.assign(inverse)
        if self.accounts is not None and before is not None:
            self.accounts.written(before)
        error = f"{name}_error"
        if error in state:
            kept = self.loop.get(error)
            kept[rows] = 0
            state[error].assign(kept)
        self._derive(name, np.unique(model.world_of[rows]).tolist())

    def _check_radius(self, owner: str, radius: np.ndarray) -> None:
        """Contacts are looked for by the radii of the start: by the largest, or that of a size."""
        largest = np.full(len(radius), self.loop.model.column("radius").max())
        for each in self.loop.neighbors.verlet:
            largest = np.minimum(largest, each.halves())
        beyond = radius > largest.astype(radius.dtype)
        if beyond.any():
            k = int(np.argmax(beyond))
            raise validate.fail(
                owner, f"radius[{k}]", "be at most the largest of its size at the start, which "
                f"contacts are looked for by ({largest[k]:g})", float(radius[k]),
                "give the scene the largest that it will have",
            )  # fmt: skip

    def _derive(self, name: str, worlds: list[int]) -> None:
        """Have what depends on an array follow it, in these worlds."""
        if name == "position":
            self.loop.neighbors.renew(self.loop.state, worlds)
            for part in self.loop.parts:
                part.placed(worlds)
        self.rounds.begin_anew(worlds)
        if name in ("position", "velocity"):
            self.watchdog.placed(self.loop, worlds)
        self.loop.unknown_forces.update(worlds)

    def reset(self, worlds: Iterable[int] | None) -> None:
        """Put worlds back to their start (see :meth:`Simulation.reset`)."""
        owner, loop = "Simulation.reset", self.loop
        count = loop.model.world_count
        given = range(count) if worlds is None else worlds
        given = given if isinstance(given, Iterable) else [given]
        chosen = sorted({validate.whole(owner, "worlds", w) for w in given})
        if chosen and chosen[-1] >= count:
            raise validate.fail(
                owner, "worlds", f"be from 0 to {count - 1}", chosen[-1],
                "name worlds of this simulation",
            )  # fmt: skip
        if len(chosen) == count:
            loop.frame = 0
        loop.state.reset(chosen)
        loop.neighbors.renew(loop.state, chosen)
        for part in loop.parts:
            part.reset(chosen)
        self.watchdog.reset(self.frames, chosen)
        self.rounds.begin_anew(chosen)
        if self.accounts is not None:
            self.accounts.begin_anew(chosen)
        loop.unknown_forces.update(chosen)


class Copy(np.ndarray):
    """What was read, and cannot be written to: that would change nothing in the simulation.

    Arithmetic makes plain arrays of it, also ``+=``, whose result is then assigned. ``copy()``
    makes one that may be written to.
    """

    @classmethod
    def of(cls, values: np.ndarray) -> Copy:
        """These values, no longer to be written to."""
        result = values.view(cls)
        result.flags.writeable = False
        return result

    def __array_ufunc__(
        self, ufunc: np.ufunc, method: str, *inputs: Any, out: Any = None, **options: Any
    ) -> Any:
        if out is not None:
            kept = [None if each is self and not self.flags.writeable else each for each in out]
            if any(each is not None for each in kept):
                options["out"] = tuple(_plain(each) for each in kept)
        result = getattr(ufunc, method)(*(_plain(each) for each in inputs), **options)
        return out[0] if out is not None and "out" in options and len(out) == 1 else result


def _plain(value: Any) -> Any:
    return value.view(np.ndarray) if isinstance(value, Copy) else value


class Access:
    """Per-particle arrays by name: a member says which rows."""

    def get(self, name: str) -> np.ndarray:
        """A per-particle array, copied to the host."""
        raise NotImplementedError

    def set(self, name: str, value: Any) -> None:
        """Write a per-particle array; what was derived from it is forgotten."""
        raise NotImplementedError

    @property
    def position(self) -> np.ndarray:
        """Positions, (n, 3), a copy on the host; of all worlds, one after the other.

        ``sim.position = x`` and ``sim.position += d`` write; ``sim.position[0] = x`` would write
        into the copy, so that NumPy refuses it.
        """
        return Copy.of(self.get("position"))

    @position.setter
    def position(self, value: Any) -> None:
        self.set("position", value)

    @property
    def velocity(self) -> np.ndarray:
        """Velocities, (n, 3), a copy on the host, like :attr:`position`."""
        return Copy.of(self.get("velocity"))

    @velocity.setter
    def velocity(self, value: Any) -> None:
        self.set("velocity", value)


class World(Access):
    """One world of a batch: its rows of the simulation's arrays."""

    def __init__(self, loop: Loop, writer: Writer, index: int):
        count = loop.model.world_count
        validate.whole("Simulation.world", "index", index)
        if index >= count:
            raise validate.fail(
                "Simulation.world", "index", f"be from 0 to {count - 1}", index,
                "name a world of this simulation",
            )  # fmt: skip
        self._loop, self._writer, self.index = loop, writer, index
        self.rows = loop.model.rows(index)

    @property
    def scene(self) -> Scene:
        """The scene that the world was made of."""
        return self._loop.scenes[self.index]

    def get(self, name: str) -> np.ndarray:
        """A per-particle array of this world, copied to the host."""
        array = self._loop.held(name)
        if self.rows.start == self.rows.stop:  # Warp has no empty slice at an array's end
            return array.numpy()[self.rows].copy()
        return array[self.rows].numpy().copy()

    def set(self, name: str, value: Any) -> None:
        """Write a per-particle array of this world."""
        self._writer.set(name, value, self.rows)

    def reset(self) -> None:
        """Put this world back to its start."""
        self._writer.reset([self.index])
