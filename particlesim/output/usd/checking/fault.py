"""What is wrong in a USD file, one line a fault."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable
from dataclasses import dataclass


@dataclass(frozen=True)
class Fault:
    """Something that a reader of the file would stumble over.

    Args:
        kind: What sort of fault: ``"length"``, ``"not finite"``, ``"missing extent"``, ... or the
            name that a validator of usd-core gives it.
        prim: Path of the prim; ``"/"`` for the stage itself.
        attribute: Name of the attribute or of the metadata; may be empty.
        frame: Time code of the first frame with it; None: it does not depend on the frame.
        condition: What must be, ``"be finite"``.
        value: What is.
        remedy: What to do.
        others: Further frames with the same fault.

    Example:
        >>> print(Fault("not finite", "/World/water", "points", 3, "be finite", "nan", "look why"))
        /World/water.points at frame 3: must be finite, got nan; look why.
    """

    kind: str
    prim: str
    attribute: str
    frame: float | None
    condition: str
    value: str
    remedy: str
    others: tuple[float, ...] = ()

    def __str__(self) -> str:
        where = f"{self.prim}.{self.attribute}" if self.attribute else self.prim
        if self.frame is not None:
            where += f" at frame {self.frame:g}"
        if self.others:
            where += f" and {len(self.others)} more up to {self.others[-1]:g}"
        line = f"{where}: must {self.condition}, got {self.value}; {self.remedy}."
        return " ".join(line.split())


def type_fault(prim: str, name: str, frame: float | None, held: str, wanted: str) -> Fault:
    """A value of another type than its attribute; half precision has a kind of its own."""
    kind = "half" if "half" in held or "quath" in held else "type"
    return Fault(kind, prim, name, frame, f"hold {wanted}", held, f"write {wanted}")


def collapsed(faults: Iterable[Fault]) -> list[Fault]:
    """One fault for those that differ in the frame only, in the order in which they were found."""
    groups: dict[tuple[str, str, str], list[Fault]] = {}
    for fault in faults:
        groups.setdefault((fault.kind, fault.prim, fault.attribute), []).append(fault)
    result = []
    for group in groups.values():
        first = min(group, key=_frame)
        frames = {fault.frame for fault in group if fault.frame is not None} - {first.frame}
        result.append(dataclasses.replace(first, others=tuple(sorted(frames))))
    return result


def _frame(fault: Fault) -> float:
    return float("-inf") if fault.frame is None else fault.frame
