"""Reading: what users ask a simulation for, beside the arrays of its particles."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from ..instruments.diagnostics import Diagnostics, measure
from ..instruments.explain import Explanation, explain
from ..instruments.ledger.ledger import Ledger, read
from ..instruments.stability.check import stability
from ..instruments.stability.report import Stability
from ..output import checkpoint
from ..pictures.render.camera import Camera
from ..pictures.render.image import Image
from .access import Access
from .world import World

if TYPE_CHECKING:
    from .simulation import Simulation


class Reading(Access):
    """The part of :class:`~particlesim.Simulation` that leaves it as it is."""

    @property
    def _sim(self) -> Simulation:
        return cast("Simulation", self)

    @property
    def frozen(self) -> list[int]:
        """Worlds that stand still since the watchdog froze them; :meth:`reset` frees them."""
        return sorted(self._sim.watchdog.frozen)

    @property
    def world_count(self) -> int:
        """How many worlds."""
        return self._sim.model.world_count

    @property
    def particle_count(self) -> int:
        """Particles of all worlds."""
        return self._sim.model.particle_count

    @property
    def time(self) -> float:
        """Simulated time since the start [s]."""
        return self._sim.frame * self._sim.settings.dt

    def get(self, name: str) -> np.ndarray:
        """A per-particle array, copied to the host."""
        return self._sim.state[name].numpy().copy()

    def world(self, index: int) -> World:
        """A view of one world."""
        return World(self._sim, index)

    def save(self, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
        """Write a checkpoint: all that is needed to go on from here, bit for bit.

        Args:
            path: A ``.npz`` file; it appears whole or not at all.
            overwrite: Replace an existing file.

        Raises:
            ValueError: Another suffix. FileExistsError: It exists, and ``overwrite`` is not set.
            OSError: The folder is missing, or the file could not be written.
        """
        checkpoint.save(self._sim, path, overwrite)

    def render(
        self,
        path: str | os.PathLike[str] | None = None,
        width: int = 1280,
        height: int = 720,
        camera: Camera | None = None,
        color: str | None = None,
        **options: Any,
    ) -> Image:
        """A picture of the present state, with the colours and boundaries of recordings.

        Args:
            path: File to write too, ``.png``, ``.jpg`` or ``.webp``.
            width: In pixels.
            height: In pixels.
            camera: None: one that sees all.
            color: Name of a value to colour particles by, as ``color_by`` of
                :class:`~particlesim.output.usd.recorder.UsdRecorder`; None: each group has its own colour.
            **options: ``color_map``, ``color_range``, ``worlds``, ``groups``, ``layout`` and
                ``surface`` as of UsdRecorder, but worlds stand side by side; ``ground``: True,
                False or a height [length], None: where there are boundaries; ``background``
                (linear r, g, b), ``shadows``, ``occlusion``, ``supersample`` (1, 2 or 4) and
                ``overwrite``.

        Raises:
            ValueError: Values out of range, names that are not there, another suffix.
            FileExistsError: The file exists, and ``overwrite`` is not set.
            ImportError: Pillow, which writes files, is not installed.
        """
        from ..pictures.render.preview import render

        return render(self._sim, path, width, height, camera, color, **options)

    def _repr_png_(self) -> bytes | None:
        """A picture for notebooks, where Pillow is installed."""
        from ..pictures.render.preview import notebook_picture

        return notebook_picture(self._sim)

    def stability(self) -> Stability:
        """The largest safe substep of every part at the present moment, and what binds."""
        return stability(self._sim)

    def diagnostics(self) -> Diagnostics:
        """Conserved quantities of every world at the present time."""
        return measure(self._sim)

    def ledger(self) -> Ledger:
        """Work and impulse of every interaction and constraint since the start, world by world.

        Raises:
            ValueError: ``settings.ledger`` is not set.
        """
        return read(self._sim)

    def explain(self) -> Explanation:
        """What is allocated, compiled and launched, and why."""
        return explain(self._sim)
