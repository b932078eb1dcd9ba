"""Which pairs a term counts, and what its law takes by the kinds of the two particles."""

import functools
from dataclasses import dataclass
from typing import Any

import warp as wp

from ..precision import native
from ..warp_internals import elements

WITHIN = "within_squared"  # the square of the cutoff, where it goes by kinds


@dataclass(frozen=True)
class Selection:
    """Source that a term has for it, in front of its law.

    Kinds are whole numbers from 0, in ``d.kind`` by slot. A parameter that goes by them is in as
    many fields of ``p`` as there are pairs of kinds, and in the local ``<name>_there`` of a term.
    They are chosen by comparisons: those with the kind of i are the same all along a loop over j,
    and a table would have to be gathered from.

    Args:
        kinds: How many there are; 0: nothing goes by them.
        tables: Parameters that go by them.
        excluded: At most so many partners does a particle not feel; they are in ``d.excluded``, by
            particle, and ``d.particle`` tells which are in the slots.
    """

    kinds: int = 0
    tables: tuple[str, ...] = ()
    excluded: int = 0

    def there(self, argument: str) -> str:
        """Source of a parameter, of what it would be if it did not go by kinds."""
        name = argument.removeprefix("p.")
        return f"{name}_there" if argument == f"p.{name}" and name in self.tables else argument

    def source(self) -> str:
        """Lines that find what goes by kinds, and whether the pair is ``counted``."""
        lines = []
        if self.tables:
            lines += ["kind_i = d.kind[i]", "kind_j = d.kind[j]"]
        for name in self.tables:
            rows = [
                chosen("kind_i", [f"p.{place(name, a, b)}" for a in range(self.kinds)])
                for b in range(self.kinds)
            ]
            lines += [f"{name}_{b} = {row}" for b, row in enumerate(rows)]
            columns = [f"{name}_{b}" for b in range(self.kinds)]
            lines.append(f"{name}_there = {chosen('kind_j', columns)}")
        conditions = []
        if WITHIN in self.tables:
            conditions.append(f"r2 < {WITHIN}_there")
        if self.excluded:
            lines.append("apart_of = excludes(d.excluded, d.particle[i], d.particle[j])")
            conditions.append("apart_of == 0")
        lines += [f"counted_{k} = {each}" for k, each in enumerate(conditions)]
        return "".join(f"    {line}\n" for line in lines)

    def counted(self, value: str) -> str:
        """Source of a number that is 0 of a pair that does not count."""
        for k in range((WITHIN in self.tables) + (self.excluded > 0)):
            value = f"wp.where(counted_{k}, {value}, real(0.0))"
        return value

    def functions(self) -> dict[str, wp.Function]:
        """What the lines call."""
        return {"excludes": excludes_function(self.excluded)} if self.excluded else {}


ALL = Selection()


def place(name: str, a: int, b: int) -> str:
    """The field of a parameter for kinds a and b."""
    return f"{name}_{a}_{b}"


def chosen(kind: str, of_kinds: list[str]) -> str:
    """One of these by its number, the last where it is none of those before."""
    text = of_kinds[-1]
    for k in range(len(of_kinds) - 2, -1, -1):
        text = f"wp.where({kind} == real({k}.0), {of_kinds[k]}, {text})"
    return text


def excluded_type(count: int) -> Any:
    """The partners that one particle does not feel; -1 where there are fewer."""
    return wp.types.vector(length=count, dtype=wp.int32)


@functools.cache
def excludes_function(count: int) -> wp.Function:
    """``excludes(rows, i, j)``: not 0 if j is in the row of i, of particles."""
    row = excluded_type(count)
    snippet = f"""
    const int* own = {elements("rows", "int")} + {count} * (long long)i;
    int hit = 0;
    for (int k = 0; k < {count}; ++k) hit |= own[k] == j;
    return hit;
"""

    def excludes(rows: wp.array(dtype=row), i: int, j: int) -> int: ...

    return native(excludes, snippet, after_gradients=False)
