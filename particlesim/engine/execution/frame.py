"""A frame as it was recorded."""

from __future__ import annotations

from dataclasses import dataclass, field

from .launch import Host, Program


@dataclass
class Frame:
    """What a frame does: its start, its substep ``repeat`` times, and its end."""

    repeat: int
    before: Program = field(default_factory=Program)
    substep: Program = field(default_factory=Program)
    after: Program = field(default_factory=Program)

    @property
    def largest(self) -> int:
        """Rows of the largest launch."""
        return max((each.dim for part in self.parts for each in part.launches()), default=0)

    @property
    def parts(self) -> tuple[Program, Program, Program]:
        """The three programs."""
        return self.before, self.substep, self.after

    @property
    def host(self) -> list[Host]:
        """What keeps it from being a graph."""
        return [each for part in self.parts for each in part.operations if isinstance(each, Host)]

    def load(self) -> None:
        """Compile and load every kernel now rather than in the middle of a capture."""
        for part in self.parts:
            for operation in part.launches():
                operation.record()
