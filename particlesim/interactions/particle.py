"""Forces on each particle by itself: laws of position, velocity, time and attributes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import warp as wp

from .. import validate
from ..engine.execution.launch import launch
from ..engine.model import Model, filled, structure_of
from ..engine.neighbors.lists import Neighbors
from ..engine.state import State
from ..kernels.interactions import particle as kernels
from ..kernels.precision import FLOAT64
from ..scene.law import Law, law
from ..scene.law import law as make_law
from ..scene.part import Interaction
from .laws.arguments import WIDTHS, Arguments
from .laws.consistency import of_particle_force
from .pulses import unseen


class ParticleForce(Interaction):
    """Force on each particle by a law of its own state: of a field f(x, t), or of a potential.

    A potential is enough: without a law of the force it is f = -dU/dx, derived by ``wp.grad``
    inside the kernel.

    In a periodic box the force repeats with it: laws take the position in the box. The energy
    is what has been climbed: with every crossing of an axis it changes by what the potential
    rises across the box, so that of a uniform force it is -f.x at the unwrapped position. It is
    conserved where the potential is a sum of one for each axis, or the same on opposite sides.

    A force that depends on velocity is implicit in it (see ``Integrator``) by its derivative; of a
    law that Warp cannot derive, as one that loops, it is explicit.

    Args:
        law: Returns the force, ``wp.vec3``; None: it is derived from ``potential``. Its parameters
            are, by name, the particle's ``position``, ``velocity``, ``mass``, ``radius`` or an
            attribute given to ``add_particles``; ``time`` [time]; or values given here. A law of
            time is computed in double precision, where the time keeps its digits.
        group: Which particles feel it; None: all.
        potential: Law of the potential energy, a float, of the same parameters; None: none is
            reported. With a law that takes neither the velocity nor the time it must be that of
            the force, f = -dU/dx: else a run warns.
        **parameters: Numbers or 3-vectors for the laws' other parameters.

    Raises:
        ValueError: Neither law is given, or the force is to be derived of a potential that does
            not take ``position`` or that Warp cannot derive.

    Example:
        >>> import warp as wp
        >>> @law
        ... def trap(position: wp.vec3, stiffness: float):
        ...     return 0.5 * stiffness * wp.dot(position, position)
        >>> ParticleForce(potential=trap, stiffness=2.0).parameters
        {'stiffness': 2.0}
        >>> @law
        ... def wave(position: wp.vec3, time: float, height: float):
        ...     return wp.vec3(0.0, height * wp.sin(position[0] - time), 0.0)
        >>> ParticleForce(wave, height=0.1).potential is None
        True
    """

    def __init__(
        self, law: Any = None, group: Any = None, *, potential: Any = None, **parameters: Any
    ) -> None:
        self.law, self.potential = (each and make_law(each) for each in (law, potential))
        self.group = group
        laws = [each for each in (self.law, self.potential) if each is not None]
        if self.law is None:
            self._check_derived()
        taken = {name for each in laws for name in each.parameters}
        validate.known(self.name, parameters, taken, f"parameter of {laws[0].name}")
        self.arguments = [self._arguments(each, parameters) for each in laws]
        self.parameters: dict[str, Any] = {}
        self.quantities: set[str] = set()
        timed = False
        for each in self.arguments:
            self.parameters |= each.values
            self.quantities |= each.quantities
            timed |= _timed(each)
        self.requires = frozenset({"force"} | self.quantities | ({"time"} if timed else set()))
        self.implicit = self.law is not None and _is_implicit(self.law)
        self.reads_velocity = "velocity" in self.quantities and not self.implicit
        self.conservative = self.potential is not None and not (
            timed or "velocity" in self.quantities
        )

    def _check_derived(self) -> None:
        if self.potential is None:
            raise validate.fail(
                self.name, "law", "be given, or a potential", None, "pass a law of the force"
            )
        if "position" not in self.potential.parameters:
            raise validate.fail(
                self.name, f"potential {self.potential.name}", "take position, to be derived by it",
                ", ".join(self.potential.parameters), "or give the law of the force itself",
            )  # fmt: skip
        self.potential.check_derivable(self.name)

    def _arguments(self, each: Law, given: dict[str, Any]) -> Arguments:
        own = {name: value for name, value in given.items() if name in each.parameters}
        return Arguments(self.name, each, 0, own, ("",), extra=("time",))

    def kind(self) -> tuple[Any, ...]:
        laws = [each and each.key for each in (self.law, self.potential)]
        return (type(self), *laws, tuple(self.parameters))

    def prepare(self, model: Model, neighbors: Neighbors) -> None:
        self.model = model
        for each in self.arguments:
            each.check(model.attributes)
        # Of the laws as they are now.
        # Those of time in double precision: in single it has no digits left after a while.
        self.functions = [
            given.law.function(
                FLOAT64 if _timed(given) else model.precision,
                self.name,
                wp.vec3 if given.law is self.law else float,
            )
            for given in self.arguments
        ]
        members = model.members([peer.group for peer in self.peers], self.name)
        self.count = len(members)
        self.members = model.array(members, wp.int32)
        self.world = model.array(model.world_of[members], wp.int32)
        # A struct needs a field; the count does no harm.
        columns = self.columns(self.parameters) or {"none": np.zeros(model.world_count)}
        model.fits(self.name, columns)
        self.Params, self.params = model.parameters("ParticleParameters", columns)

    def attach(self, model: Model, state: State) -> None:
        fields = {"x": state.position}
        fields |= {name: state[name] for name in sorted(self.quantities - {"position"})}
        if "time" in self.requires:
            fields["time"] = state.time
        self.repeated = bool(model.periodic) and "position" in self.quantities
        if self.repeated:
            fields["image"] = state.image
        self.Data = structure_of("ParticleData", fields)
        self.data = filled(self.Data, fields)
        names = self.arguments[0].names
        derived = names.index("position") if self.law is None else None
        vectorised = model.vectorised
        self.kernel = kernels.force_kernel(*self._called(0), derived, *self._types, vectorised)
        self.block = kernels.BLOCK if vectorised else 1

    @property
    def _types(self) -> tuple[Any, Any, Any]:
        return self.model.precision, self.Data, self.Params

    def _called(self, k: int) -> tuple[wp.Function, tuple[str, ...]]:
        """The k-th law's function, and the source of its arguments."""
        given = self.arguments[k]
        source = given.source({"": "i"}, {"time": "d.time[w]"})
        at = {"d.x[i]": "x"}  # which may be another place
        called = [at.get(each, each) for each in source]
        if _timed(given):
            kinds = [given.law.parameters[name] for name in given.names]
            called = [_widened(*each) for each in zip(called, kinds, strict=True)]
        return self.functions[k], tuple(called)

    def apply(self, state: State, neighbors: Neighbors, dt: float) -> None:
        if not self.implicit:
            self._launch(self.kernel, state.force, block=self.block)
            return
        own = state.implicit_force if "implicit_force" in state else None
        kernel = kernels.slope_kernel(*self._called(0), self._by, own is not None, *self._types)
        self._launch(kernel, state.force, state.force_slope, own)

    def follow(self, state: State, damps: bool) -> None:
        kernel = kernels.follow_kernel(*self._called(0), self._by, damps, *self._types)
        self._launch(kernel, state.velocity_lead, state.force)

    @property
    def _by(self) -> int:
        return self.arguments[0].names.index("velocity")

    def _launch(self, kernel: wp.Kernel, *arrays: wp.array | None, block: int = 1) -> None:
        inputs = [self.members, self.world, self.params, self.data, *arrays]
        launch(kernel, self.count, inputs, self.model.device, block)

    def complaint(self) -> str:
        """That the potential is not that of the force, that a law leaves the precision, or that it
        is large between substeps only.
        """
        return of_particle_force(self) or (unseen(self) if _timed(self.arguments[0]) else "")

    def measure(self, state: State, energy: wp.array, virial: wp.array) -> None:
        if self.potential is not None:
            called = self._called(-1)
            kernel = kernels.energy_kernel(*called, *self._types, self.repeated)
            inputs = [self.members, self.world, self.params, self.model.box, self.data, energy]
            launch(kernel, self.count, inputs, self.model.device)


