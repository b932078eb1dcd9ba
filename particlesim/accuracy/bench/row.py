"""Rows: what one entry of a race took, and what it found."""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..stopwatch import Span

OFTEN, MORE = 3.0, 10  # a block is disturbed by so many times the median of switches, and so many


@dataclass
class Row:
    """An entry on so many cores.

    Args:
        name: Of the simulation or program.
        peer: Whether it is another program.
        precision: In words.
        threads: Cores.
        work: Units of a block. particles: How many; 0: none to count.
        spans: What the blocks took, in turn.
        answers: What it found. memory: Bytes that it holds.
        failure: Why it did not get to the end.
    """

    name: str
    peer: bool
    precision: str
    threads: int
    work: float = 0.0
    particles: int = 0
    spans: list[Span] = field(default_factory=list)
    answers: dict[str, float] = field(default_factory=dict)
    memory: float = math.nan
    failure: str = ""

    @functools.cached_property
    def kept(self) -> np.ndarray:
        """Which blocks count: not those with far more switches than the others, (blocks,)."""
        switches = np.array([each.switches for each in self.spans])
        return switches <= OFTEN * np.median(switches) + MORE

    @property
    def dropped(self) -> int:
        """Blocks that were disturbed."""
        return int((~self.kept).sum())

    @property
    def seconds(self) -> np.ndarray:
        """Wall seconds of the blocks, disturbed ones nan, (blocks,)."""
        return np.where(self.kept, [each.wall for each in self.spans], np.nan)

    @property
    def block(self) -> float:
        """Wall seconds of a block, the median."""
        return float(np.nanmedian(self.seconds))

    @property
    def rate(self) -> float:
        """Units a second."""
        return self.work / self.block

    @property
    def spread(self) -> float:
        """The interquartile range of the blocks' times, over their median."""
        low, high = np.nanpercentile(self.seconds, (25, 75))
        return float(high - low) / self.block

    @property
    def cpu(self) -> float:
        """CPU seconds of a block, all threads together, the median."""
        return float(np.nanmedian(np.where(self.kept, [each.cpu for each in self.spans], np.nan)))

    def times(self, other: Row) -> float:
        """How many times as fast as another one: the median over rounds in which both count."""
        rounds = min(len(self.seconds), len(other.seconds))
        each = other.seconds[:rounds] / self.seconds[:rounds]
        found = np.nanmedian(each) if np.isfinite(each).any() else other.block / self.block
        return float(found) * self.work / other.work

    @property
    def plain(self) -> dict[str, Any]:
        """As numbers and words, for a file."""
        values: dict[str, Any] = {
            name: value for name, value in vars(self).items() if name not in ("spans", "kept")
        }
        if not self.failure:
            values |= {
                "wall": [each.wall for each in self.spans],
                "cpu": [each.cpu for each in self.spans],
                "switches": [each.switches for each in self.spans],
                "kept": self.kept.tolist(),
                "median": self.block,
                "spread": self.spread,
                "rate": self.rate,
            }
        return {name: _finite(value) for name, value in values.items()}


def _finite(value: Any) -> Any:
    """JSON has no nan."""
    return None if isinstance(value, float) and not math.isfinite(value) else value
