"""What a scene is made of beside particles: interactions and constraints, as abstract parts."""

from __future__ import annotations

import copy
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from .. import validate


class Part:
    """Something that a scene describes and a simulation prepares: interactions and constraints.

    A simulation works on a copy, so that a scene can be simulated many times; ``peers`` are the
    corresponding ones of all worlds. The methods from ``prepare`` on are called by the engine, and
    on the copy only: ``model`` is its :class:`~particlesim.engine.model.Model`, ``state`` its
    :class:`~particlesim.engine.state.State`, ``neighbors`` its
    :class:`~particlesim.engine.neighbors.lists.Neighbors`.

    ``requires`` names the per-particle arrays that the state must have.
    """

    requires: frozenset[str] = frozenset()
    group: Any = None
    peers: Sequence[Any]
    model: Any  # once prepared

    @property
    def name(self) -> str:
        """What reports and errors call it."""
        return type(self).__name__

    def kind(self) -> tuple[Any, ...]:
        """What must agree for scenes to be simulated in one batch."""
        return (type(self),)

    def links(self) -> np.ndarray:
        """Pairs of particles to draw as lines, (m, 2) indices in the scene."""
        return np.zeros((0, 2), dtype=np.int64)

    def _elsewhere(self, what: str, *arguments: str) -> ValueError:
        """The error for reading of a description what only a simulation has."""
        call = ", ".join(["part", *arguments])
        return validate.fail(
            f"{self.name}.{what}", "part", "be read through a simulation", "the scene's own",
            f"write sim.{what}({call})",
        )  # fmt: skip

    def bind(self, peers: Sequence[Any]) -> Any:
        """A copy for one simulation."""
        bound = copy.copy(self)
        bound.peers = list(peers)
        return bound

    def prepare(self, model: Any, neighbors: Any) -> None:
        """Once: choose members, request neighbours, build parameter arrays and kernels."""
        raise validate.undefined(self, "prepare(self, model, neighbors)")

    def attach(self, model: Any, state: Any) -> None:
        """Once, when all arrays exist: gather them into the structs that the kernels take."""

    def limits(self, probe: Any) -> list[Any]:
        """Bounds on the substep at the present state (see ``Simulation.stability``).

        Args:
            probe: A :class:`~particlesim.engine.probe.Probe`.

        Returns:
            A :class:`~particlesim.engine.limit.Limit` for each.
        """
        return []

    def complaint(self) -> str:
        """What is to be said of the start, once a run begins; empty where it fits."""
        return ""

    def persistent(self) -> dict[str, Any]:
        """Arrays that outlive a substep, for snapshots and checkpoints."""
        return {}

    def readable(self) -> dict[str, Any]:
        """Arrays of the last substep that users can read something from, for checkpoints."""
        return {}

    def worlds(self, name: str, array: Any) -> np.ndarray | None:
        """The world of each row of one of these arrays; None: its rows are no world's own."""
        model = self.model
        if len(array) == model.particle_count:
            return model.world_of
        return np.arange(model.world_count) if len(array) == model.world_count else None

    def reset(self, worlds: Sequence[int]) -> None:
        """Forget what these worlds have left behind."""

    def placed(self, worlds: Iterable[int]) -> None:
        """Positions in these worlds were written from outside."""


class Interaction(Part):
    """A force: subclasses say what they need and do one thing.

    In ``prepare`` it asks for what it looks at, ``neighbors.of(self)`` or a ``PairSum``; in
    ``apply`` it adds to ``state.force`` and launches only (:func:`particlesim.launch`).
    ``state`` is the present one; ``neighbors`` holds the pair lists, up to date for it.
    ``parameters``, where there are any, is a dict of numbers and 3-vectors that may differ from
    world to world. ``cutoff`` is the distance within which neighbours are looked for; None: all
    pairs of a world.
    """

    requires: frozenset[str] = frozenset({"force"})
    cutoff: float | None = None

    def apply(self, state: Any, neighbors: Any, dt: float) -> None:
        """Add forces: launches only."""
        raise validate.undefined(self, "apply(self, state, neighbors, dt)")

    def measure(self, state: Any, energy: Any, virial: Any) -> None:
        """Add the potential energy and the virial of each particle (float64), on demand."""

    def limits(self, probe: Any) -> list[Any]:
        """Bounds on the substep at the present state (see ``Simulation.stability``).

        By default from how ``apply`` answers to small changes of positions and velocities. An
        interaction whose ``apply`` keeps anything from one call to the next says it otherwise.
        """
        return probe.response(self)

    def columns(self, names: Mapping[str, Any]) -> dict[str, np.ndarray]:
        """Parameters of all worlds, one row a world: floats, or NumPy's own whole numbers."""
        rows = {name: [peer.parameters[name] for peer in self.peers] for name in names}
        return {
            name: np.array(row, np.int32 if isinstance(row[0], np.integer) else np.float64)
            for name, row in rows.items()
        }


class ConstraintBase(Part):
    """Acts on positions after integration.

    In a substep: ``begin`` once, then ``project`` in each iteration, in turn with the other
    constraints, then, when the velocities have followed the projection, ``finish``. Corrections
    are added to ``state.position`` and, the same amount, to ``state.correction``.
    """

    def begin(self, state: Any, neighbors: Any, dt: float) -> None:
        """At the start of a substep's projection: launches only."""

    def project(self, state: Any, neighbors: Any, dt: float) -> None:
        """One sweep: launches only."""
        raise validate.undefined(self, "project(self, state, neighbors, dt)")

    def finish(self, state: Any, neighbors: Any, dt: float) -> None:
        """After the velocities have followed: restitution, breaking. Launches only."""

    def read_force(self, part: Part) -> np.ndarray:
        """See ``Simulation.force``; ``part`` is this, or the one of some worlds' scenes."""
        raise self._unknown("force")

    def read_broken(self, part: Part) -> np.ndarray:
        """See ``Simulation.broken``."""
        raise self._unknown("broken")

    def _unknown(self, what: str) -> ValueError:
        return validate.fail(
            f"Simulation.{what}", "constraint", "hold tuples of particles", self.name,
            "name a Constraint",
        )  # fmt: skip

    def shapes(self) -> list[dict[str, Any]]:
        """Static shapes to draw."""
        return []
