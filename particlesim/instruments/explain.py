"""Explain: what a simulation allocates, compiles and launches."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import TYPE_CHECKING

from ..engine.execution.launch import Launch, When

if TYPE_CHECKING:
    from ..simulation.simulation import Simulation


@dataclass(frozen=True)
class Explanation:
    """What one substep takes. ``str()`` makes the report.

    arrays: bytes per particle of each array of the state. lists: one line for each pair list.
    launches: (owner, kernel, rows) of each launch of a substep; ``conditional`` ones run only
    when neighbour lists are rebuilt.
    """

    title: str
    arrays: dict[str, float]
    lists: list[str]
    launches: list[tuple[str, str, int]]
    conditional: list[tuple[str, str, int]]
    bytes_per_particle: float
    execution: str

    @property
    def kernels(self) -> list[str]:
        """Names of the kernels that are compiled, without repeats."""
        return list(dict.fromkeys(name for _, name, _ in [*self.launches, *self.conditional]))

    @property
    def launches_per_substep(self) -> int:
        """Launches of every substep, beside those of a rebuild."""
        return len(self.launches)

    def __str__(self) -> str:
        lines = [self.title, "", f"arrays ({self.bytes_per_particle:.0f} bytes per particle)"]
        lines += [f"  {name:<20} {size:6.1f} B" for name, size in self.arrays.items()]
        lines += ["", "pair lists", *([f"  {line}" for line in self.lists] or ["  none"])]
        for heading, launches in (
            (f"a substep: {len(self.launches)} launches", self.launches),
            ("when neighbour lists are rebuilt", self.conditional),
        ):
            if launches:
                lines += ["", heading]
                for (who, kernel, rows), times in Counter(launches).items():
                    count = f"{times} x " if times > 1 else ""
                    lines.append(f"  {who:<20} {count}{kernel} over {rows}")
        return "\n".join([*lines, "", f"execution: {self.execution}"])


def kernel_name(operation: Launch) -> str:
    """The kernel's function, without the factory that made it."""
    return str(operation.kernel.key).rpartition("__")[2]


def explain(sim: Simulation) -> Explanation:
    """Describe a simulation."""
    count = max(1, sim.particle_count)
    frame = sim.executor.frame
    always, sometimes = [], []
    for operation in frame.substep.operations:
        if isinstance(operation, When):
            sometimes += [(o.owner, kernel_name(o), o.dim) for o in operation.body.launches()]
        elif isinstance(operation, Launch):
            always.append((operation.owner, kernel_name(operation), operation.dim))
    arrays = {name: a.capacity / count for name, a in sim.state.arrays.items()}
    if sim.accounts is not None:
        arrays["(ledger)"] = sim.accounts.memory / count
    total = sum(arrays.values()) + sum(each.memory for each in sim.neighbors.lists) / count
    chosen = sim.executor.chosen
    worlds = f"{sim.world_count} worlds of " if sim.world_count > 1 else ""
    return Explanation(
        title=(
            f"{worlds}{sim.particle_count // max(1, sim.world_count)} particles on {sim.device}, "
            f"{sim.settings.precision}, {sim.integrator.name}, {sim.settings.substeps} substeps "
            f"of {sim.settings.substep:g}"
        ),
        arrays=arrays,
        lists=[each.describe() for each in sim.neighbors.lists],
        launches=always,
        conditional=sometimes,
        bytes_per_particle=total,
        execution=chosen.name if chosen else "graph or threads, as measured in the first frames",
    )
