"""Reading: what users ask a simulation for, beside the arrays of its particles."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import Any

import numpy as np
import warp as wp

from .. import validate
from ..engine.frames import Frames
from ..engine.integrators.integrator import Integrator
from ..engine.limit import Limit
from ..engine.loop import Loop
from ..engine.model import Model
from ..engine.neighbors.lists import Neighbors
from ..engine.state import State
from ..instruments.diagnostics import Diagnostics, measure
from ..instruments.explain import Explanation, explain
from ..instruments.ledger.accounts import Accounts
from ..instruments.ledger.ledger import Ledger, read
from ..instruments.loads import force_on, torque_on
from ..instruments.stability import Stability, stability
from ..instruments.watchdog.incident import Incident
from ..instruments.watchdog.watch import Watchdog
from ..interactions.fields.field_force import FieldForce
from ..interactions.fluid.interpolation import interpolate
from ..interactions.fluid.sph import SPH
from ..output import checkpoint
from ..pictures.render.camera import Camera
from ..pictures.render.image import Image
from ..scene.constraint_base import ConstraintBase
from ..scene.part import Interaction
from ..scene.scene import Scene
from ..scene.settings import Settings
from ..scene.thermostat import Thermostat
from .access import Access, World, Writer


class Reading(Access):
    """The part of :class:`~particlesim.Simulation` that leaves it as it is.

    It is made of a loop, what runs its frames, and its instruments; none of them knows it.
    """

    loop: Loop
    frames: Frames
    watchdog: Watchdog
    accounts: Accounts | None
    writer: Writer
    # Of the loop.
    scenes: Sequence[Scene]
    model: Model
    device: Any
    state: State
    neighbors: Neighbors
    interactions: Sequence[Interaction]
    constraints: Sequence[ConstraintBase]
    thermostats: Sequence[Thermostat]
    integrator: Integrator

    def _show(self, loop: Loop) -> None:
        """Have what the loop is made of at hand, by the same names."""
        self.loop, self.scenes = loop, loop.scenes
        self.model, self.device, self.state = loop.model, loop.model.device, loop.state
        self.neighbors, self.integrator = loop.neighbors, loop.integrator
        self.interactions, self.constraints = loop.interactions, loop.constraints
        self.thermostats = loop.thermostats

    @property
    def settings(self) -> Settings:
        """The knobs, with numbers in the place of what was left open."""
        return self.loop.settings

    @property
    def limiter(self) -> Limit | None:
        """What the last frame's number of substeps was chosen by, where it is adaptive."""
        return self.loop.limiter

    @property
    def incidents(self) -> list[Incident]:
        """What the watchdog has found, and done about it."""
        return self.watchdog.incidents

    @property
    def frozen(self) -> list[int]:
        """Worlds that stand still since the watchdog froze them; :meth:`reset` frees them."""
        return sorted(self.watchdog.frozen)

    @property
    def world_count(self) -> int:
        """How many worlds."""
        return self.loop.model.world_count

    @property
    def particle_count(self) -> int:
        """Particles of all worlds."""
        return self.loop.model.particle_count

    @property
    def frame(self) -> int:
        """Frames since the start."""
        return self.loop.frame

    @property
    def time(self) -> float:
        """Simulated time since the start [s]."""
        return self.loop.time

    def get(self, name: str) -> np.ndarray:
        """A per-particle array, copied to the host."""
        return self.loop.get(name)

    def world(self, index: int) -> World:
        """A view of one world."""
        return World(self.loop, self.writer, index)

    def field(self, part: FieldForce) -> np.ndarray:
        """The field of a :class:`~particlesim.FieldForce` at the nodes of its grid, (x, y, z).

        Args:
            part: Of the scene of a world, whose field it is.
        """
        return self.loop.bound("Simulation.field", part).read_field(part)

    def force(self, constraint: ConstraintBase) -> np.ndarray:
        """Force by, or on, a constraint, of the last substep [force].

        Args:
            constraint: Of the scene, or one of :attr:`constraints`.

        Returns:
            Of a constraint on tuples the estimate on the end that feels most, |lam| |grad C| /
            dt^2, (m,), in the order of its tuples; world by world where it stands for several. Of a
            boundary what particles exert on it, (3,), or (worlds, 3) where it stands for several:
            those that touch it, and fluids by pressure and, where they stick, by shear.

        Raises:
            ValueError: It is no part of this simulation, or neither of these.
        """
        bound = self.loop.bound("Simulation.force", constraint)
        if not bound.solid:
            return bound.read_force(constraint)
        return self._of(constraint, bound, force_on(self.loop, bound))

    def torque(self, boundary: ConstraintBase) -> np.ndarray:
        """Torque on a boundary about where its pivot is, of the last substep [force * length].

        That of the forces that :meth:`force` sums, each at the middle of the particle: what the
        boundary gains of angular momentum is what the particles lose. The pivot is what it turns
        about: that of a plane its point, of a box, sphere, capsule or cylinder the middle (of an
        open box the origin), of others their ``pivot``.

        Args:
            boundary: Of the scene, or one of :attr:`constraints`.

        Returns:
            (3,), or (worlds, 3) where it stands for several.

        Raises:
            ValueError: It is no boundary of this simulation; a periodic scene.
        """
        bound = self.loop.bound("Simulation.torque", boundary)
        if not bound.solid:
            raise validate.fail(
                "Simulation.torque", "boundary", "be a boundary", bound.name, "name a Boundary"
            )
        return self._of(boundary, bound, torque_on(self.loop, bound))

    def _of(self, part: ConstraintBase, bound: ConstraintBase, found: np.ndarray) -> np.ndarray:
        """The rows of the worlds whose part this is."""
        chosen = found[[part is bound or part is peer for peer in bound.peers]]
        return chosen[0] if len(chosen) == 1 else chosen

    def broken(self, constraint: ConstraintBase) -> np.ndarray:
        """Which tuples of a constraint have broken, (m,) bool, like :meth:`force`."""
        return self.loop.bound("Simulation.broken", constraint).read_broken(constraint)

    def interpolate(
        self, fluid: SPH, points: Any, field: Any, *, world: int = 0, normalized: bool = False,
        derivative: str | None = None,
    ) -> np.ndarray | wp.array:  # fmt: skip
        """A field of a fluid anywhere, or a derivative: A(r) = sum_j V_j A_j W(|r - r_j|, h).

        With V_j = m_j / rho_j (Monaghan 2005, sec. 2). At the present positions. Away from the
        fluid it is 0; at a free surface it falls to 0 over the reach of W, like the sum of the
        weights. Derivatives are sums at the particles, over what the field differs by there, so
        that they are 0 for constants, and elsewhere interpolated like a field:

            grad A_i = sum_j V_j (A_j - A_i) grad_i W_ij            (Monaghan 2005, sec. 2.2)
            lap A_i = 2 sum_j V_j (A_i - A_j) W'_ij / r_ij          (Brookshaw 1985)

        Args:
            fluid: An ``SPH`` of the scene, or of :attr:`interactions`.
            points: Where, (k, 3) [length]; None: at the fluid's particles, in their order.
            field: ``"density"``, ``"velocity"`` or another array of the state or attribute of the
                particles by name; or values, (n,) or (n, 3), of the fluid's particles in order or
                of all particles of the world.
            world: Whose fluid.
            normalized: Divide by sum_j V_j W (Shepard 1968), which makes constants exact up to the
                surface. Gradients are multiplied by the inverse of sum_j V_j (x_j - x_i) grad_i W,
                which makes those of linear fields exact (Randles and Libersky 1996); what is linear
                of a field is taken out of laplacians, which are divided by -sum_j V_j r W' / d.
                Where particles lie in disorder, laplacians keep an error of some percent however
                many there are, and without this one that grows with them.
            derivative: ``"gradient"``, dA_a / dx_b [a, b] of a vector; ``"divergence"`` or
                ``"curl"`` of a vector; ``"laplacian"``; None: the field itself.

        Returns:
            (k,) or (k, 3), of the gradient of a vector (k, 3, 3); float64. A Warp array of the
            simulation's precision (of numbers, vec3 or mat33) where the points are one, or where
            there are none and the field is one: values do not leave the device then, and are not
            looked at for what is not finite.

        Raises:
            ValueError: Points or values of wrong shape or not finite, a world, a fluid or a name
                that is not there, the divergence of numbers.
        """
        bound = self.loop.bound("Simulation.interpolate", fluid)
        return interpolate(bound, points, field, world, normalized, derivative)

    def save(self, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
        """Write a checkpoint: all that is needed to go on from here, bit for bit.

        Args:
            path: A ``.npz`` file; it appears whole or not at all.
            overwrite: Replace an existing file.

        Raises:
            ValueError: Another suffix. FileExistsError: It exists, and ``overwrite`` is not set.
            OSError: The folder is missing, or the file could not be written.
        """
        checkpoint.save(self.frames, self.watchdog, path, overwrite)

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
            camera: None: one that sees all; of more than 1000 particles, it may leave out up to
                1 % at each edge that are far off.
            color: Name of a value to colour particles by, as ``color_by`` of
                ``ps.UsdRecorder``; None: each group has its own colour.
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

        return render(self, path, width, height, camera, color, **options)

    def _repr_png_(self) -> bytes | None:
        """A picture for notebooks, where Pillow is installed."""
        from ..pictures.render.preview import notebook_picture

        return notebook_picture(self)

    def stability(self) -> Stability:
        """The largest safe substep of every part, now and on the path ahead, and what binds.

        The simulation goes on for some hundred steps of its own and is put back as it was; see
        :mod:`particlesim.instruments.foresight`. Of large scenes only the present is looked at.
        """
        return stability(self.loop)

    def diagnostics(self) -> Diagnostics:
        """Conserved quantities of every world at the present time."""
        return measure(self.loop)

    def ledger(self) -> Ledger:
        """Work and impulse of every interaction and constraint since the start, world by world.

        Raises:
            ValueError: ``settings.ledger`` is not set.
        """
        return read(self.accounts)

    def explain(self) -> Explanation:
        """What is allocated, compiled and launched, and why."""
        return explain(self.frames)
