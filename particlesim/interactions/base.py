"""Interaction: what acts at the start of a substep, and how laws are bound to their arguments."""

from __future__ import annotations

import copy
import weakref
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from .. import validate
from ..scene.law import Law

if TYPE_CHECKING:
    import warp as wp

    from ..engine.model import Model
    from ..engine.neighbors.lists import Neighbors
    from ..engine.probing.probe import Probe
    from ..engine.state import State
    from ..instruments.stability.report import Limit

# Per-particle quantities that a law may name, beside the attributes of the scene.
QUANTITIES = frozenset({"position", "velocity", "mass", "radius", "density"})


class Bindable:
    """Something a scene describes and a simulation prepares: interactions and constraints.

    A simulation works on a copy, so that a scene can be simulated many times; ``peers`` are the
    corresponding ones of all worlds. What is read from the original is read from the copy in the
    simulation made last.
    """

    peers: Sequence[Any]
    _latest: Any = None

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

    def bind(self, peers: Sequence[Any]) -> Any:
        """A copy for one simulation."""
        bound = copy.copy(self)
        bound.peers = list(peers)
        for peer in peers:
            peer._latest = weakref.ref(bound)
        bound._latest = None
        return bound

    @property
    def bound(self) -> Any:
        """This, or its copy in the simulation made last."""
        if "peers" in self.__dict__:
            return self
        latest = self._latest() if self._latest is not None else None
        if latest is None:
            raise ValueError(
                f"{self.name}: it must be part of a running Simulation to be read; make one first."
            )
        return latest


class Interaction(Bindable):
    """A force. Subclasses say what they need and do one thing.

    ``requires`` names per-particle arrays of the state; ``cutoff`` is the distance within which
    neighbours are looked for, or None.
    """

    requires: frozenset[str] = frozenset({"force"})
    cutoff: float | None = None
    group: Any = None

    def prepare(self, model: Model, neighbors: Neighbors) -> None:
        """Once: choose members, request neighbours, build parameter arrays and kernels."""
        raise NotImplementedError

    def attach(self, model: Model, state: State) -> None:
        """Once, when all arrays exist: gather them into the structs that the kernels take."""

    def apply(self, state: State, neighbors: Neighbors, dt: float) -> None:
        """Add forces: launches only."""
        raise NotImplementedError

    def measure(self, state: State, energy: wp.array, virial: wp.array) -> None:
        """Add the potential energy and the virial of each particle (float64), on demand."""

    def limits(self, probe: Probe) -> list[Limit]:
        """Bounds on the substep at the present state (see ``Simulation.stability``).

        By default from how ``apply`` answers to small changes of positions and velocities. An
        interaction whose ``apply`` keeps anything from one call to the next says it otherwise.
        """
        return probe.response(self)

    def reset(self, worlds: Sequence[int]) -> None:
        """Forget what these worlds have left behind."""

    def columns(self, names: Mapping[str, Any]) -> dict[str, np.ndarray]:
        """Parameters of all worlds, one row a world: floats, or NumPy's own whole numbers."""
        rows = {name: [peer.parameters[name] for peer in self.peers] for name in names}
        return {
            name: np.array(row, np.int32 if isinstance(row[0], np.integer) else np.float64)
            for name, row in rows.items()
        }


class Arguments:
    """How the parameters of a law are filled: by particles' quantities or by given values.

    Args:
        owner: For errors.
        law: The law; its first ``skip`` parameters are filled by whoever calls it.
        given: Values by keyword.
        suffixes: ``("",)`` for one particle; ``("_i", "_j")`` for a pair, whose quantities are
            named ``mass_i``, ``charge_j`` and so on.
    """

    def __init__(
        self,
        owner: str,
        law: Law,
        skip: int,
        given: Mapping[str, Any],
        suffixes: Sequence[str],
        extra: Sequence[str] = (),
    ):
        self.owner, self.law = owner, law
        self.names = list(law.parameters)[skip:]
        self.quantities: set[str] = set()
        self.values: dict[str, Any] = {}
        self.sources: list[tuple[str, str]] = []  # (quantity or parameter or extra, name)
        validate.known(owner, given, self.names, f"parameter of {law.name}")
        for name in self.names:
            suffix = next((s for s in suffixes if s and name.endswith(s)), "")
            base = name[: len(name) - len(suffix)]
            if name in given:
                self.values[name] = self._value(name, given[name])
                self.sources.append(("parameter", name))
            elif name in extra:
                self.sources.append(("extra", name))
            elif (suffix or "" in suffixes) and name not in law.defaults:
                self.quantities.add(base)
                self.sources.append((f"quantity{suffix}", base))
            elif name in law.defaults:
                self.values[name] = self._value(name, law.defaults[name])
                self.sources.append(("parameter", name))
            else:
                raise validate.fail(
                    owner,
                    name,
                    f"be given, as {law.name}({', '.join(law.parameters)}) asks for it",
                    None,
                    f"pass {name}=..., or name a particle's quantity"
                    + (f" ({' or '.join('mass' + s for s in suffixes)})" if suffixes else ""),
                )

    def check(self, attributes: Mapping[str, Any]) -> None:
        """All quantities exist in the scene."""
        for name in sorted(self.quantities):
            if name not in QUANTITIES and name not in attributes:
                allowed = sorted({*QUANTITIES, *attributes} - {"pinned"})
                raise ValueError(
                    f"{self.owner}: {name} must be given or be one of the particles' "
                    f"{', '.join(allowed)}, got nothing; pass {name}=... or "
                    f"add_particles(..., {name}=...)."
                )

    def source(self, index: Mapping[str, str], extra: Mapping[str, str] | None = None) -> list[str]:
        """Source text of each argument; ``index`` maps a suffix to the particle's index."""
        text = []
        for kind, name in self.sources:
            if kind == "parameter":
                text.append(f"p.{name}")
            elif kind == "extra":
                text.append((extra or {})[name])
            else:
                field = "x" if name == "position" else name
                text.append(f"d.{field}[{index[kind.removeprefix('quantity')]}]")
        return text

    def _value(self, name: str, value: Any) -> Any:
        if self.law.parameters[name] is int:
            return np.int32(validate.whole(self.owner, name, value, minimum=-(2**31)))
        if np.ndim(value) == 0:
            return validate.number(self.owner, name, value)
        return validate.vector(self.owner, name, value)
