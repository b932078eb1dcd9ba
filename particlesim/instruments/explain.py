"""Explain: what a simulation allocates, compiles and launches."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

from ..engine.execution.launch import Launch, When
from ..engine.frames import Frames
from ..engine.report import Report
from ..scene.scene import ARGUMENTS

LISTS = "pair lists"  # who launches for them


@dataclass(frozen=True, repr=False)
class Explanation(Report):
    """What one substep takes. ``str()`` makes the report.

    arrays: bytes per particle of each array of the state. unread: attributes of the particles that
    no part reads, and so have none. lists: one line for each pair list.
    launches: (owner, kernel, rows) of each launch of a substep; ``conditional`` ones run only where
    they are needed: when neighbour lists are rebuilt, or their part asks for it.
    """

    title: str
    arrays: dict[str, float]
    unread: list[str]
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
        """Launches of every substep, beside those of a rebuild and alike."""
        return len(self.launches)

    def __str__(self) -> str:
        lines = [self.title, "", f"arrays ({self.bytes_per_particle:.0f} bytes per particle)"]
        lines += [f"  {name:<20} {size:6.1f} B" for name, size in self.arrays.items()]
        if self.unread:
            lines += [f"  of no part's: {', '.join(self.unread)}"]
        lines += ["", "pair lists", *([f"  {line}" for line in self.lists] or ["  none"])]
        rebuilt = [each for each in self.conditional if each[0] == LISTS]
        due = [each for each in self.conditional if each[0] != LISTS]
        for heading, launches in (
            (f"a substep: {len(self.launches)} launches", self.launches),
            ("when neighbour lists are rebuilt", rebuilt),
            ("where they are needed", due),
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


def explain(frames: Frames) -> Explanation:
    """Describe what a loop's frames take."""
    loop, model = frames.loop, frames.loop.model
    count = max(1, model.particle_count)
    executor = frames.executor(loop.settings.substeps)
    frame = executor.frame
    always, sometimes = [], []
    for operation in frame.substep.operations:
        if isinstance(operation, When):
            sometimes += [(o.owner, kernel_name(o), o.dim) for o in operation.body.launches()]
        elif isinstance(operation, Launch):
            always.append((operation.owner, kernel_name(operation), operation.dim))
    arrays = {name: a.capacity / count for name, a in loop.state.arrays.items()}
    for observer in loop.observers.all:
        arrays[f"({observer.name})"] = observer.memory / count
    total = sum(arrays.values()) + sum(each.memory for each in loop.neighbors.lists) / count
    execution = "graph or threads, as measured in the first frames"
    if executor.chosen:
        execution = executor.chosen.name
    if frame.host:
        who = {f"{each.owner} acts on the host ({each.reason})": None for each in frame.host}
        execution += f"; no graph, which would be faster, since {' and '.join(who)}"
    worlds = f"{model.world_count} worlds of " if model.world_count > 1 else ""
    return Explanation(
        title=(
            f"{worlds}{model.particle_count // max(1, model.world_count)} particles on "
            f"{model.device}, "
            f"{loop.settings.precision}, {loop.integrator.name}, {loop.settings.substeps} substeps "
            f"of {loop.settings.substep:g}"
        ),
        arrays=arrays,
        unread=[name for name in model.attributes if name not in {*ARGUMENTS, *loop.state.arrays}],
        lists=[each.describe() for each in loop.neighbors.lists],
        launches=always,
        conditional=sometimes,
        bytes_per_particle=total,
        execution=execution,
    )