def _widened(source: str, kind: Any) -> str:
    """Source of an argument in double precision."""
    if kind in WIDTHS:
        numbers = (f"wp.float64({source}[{k}])" for k in range(WIDTHS[kind]))
        return f"wp.vec{WIDTHS[kind]}d({', '.join(numbers)})"
    return source if kind is int else f"wp.float64({source})"


def _is_implicit(law: Law) -> bool:
    """Whether it takes the velocity, and Warp can derive it."""
    try:
        law.check_derivable("ParticleForce")
    except ValueError:
        return False
    return law.parameters.get("velocity") is wp.vec3


def _timed(given: Arguments) -> bool:
    """Whether a law takes the time."""
    return ("extra", "time") in given.sources


@law
def _height_energy(position: wp.vec3, mass: float, acceleration: wp.vec3):
    return -mass * wp.dot(acceleration, position)


class UniformGravity(ParticleForce):
    """f = m g, with potential energy -m g.x.

    Args:
        acceleration: g [length/time^2], (3,).
        group: Which particles feel it; None: all.

    Example:
        >>> UniformGravity((0, -9.81, 0)).parameters["acceleration"].tolist()
        [0.0, -9.81, 0.0]
    """

    def __init__(self, acceleration: Sequence[float] = (0.0, -9.81, 0.0), group: Any = None):
        g = validate.vector(self.name, "acceleration", acceleration, unit="length/time^2")
        super().__init__(None, group, potential=_height_energy, acceleration=g)


@law
def _constant_energy(position: wp.vec3, force: wp.vec3):
    return -wp.dot(force, position)


class ConstantForce(ParticleForce):
    """The same force on every particle, f = F, with potential energy -F.x.

    Args:
        force: F [force], (3,).
        group: Which particles feel it; None: all.
    """

    def __init__(self, force: Sequence[float], group: Any = None):
        value = validate.vector(self.name, "force", force, unit="force")
        super().__init__(None, group, potential=_constant_energy, force=value)


@law
def _drag(velocity: wp.vec3, linear: float, quadratic: float, flow: wp.vec3):
    relative = velocity - flow
    return -(linear + quadratic * wp.length(relative)) * relative


class Drag(ParticleForce):
    """f = -(a + b |u|) u, with u the velocity relative to a flow.

    Linear drag is Stokes' law with a = 6 pi mu R; quadratic with b = C rho A / 2.

    Args:
        linear: a [mass/time], at least 0.
        quadratic: b [mass/length], at least 0.
        flow: Velocity of the surrounding medium [length/time], (3,).
        group: Which particles feel it; None: all.
    """

    def __init__(
        self,
        linear: float = 0.0,
        quadratic: float = 0.0,
        flow: Sequence[float] = (0.0, 0.0, 0.0),
        group: Any = None,
    ):
        super().__init__(
            _drag,
            group,
            linear=validate.number(self.name, "linear", linear, minimum=0.0, unit="mass/time"),
            quadratic=validate.number(
                self.name, "quadratic", quadratic, minimum=0.0, unit="mass/length"
            ),
            flow=validate.vector(self.name, "flow", flow, unit="length/time"),
        )
