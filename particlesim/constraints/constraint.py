"""Constraints on given tuples of particles, from one law C(x)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import warp as wp

from .. import validate
from ..engine import topology
from ..engine.execution.launch import launch
from ..engine.limit import Limit
from ..engine.model import Model
from ..engine.neighbors.lists import Neighbors
from ..engine.probe import Probe
from ..engine.state import State
from ..kernels.constraints import constraints as kernels
from ..kernels.constraints.constraint_force import virial_kernel
from ..scene.law import law as make_law
from .force import ConstraintForce
from .limits import constraint_limits
from .solving.reading import ReadTuples
from .solving.solvers import SOLVERS
from .solving.velocities import TupleVelocities
from .tuples import Tuples, bodies

OWN = ("compliance", "damping", "break_force")  # parameters of every constraint


class Constraint(ReadTuples):
    r"""C(x) = 0, or C(x) >= 0, on tuples of particles: XPBD with a gradient derived from C.

    In each iteration a tuple's multiplier lam, zero at the start of a substep, grows by

        dlam = (-C - alpha~ lam) / (sum w grad C . D + alpha~),  alpha~ = alpha / dt^2

    and its particles move by w_a D_a dlam (Macklin, Mueller and Chentanez 2016, eqs. 17 and 18). D
    is the gradient where the substep began (Ryckaert, Ciccotti and Berendsen 1977), which keeps
    angular momentum exactly; where that has turned too far, or pulls so hard that a substep does
    not resolve how the tuple swings, that where the particles are, which is stable at any step.
    Damping follows as an impulse on the velocities, implicit in them, so that what rests does not
    know of it. Tuples are solved one after the other, those that share no particle at once, or all
    at once (``Settings.solver``). The result is that of a spring of stiffness 1/alpha with a
    damper beta, however many iterations are made.

    Write C as a length or an angle rather than a square of it: a step follows the tangent of C,
    and is as good as the tangent. Tuples whose gradient vanishes, and those with all particles
    pinned, stay as they are.

    Args:
        law: ``C(x_0, ..., x_(k-1), ...)``: the first k parameters are the positions, ``wp.vec3``
            (in a periodic scene each the image next to the one before it, so that neighbours in a
            row must be within half a box), the others are given by keyword.
        particles: (m, k) indices, distinct within a row; (m,) for k = 1.
        compliance: alpha, the inverse of the stiffness [C / force], one or (m,), at least 0.
        damping: beta, force on C for its rate [force time / C], one or (m,), at least 0. A rigid
            constraint has nothing to damp.
        inequality: Hold C >= 0 only: acts while C < 0, and only pushes C up.
        break_force: Force on an end beyond which a tuple is gone for good [force], one or (m,),
            above 0; None: unbreakable.
        **parameters: The law's further parameters: one for all or (m,) numbers; (3,) or (m, 3)
            where the law takes a ``wp.vec3``.

    Raises:
        ValueError: Wrong shapes, indices or values; a parameter that is missing.
        TypeError: A parameter that the law does not have.

    Example:
        >>> import warp as wp
        >>> from particlesim import law
        >>> @law
        ... def distance(a: wp.vec3, b: wp.vec3, rest_length: float):
        ...     return wp.length(b - a) - rest_length
        >>> Constraint(distance, [(0, 1), (1, 2)], rest_length=1.0, compliance=1e-6).particles.shape
        (2, 2)
    """

    relative = False  # the evaluation takes positions from the first particle's
    unit = False  # its gradients have unit length
    carried = False  # of four: one that the start lacks is the present one, carried back

    def __init__(
        self, law: Any, particles: Any, *, compliance: Any = 0.0, damping: Any = 0.0,
        inequality: bool = False, break_force: Any = None, **parameters: Any,
    ):  # fmt: skip
        self.law = make_law(law)
        self.law.check_derivable(self.name)
        size = self._size(parameters)
        self.particles = topology.tuples(self.name, "particles", particles, size)
        self.inequality = bool(inequality)
        count = len(self.particles)
        self.compliance = topology.per_item(self.name, "compliance", compliance, count, minimum=0)
        self.damping = topology.per_item(self.name, "damping", damping, count, minimum=0)
        self.break_force = (
            None if break_force is None
            else topology.limits(self.name, "break_force", break_force, count)
        )  # fmt: skip
        self.parameters = self._values(parameters, size, count)

    def _size(self, given: dict[str, Any]) -> int:
        """How many positions the law takes: its first vectors, but for those given by keyword."""
        size = 0
        for name, kind in self.law.parameters.items():
            if kind is not wp.vec3 or name in given:
                break
            size += 1
        if not size:
            raise validate.fail(
                self.name, "law", "take positions (wp.vec3) first", self.law.name,
                "write def law(a: wp.vec3, b: wp.vec3, ...)",
            )  # fmt: skip
        return size

    def _values(self, given: dict[str, Any], size: int, count: int) -> dict[str, np.ndarray]:
        names = list(self.law.parameters)[size:]
        validate.known(self.name, given, names, f"parameter of {self.law.name}")
        values = {}
        for name in names:
            if name in OWN:
                raise validate.fail(
                    self.name, f"parameter {name} of {self.law.name}", "have a name of its own",
                    name, "rename it",
                )  # fmt: skip
            if name not in given and name not in self.law.defaults:
                raise validate.fail(
                    self.name, name,
                    f"be given, as {self.law.name}({', '.join(self.law.parameters)}) asks for it",
                    None, f"pass {name}=...",
                )  # fmt: skip
            value = given.get(name, self.law.defaults.get(name))
            width = 3 if self.law.parameters[name] is wp.vec3 else None
            values[name] = validate.rows(self.name, name, value, count, width)
        return values

    def kind(self) -> tuple[Any, ...]:
        return (
            type(self), self.law.key, self.particles.shape[1], self.inequality,
            self.breakable, tuple(self.parameters),
        )  # fmt: skip

    def links(self) -> np.ndarray:
        """Pairs to draw, (m, 2) indices in the scene; none unless the tuples are pairs."""
        return self.particles if self.particles.shape[1] == 2 else np.zeros((0, 2), dtype=np.int64)

    def as_force(self) -> ConstraintForce:
        """The same law as a penalty force, f = -grad C (C / alpha + beta dC/dt).

        Give it to ``add_interaction`` instead of adding the constraint.

        Raises:
            ValueError: A compliance of 0, whose force would be infinite; a ``break_force``; a
                yield.
        """
        return ConstraintForce(self)

    # The engine's side ------------------------------------------------------------------------

    def columns(self, model: Model, w: int) -> dict[str, np.ndarray]:
        """Parameters of each tuple of world w."""
        limit = self.break_force
        return {
            "compliance": self.compliance,
            "damping": self.damping,
            "break_force": np.zeros(len(self.particles)) if limit is None else limit,
            **self.parameters,
        }

    def evaluation(self, model: Model, item: Any) -> wp.Function:
        """C and its gradient as a Warp function (see kernels.constraints)."""
        return kernels.derived_evaluation(
            self.law.function(model.precision, self.name, float), self.particles.shape[1],
            tuple(self.parameters), model.precision, item,
        )  # fmt: skip

    def prepare(self, model: Model, neighbors: Neighbors) -> None:
        self.model = model
        self.tuples = Tuples(self.name, model, self.peers)
        self.count = self.tuples.count
        self._fit_compliance()

    def _fit_compliance(self) -> None:
        """What projection makes of the compliances is within the kernels' precision, too."""
        model, dt = self.model, self.model.settings.substep
        alpha = np.concatenate([peer.compliance for peer in self.peers])
        if dt > 0:
            once = alpha / dt
            model.fits(self.name, {"compliance/dt": once})
            model.fits(self.name, {"compliance/dt^2": once * model.mass_unit / dt})
            beta = np.concatenate([peer.damping for peer in self.peers])
            model.fits(self.name, {"damping dt": beta * dt / model.mass_unit})

    def attach(self, model: Model, state: State) -> None:
        if not self.count:
            return
        self.struct = self.tuples.struct()
        self.bodies = bodies(model, state)
        self.fresh = False  # whether the multipliers are yet to be made anew in this substep
        self.strain = wp.zeros_like(self.struct.lam)
        solved = self.tuples.solved(self, state)
        self.solver = SOLVERS[model.settings.solver](self, solved)
        self.velocities = TupleVelocities(self, solved)
        self.strain_kernel = kernels.strain_kernel(solved)
        self.virial_kernel = virial_kernel(solved)

    def begin(self, state: State, neighbors: Neighbors, dt: float) -> None:
        if self.count and dt > 0:
            self.fresh = True

    def project(self, state: State, neighbors: Neighbors, dt: float) -> None:
        if not self.count or dt <= 0:
            return
        # Static projection: no time passes, and nothing moves of itself.
        own = 0.0 if math.isinf(dt) else dt
        scale = 1.0 / dt * (1.0 / dt) if self.fresh else -1.0
        self.fresh = False
        self.solver.sweep(scale, own, 1.0 / dt)

    def go_on(self, count: wp.array, omega: wp.array) -> None:
        if self.count:
            self.solver.go_on(count, omega)

    def look(self, flag: wp.array, tolerance: float) -> None:
        if self.count:
            self.solver.look(flag, tolerance)

    def prepare_bounce(self, state: State, neighbors: Neighbors, bounces: Any, dt: float) -> None:
        if self.count:
            self.velocities.prepare_bounce()

    def bounce(self, state: State, neighbors: Neighbors, bounces: Any, dt: float) -> None:
        if self.count:
            self.velocities.bounce(bounces, dt)

    def finish(self, state: State, neighbors: Neighbors, dt: float) -> None:
        if self.count and dt > 0:
            self.velocities.straighten(dt)
            self.velocities.damp(dt)
        if self.count and self.break_force is not None:
            self._strain(may_break=True)

    def _strain(self, may_break: bool) -> None:
        inputs = [
            int(may_break), self.model.box, self.struct, self.bodies, self.strain,
        ]  # fmt: skip
        launch(self.strain_kernel, self.count, inputs, self.model.device)

    def measure_stress(self, state: State, energy: wp.array, stress: wp.array) -> bool:
        """Add the virial of the multipliers of the last substep, and the elastic energy."""
        if self.count:
            seats = self.tuples.seats
            inputs = [seats, self.model.box, self.struct, self.bodies, energy, stress]
            launch(self.virial_kernel, len(seats.particle), inputs, self.model.device)
        return True

    def limits(self, probe: Probe) -> list[Limit]:
        """None, as XPBD is implicit; how fast it damps is told."""
        return constraint_limits(self, probe)

    def complaint(self) -> str:
        """That places are too coarse for how far the particles of a tuple are from each other."""
        return self.tuples.complaint(self.name)

    def persistent(self) -> dict[str, wp.array]:
        return {"broken": self.struct.broken} if self.count and self.breakable else {}

    def readable(self) -> dict[str, wp.array]:
        return {"lam": self.struct.lam, "scale": self.struct.scale} if self.count else {}

    def worlds(self, name: str, array: wp.array) -> np.ndarray | None:
        return self.tuples.world if len(array) == self.count and name != "scale" else None

    def reset(self, worlds: Sequence[int]) -> None:
        self.forget({**self.persistent(), **self.readable()}, worlds)
