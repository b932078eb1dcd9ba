"""Pace: how many substeps each frame takes, where settings leave that to the limits of the moment.

Once a frame the largest speed, acceleration and density are looked at, by one launch. Where one of
them is no longer what it was when the limits were last asked, they are asked again; at the end of a
frame, so that one that ends past a limit, or at no numbers at all, is done again with more. The
number is that of a series in which each is half as many again or less, so that few graphs are made.

All follows from the state, and from what is kept of the last asking, which is in checkpoints.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Sequence
from typing import Any

import numpy as np
import warp as wp

from ..engine.blocks import blocks
from ..engine.execution.launch import launch
from ..engine.frames import Frames
from ..engine.limit import Limit
from ..engine.loop import Loop
from ..interactions.fusion import fuse
from ..kernels.instruments.sizes import sizes_kernel
from ..scene.scene import Scene
from ..scene.settings import Settings
from .stability import SAFETY, StabilityWarning, limits_now

BLOCK = 256  # particles that a thread looks at
# How much speed, acceleration and density may differ, as factors: limits change by as much or less,
# and are kept by a factor of two. Sound in Tait's liquid goes with the third power of the density.
DIFFERENT = np.array([1.3, 1.3, 1.05])
LOOK = 8  # applications of a Jacobian
LEVELS = 2.0  # numbers of the series in an octave
ANY = Limit("", "", math.inf, "nothing limits the substep")


class Pace:
    """Of one loop; where its settings are not adaptive, as many substeps as they say.

    Args:
        loop: What is in motion.
    """

    def __init__(self, loop: Loop):
        self.loop, self._told = loop, False
        edges = blocks(loop.model.offsets, BLOCK)[:2] if loop.settings.adaptive else ()
        self._blocks = [loop.model.array(each, wp.int32) for each in edges]

    def begin(self) -> None:
        """Choose the number of substeps of the next frame."""
        if not self.loop.settings.adaptive:
            return
        pacing = self.loop.pacing
        if pacing.limit is None or self.loop.unknown_forces:
            pacing.limit, pacing.sizes = tightest(self.loop), ()
        self._take(wanted(self.loop.settings, pacing.limit))

    def run(self, frames: Frames) -> None:
        """One frame, and again with more substeps as long as it ends past a limit."""
        frames.run(self.loop.settings.substeps)
        while self.loop.settings.adaptive and (more := self._more()):
            frames.back()
            self._take(more)
            if self.loop.integrator.carries_forces:
                self.loop.know_forces()
            frames.run(self.loop.settings.substeps)

    def _more(self) -> int:
        """How many substeps the frame that has just been is to be done again with; 0: it stands."""
        settings, pacing = self.loop.settings, self.loop.pacing
        sizes = self.look()
        if not np.isfinite(sizes).all():
            pacing.limit = None  # nobody can say it of such a state
            return self._twice()
        known = np.array(pacing.sizes or np.full(3, np.nan))
        alike = (sizes <= DIFFERENT * known) & (known <= DIFFERENT * sizes)
        if not alike.all():
            pacing.limit, pacing.sizes = tightest(self.loop), tuple(sizes.tolist())
        if pacing.limit is None or settings.substep <= pacing.limit.dt * (1.0 + 1e-9):
            return 0
        return self._twice()

    def _twice(self) -> int:
        """As many again, or what may be taken of it; 0 where that has been.

        The limit itself is that of a state that a step too long has led to, and may ask for any
        number.
        """
        settings = self.loop.settings
        assert settings.most_substeps is not None
        if settings.substeps >= settings.most_substeps:
            self._warn(2.0 * settings.substeps)
            return 0
        return int(min(level(2.0 * settings.substeps), settings.most_substeps))

    def _take(self, number: float) -> None:
        """Frames of that number, or of what may be taken of it."""
        most = self.loop.settings.most_substeps
        assert most is not None
        if number > most:
            self._warn(number)
        self.loop.pacing.limiter = self.loop.pacing.limit or self.loop.pacing.limiter
        self.loop.divide(int(min(number, most)))

    def look(self) -> np.ndarray:
        """The largest speed, acceleration and density at present, (3,); 0 where nobody asks."""
        model, state = self.loop.model, self.loop.state
        if not self._blocks:
            return np.zeros(3)
        nothing = wp.empty(0, dtype=model.precision.vec3, device=model.device)
        force = state.force if "force" in state else nothing
        density = state["density"] if "density" in state else state.held("mass")[:0]
        sizes = wp.zeros(len(self._blocks[0]), dtype=wp.vec3d, device=model.device)
        inputs = [*self._blocks, state.velocity, force, state.held("inverse_mass"), density, sizes]
        launch(sizes_kernel(model.precision), len(sizes), inputs, model.device)
        largest = sizes.numpy().max(axis=0, initial=0.0)
        return np.array([math.sqrt(largest[0]), math.sqrt(largest[1]), largest[2]])

    def _warn(self, number: float) -> None:
        """Once a simulation."""
        if self._told:
            return
        self._told = True
        limit, settings = self.loop.pacing.limit, self.loop.settings
        why = "numbers that are not finite"
        if limit is not None:
            where = f", {limit.where}" if limit.where else ""
            why = f"{limit.part} ({limit.kind}: {limit.reason}{where})"
        need = "more than any number" if math.isinf(number) else f"{number:g}"
        warnings.warn(
            f"Settings: most_substeps must be at least {need} for {why} at t = "
            f"{self.loop.time:.4g}, got {settings.most_substeps}; it goes on with these: look at "
            "what pushes it, or give more.",
            StabilityWarning, stacklevel=5,
        )  # fmt: skip


def adaptive(scenes: Sequence[Scene], settings: Settings, device: Any) -> Settings:
    """The settings with the number of the first frame, by the limits of the start."""
    settings = settings.replace(substeps=1)
    assert settings.most_substeps is not None
    number = wanted(settings, tightest(Loop(scenes, settings, device, fuse)))
    return settings.replace(substeps=int(min(number, settings.most_substeps)))


def tightest(loop: Loop) -> Limit:
    """Of the limits at present."""
    return min([ANY, *limits_now(loop, steps=LOOK)], key=lambda limit: limit.dt)


def wanted(settings: Settings, limit: Limit | None) -> float:
    """Substeps that a frame takes by a limit; infinite where no number does."""
    if limit is None:
        return settings.substeps
    safe = (settings.safety or SAFETY) * limit.dt
    return level(settings.dt / safe) if safe > 0.0 else math.inf


def level(number: float) -> float:
    """The next number of the series 2^(k / 2), rounded up."""
    if not number < math.inf:
        return math.inf
    k = math.ceil(LEVELS * math.log2(max(number, 1.0)) - 1e-9)
    return math.ceil(2.0 ** (k / LEVELS) - 1e-9)
