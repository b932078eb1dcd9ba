"""What a scene is made of beside particles, as abstract parts: what acts on them."""

from __future__ import annotations

import copy
import inspect
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from .. import validate


class Part:
    """Something that a scene describes and a simulation prepares: what acts on particles.

    A simulation works on a copy, so that a scene can be simulated many times; ``peers`` are the
    corresponding ones of all worlds. The methods from ``prepare`` on are called by the engine, and
    on the copy only: ``model`` is its :class:`~particlesim.engine.model.Model`, ``state`` its
    :class:`~particlesim.engine.state.State`, ``neighbors`` its
    :class:`~particlesim.engine.neighbors.lists.Neighbors`.

    ``requires`` names the per-particle arrays that the state must have. ``host`` says that it works
    in Python or NumPy (see :class:`Interaction`).
    """

    requires: frozenset[str] = frozenset()
    host: bool = False
    evolves: frozenset[str] = frozenset()  # attributes of the particles that it changes in time
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

    def fault(self, world: int) -> str:
        """Why it has made the numbers of a world no numbers; empty where it has not."""
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

    def forget(self, arrays: Mapping[str, Any], worlds: Sequence[int]) -> None:
        """Zero the rows of these worlds, in arrays by name as of :meth:`persistent`."""
        for name, array in arrays.items():
            world = self.worlds(name, array)
            if world is not None:
                host = array.numpy().copy()
                host[np.isin(world, list(worlds))] = 0
                array.assign(host)

    def placed(self, worlds: Iterable[int]) -> None:
        """Positions in these worlds were written from outside."""


class Interaction(Part):
    """A force: subclasses say what they need and do one thing.

    In ``prepare`` it asks for what it looks at, ``neighbors.of(self)`` or a ``PairSum``; in
    ``apply`` it adds to ``state.force``. ``state`` is the present one; ``neighbors`` holds the pair
    lists, up to date for it. ``parameters``, where there are any, is a dict of numbers and
    3-vectors that may differ from world to world. ``cutoff`` is the distance within which
    neighbours are looked for; None: all pairs of a world. ``reads_velocity`` says that ``apply``
    reads velocities, which velocity Verlet then predicts, and methods of which stages go back in
    time refuse; None: if the class's source names them.

    ``apply`` is recorded once and replayed in every substep: ``wp.launch``, ``wp.copy``, ``zero_``
    and ``fill_`` are, with the numbers and arrays that they are given then, and so is
    :func:`particlesim.launch`, which threads share too. Who reads or writes arrays on the host, by
    ``numpy`` or ``assign``, changes his own attributes or draws from a generator among them is
    called in every substep instead, without a graph: slower, as ``Simulation.explain`` tells. Where
    something else differs from call to call, such as a number from elsewhere, set ``host = True``.

    Example:
        >>> import warp as wp
        >>> from particlesim import Interaction, Scene, Settings, Simulation
        >>> @wp.kernel(module="unique")
        ... def blow(wind: wp.vec3, force: wp.array(dtype=wp.vec3)):
        ...     i = wp.tid()
        ...     force[i] = force[i] + wind
        >>> class Wind(Interaction):
        ...     def __init__(self, wind):
        ...         self.wind = wp.vec3(*wind)
        ...
        ...     def prepare(self, model, neighbors):
        ...         self.model = model
        ...
        ...     def apply(self, state, neighbors, dt):
        ...         inputs = [self.wind, state.force]
        ...         wp.launch(blow, state.count, inputs, device=self.model.device)
        >>> scene = Scene()
        >>> leaf = scene.add_particles([(0, 0, 0)], mass=2.0)
        >>> wind = scene.add_interaction(Wind((1, 0, 0)))
        >>> sim = Simulation(scene, Settings(dt=0.5), device="cpu")
        >>> sim.run(4)
        >>> sim.velocity.round(5).tolist()
        [[1.0, 0.0, 0.0]]
    """

    requires: frozenset[str] = frozenset({"force"})
    cutoff: float | None = None
    reads_velocity: bool | None = None  # in any other way than that of ``follow``
    conservative: bool = False  # `measure` adds the potential of all that it does
    # It is right in ``model.box`` as it is at present, also for ``measure`` (see ``Barostat``).
    follows_box: bool = False
    # Adds its force to ``implicit_force`` too, where that is kept, df/dv to ``force_slope``, and
    # has ``follow``.
    implicit: bool = False
    # It answers to the force of all the others, and so comes last. It makes a kick of one step
    # right: only symplectic_euler takes it.
    answers: bool = False

    @property
    def depends_on_velocity(self) -> bool:
        """Whether its force does in any world; a method that goes back in time cannot take it."""
        return self.implicit or bool(self.reads_velocity)

    def apply(self, state: Any, neighbors: Any, dt: float) -> None:
        """Add forces."""
        raise validate.undefined(self, "apply(self, state, neighbors, dt)")

    def begin(self, state: Any, dt: float) -> None:
        """Before a substep's forces: its own comes to where it is foreseen to be with them."""

    def advance(self, state: Any, dt: float) -> None:
        """Its own goes on, as of a field, once in a substep; ``apply`` leaves that as it is."""

    def carry(self, state: Any, dt: float) -> None:
        """After forces outside a substep: what the next one of ``dt`` begins with."""

    def carried(self) -> list[Any]:
        """The arrays that ``carry`` writes, a row for each particle."""
        return []

    def iterated(self) -> list[Any]:
        """A :class:`~particlesim.engine.report.Solved` for all that it iterates in a substep."""
        return []

    def presses(self, wall: Part) -> Any:
        """What it exerts on a solid constraint by itself: rows, forces (k, 3); None: nothing."""

    def follow(self, state: Any, damps: bool) -> None:
        """Add (df/dv) u, by which the force differs where the velocity is u ahead.

        u is ``state.velocity_lead``; unless ``damps``, of df/dv the antisymmetric part alone. Only
        of an ``implicit`` one.
        """

    def measure(self, state: Any, energy: Any, virial: Any) -> None:
        """Add the potential energy and the virial of each particle (float64), on demand."""

    def measure_stress(self, state: Any, energy: Any, stress: Any) -> bool:
        """The same with the virial as a tensor, r_a F_b made symmetric: xx, yy, zz, yz, xz, xy.

        Returns:
            Whether it is known, and was added; if not, ``measure`` tells at least its trace.
        """
        return False

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


def names_velocity(kind: type) -> bool:
    """Whether the source of a class speaks of velocities; of one that has none, it may."""
    try:
        return "velocity" in inspect.getsource(kind)
    except (OSError, TypeError):
        return True
