"""Neighbors: the pair lists of a simulation, shared by all who can share them."""

from __future__ import annotations

import numpy as np

from .all_pairs import AllPairs
from .model import Model
from .state import State
from .verlet import VerletList

SHARE = 1.25  # lists are shared up to this ratio of cutoffs: (5/4)^3 is twice the candidates


class Neighbors:
    """The pair lists of a simulation, shared by all who can share them."""

    def __init__(self, model: Model):
        self.model = model
        self.lists: list[AllPairs] = []

    def request(
        self,
        user: str,
        members: np.ndarray,
        cutoff: np.ndarray | None,
        names: set[str],
        *,
        for_constraint: bool = False,
    ) -> AllPairs:
        """The list for these members within ``cutoff`` (one a world; None: all pairs).

        ``names`` are the per-particle arrays to have in slot order. Lists of the same members
        are shared when their cutoffs are alike.
        """
        found = self._shared(members, cutoff)
        if found is None:
            found = (
                AllPairs(self.model, members)
                if cutoff is None
                else VerletList(self.model, members, cutoff)
            )
            self.lists.append(found)
        elif isinstance(found, VerletList) and cutoff is not None:
            found.widen(cutoff)
        found.request(names)
        found.users.append(user)
        found.for_constraints |= for_constraint
        found.for_interactions |= not for_constraint
        return found

    def _shared(self, members: np.ndarray, cutoff: np.ndarray | None) -> AllPairs | None:
        for other in self.lists:
            if not np.array_equal(other.members_host, members):
                continue
            if cutoff is None:
                if type(other) is AllPairs:
                    return other
            elif isinstance(other, VerletList):
                ratio = np.maximum(cutoff, other.cutoff) / np.minimum(cutoff, other.cutoff)
                if ratio.max(initial=1.0) <= SHARE:
                    return other
        return None

    def allocate(self, state: State) -> None:
        """Make all lists, once every user has asked."""
        for each in self.lists:
            each.allocate(state)

    def update(self, state: State) -> None:
        """Before the interactions: bring their lists up to date."""
        for each in self.lists:
            if each.for_interactions:
                each.update(state)

    def update_for_constraints(self, state: State) -> None:
        """After integration: bring the constraints' lists up to date."""
        for each in self.lists:
            if each.for_constraints:
                each.update(state)

    def renew(self, state: State, worlds: list[int]) -> None:
        """The positions of these worlds were written from outside: make their rows anew."""
        for each in self.verlet:
            each.renew(state, worlds)

    @property
    def generation(self) -> int:
        """Changes when rows have moved to new arrays; what was recorded before is then void."""
        return sum(each.generation for each in self.verlet)

    @property
    def verlet(self) -> list[VerletList]:
        """The lists with rows."""
        return [each for each in self.lists if isinstance(each, VerletList)]

    @property
    def overflowing(self) -> bool:
        """Some row was full."""
        return any(each.overflow.numpy()[0] for each in self.verlet)

    def lengthen(self) -> None:
        """Make room in the rows that were full; whoever calls has them made again."""
        for each in self.verlet:
            each.lengthen()

    def grow(self) -> bool:
        """Lengthen the rows that were full; True if some were and the step must be redone."""
        return any([each.grow() for each in self.verlet])
